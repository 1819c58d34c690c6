//! When the mismatch acts: stretches over which the refitted nominal loop leaves more of y than the improved one.

use crate::diagnose::locate::MismatchSpan;
use crate::estimate::fit::Fit;
use crate::estimate::signals::Signals;

use super::decide::independent_share;

/// Stretches that the recording is cut into.
const STRETCHES: usize = 64;
/// Standard errors from which a stretch is part of a span.
const SPAN_ERRORS: f64 = 5.0;

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
    let length = before.len().div_ceil(STRETCHES).max(1);
    let floor = level;
    let score = |stretch: &[f64]| {
        let ratio = mean_square(stretch) / floor;
        let samples = share * stretch.len() as f64;
        // Of a Gaussian variance, against that of the floor.
        if ratio > 1.0 { libm::sqrt(samples * (ratio - 1.0 - libm::log(ratio))) } else { 0.0 }
    };
    let mut found: Vec<MismatchSpan> = Vec::new();
    for (index, stretch) in before.chunks(length).enumerate() {
        let score = score(stretch);
        if score < SPAN_ERRORS {
            continue;
        }
        let at = |sample: usize| signals.origin_s + (sample as f64) * signals.sample_time_s;
        let (from_s, to_s) = (at(index * length), at(index * length + stretch.len()));
        match found.last_mut() {
            Some(last) if from_s - last.to_s < 1.5 * length as f64 * signals.sample_time_s => {
                last.to_s = to_s;
                last.score = libm::hypot(last.score, score);
            }
            _ => found.push(MismatchSpan { from_s, to_s, score }),
        }
    }
    found
}

fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64
}
