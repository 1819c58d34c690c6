//! What a user should know of a calibration, in plain sentences.

use drift_core::ChannelKind;

use super::{ChannelFit, timing};
use crate::baseline_file::BaselineFile;

/// Below so many effective windows there is a warning: the promise then costs much.
pub const FEW_WINDOWS: f64 = 200.0;
/// Lag-1 correlation from which there is a warning.
const NOTABLE_CORRELATION: f64 = 0.1;
/// Distance from the line, in sigmas of the other windows, from which there is a warning.
const OUTLIER: f64 = 10.0;
/// Skewness from which there is a warning.
const NOTABLE_SKEWNESS: f64 = 0.5;

/// All of them.
pub(super) fn collect(
    file: &BaselineFile,
    channels: &[ChannelFit],
    without_x: &[ChannelKind],
    choice: &timing::Choice,
    invalid: usize,
) -> Vec<String> {
    let mut said = Vec::new();
    let timing = &file.timing;
    if timing.hop_blocks < timing.window_blocks {
        said.push("windows overlap: decisions are correlated; the thresholds allow for it, but it finds nothing sooner".to_owned());
    }
    let times = timing.window_s() / choice.correlation_s;
    if times < timing::CORRELATION_TIMES * 0.75 {
        said.push(format!(
            "the window is {times:.1} correlation times of e, u or r long; 20 make windows nearly independent"
        ));
    }
    let least = file.calibration.effective_windows;
    if least < FEW_WINDOWS {
        said.push(format!("worth {least:.0} independent windows only: the thresholds are wide for it; 200 or more are better"));
    }
    if invalid > 0 {
        said.push(format!("{invalid} windows had too few valid samples and were left out"));
    }
    for kind in without_x {
        let name = kind.name();
        let x = kind.meaning().x_is_constant;
        said.push(format!("{name}: {x}, so there is no line to judge by: left unlearned"));
    }
    for channel in channels {
        let name = channel.kind.name();
        if let Some((window, sigmas)) = farthest(channel).filter(|(_, sigmas)| *sigmas > OUTLIER) {
            said.push(format!(
                "{name}: healthy window {} lies {sigmas:.0} of the others' sigmas off the line: it widens the thresholds; was it healthy, or does a recording begin with a step?",
                window + 1
            ));
        }
        if channel.lag1.abs() > NOTABLE_CORRELATION {
            said.push(format!(
                "{name}: neighbouring residuals correlate by {:.2}; the thresholds allow for it",
                channel.lag1
            ));
        }
        if channel.skewness.abs() > NOTABLE_SKEWNESS {
            said.push(format!(
                "{name}: residuals are skewed ({:.2}); the limits differ for it",
                channel.skewness
            ));
        }
    }
    said
}

/// The window farthest off the line, and how far in sigmas of the others.
fn farthest(channel: &ChannelFit) -> Option<(usize, f64)> {
    let squares = || channel.fit.residuals.iter().map(|e| e * e);
    let (window, most) = squares().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let others = (squares().sum::<f64>() - most) / (channel.fit.n as f64 - 1.0);
    (others > 0.0).then(|| (window, (most / others).sqrt()))
}
