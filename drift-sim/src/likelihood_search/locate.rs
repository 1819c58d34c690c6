//! When the mismatch acts: from the onset on of what was named; of what acts all the time, the stretches over which the refitted nominal loop
//! leaves more of y than the improved one.

use crate::diagnose::locate::{MismatchSpan, stretches};
use crate::estimate::fit::Fit;
use crate::estimate::signals::{Signals, mean_square};

use super::decide::independent_share;

/// The spans in which what `improved` has beyond `refit` acts or shows; times are those of the recording.
pub fn spans(refit: &Fit, improved: &Fit, signals: &Signals) -> Vec<MismatchSpan> {
    match first_onset_s(improved) {
        Some(onset_s) if onset_s > 0.0 => {
            let score = libm::sqrt((refit.objective() - improved.objective()).max(0.0));
            let (from_s, to_s) = (signals.origin_s + onset_s, signals.origin_s + signals.duration_s());
            vec![MismatchSpan { from_s, to_s, score }]
        }
        _ => shown(refit, improved, signals),
    }
}

/// When the first of the named terms begins, in seconds from the start.
fn first_onset_s(fit: &Fit) -> Option<f64> {
    let realised = fit.hypothesis.realise(&fit.point)?;
    let named = realised.model.physics.get(fit.hypothesis.stated..)?;
    named.iter().map(|term| term.onset_s).min_by(f64::total_cmp)
}

fn shown(refit: &Fit, improved: &Fit, signals: &Signals) -> Vec<MismatchSpan> {
    let samples = signals.len();
    let of = |fit: &Fit| fit.rows.z.get(..samples.min(fit.rows.z.len())).unwrap_or(&[]).to_vec();
    // In units of the improved loop's noise.
    let factor = refit.rows.sensor_sd / improved.rows.sensor_sd;
    let white = of(improved);
    let share = independent_share(improved);
    let level = mean_square(&white).max(1e-300);
    let own = mean_square(&of(refit)).max(1e-300);
    let scale = libm::sqrt(level / own) * factor.max(1.0);
    let before: Vec<f64> = of(refit).iter().map(|z| z * scale).collect();
    stretches(&before, &white, share, signals)
}
