//! From the residuals to every channel's detectors: the process is fitted, the run length to design for is found, thresholds are
//! simulated for it, and what that caution costs in delay is computed.

use drift_core::Detectors;

use super::{ChannelFit, Options, caution, detector, process, thresholds, windows};
use crate::baseline_file::BaselineFile;
use crate::sentences::{typed, typed_to};
use crate::{Error, Result};

/// What the caution costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Run length that the thresholds were made for, over the promised one.
    pub run_length_factor: f64,
    /// Mean delay (decisions) to a shift of one sigma in one channel, by the first of that channel's CUSUM, EWMA, SPRT and
    /// Shewhart limits; mean over the channels.
    pub delay: f64,
    /// The same with thresholds for exactly the promised run length, as exact knowledge of the healthy loop would allow.
    pub delay_exact: f64,
}

/// Order of the residuals' autoregression, windows.
fn memory(n: usize, overlap: usize) -> usize {
    (6.max(3 * (overlap - 1))).min(n / 25).min(60)
}

/// Sets every channel's detectors.
pub(super) fn set_thresholds(
    channels: &mut [ChannelFit],
    windows: &windows::Windows,
    options: &Options,
    file: &BaselineFile,
    overlap: usize,
) -> Result<Cost> {
    let n = windows.rows.len();
    let decisions = decisions(options, file);
    if !(5.0..=1e9).contains(&decisions) {
        let hop_h = file.timing.hop_s() / 3600.0;
        return Err(Error::new(format!(
            "--false-alarm-every {} is one in {} decisions",
            typed(options.false_alarm_every_h),
            typed_to(decisions, 3)
        ))
        .allowed(format!(
            "5 to 1e9 decisions, which are {} to {} h at this hop",
            typed_to(5.0 * hop_h, 3),
            typed_to(1e9 * hop_h, 3)
        )));
    }
    let columns: Vec<Vec<f64>> =
        channels.iter().map(|c| c.fit.residuals.iter().map(|e| e / c.fit.rmse).collect()).collect();
    let worth = channels.iter().map(|c| c.n_for_variance).fold(n as f64, f64::min);
    let process = process::Process::fit(&columns, &windows.stretches, memory(n, overlap), worth);
    let (choice, k) = (options.detectors, options.k);
    let tuning = detector::Tuning { k, lambda: options.lambda };
    let caution = caution::Caution::new(worth, options.confidence);
    let designed = decisions * caution.run_length_factor();
    let margins: Vec<caution::Margin> = channels.iter().map(|c| caution.margin(k, c.n_effective)).collect();
    let simulated =
        thresholds::Simulated::new(&process, choice, tuning, options.simulated_decisions, &margins);
    let detectors = simulated.detectors(designed);
    let exact = simulated.exact(decisions);
    for (channel, detectors) in channels.iter_mut().zip(&detectors) {
        channel.detectors = *detectors;
    }
    Ok(Cost {
        run_length_factor: designed / decisions,
        delay: mean_delay(&process, &detectors),
        delay_exact: mean_delay(&process, &exact),
    })
}

/// Decisions between false alarms.
pub(super) fn decisions(options: &Options, file: &BaselineFile) -> f64 {
    options.false_alarm_every_h * 3600.0 / file.timing.hop_s()
}

/// Mean decisions to a shift of one sigma in one channel, mean over channels.
fn mean_delay(process: &process::Process, detectors: &[Detectors]) -> f64 {
    let one = |(law, detectors): (&process::ChannelProcess, &Detectors)| {
        detector::ROWS.iter().find_map(|row| row.delay(detectors, law)).unwrap_or(f64::NAN)
    };
    let delays: Vec<f64> = process.channels.iter().zip(detectors).map(one).collect();
    delays.iter().sum::<f64>() / delays.len() as f64
}
