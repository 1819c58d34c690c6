//! When the mismatch acts: stretches over which the refitted nominal loop leaves more of y than the improved one.

use crate::diagnose::locate::{MismatchSpan, stretches};
use crate::estimate::fit::Fit;
use crate::estimate::signals::Signals;

use super::decide::independent_share;

/// The spans in which `refit` leaves more than `improved`; times are those of the recording.
pub fn spans(refit: &Fit, improved: &Fit, signals: &Signals) -> Vec<MismatchSpan> {
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

fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64
}
