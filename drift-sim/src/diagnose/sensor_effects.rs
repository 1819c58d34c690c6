//! Effects that no prediction of y shows, only what is left of it: noise that grows from some time on, and a grid of values.
//!
//! Both are looked for in the whitened residual of the final model, and both must hold on the hold-out. A model that is
//! wrong leaves a residual whose size follows the motion, so a change of noise counts only where every part after it is
//! noisier than every part before it.

use crate::physics::{Kind, Term};

use super::fit::{Fit, mean_square};
use super::holdout;
use super::noise_change;
use super::quantum;
use super::signals::Signals;

/// What a change of noise must gain, in log-likelihood.
const LEAST_GAIN: f64 = 30.0;
/// The least ratio that is called a change.
const LEAST_RATIO: f64 = 1.3;
/// Parts before and after the change that are compared, each.
const PARTS: usize = 4;
/// Share of the residual's variance that rounding to the grid must explain.
const LEAST_SHARE: f64 = 0.5;
/// Log-likelihood of one sample that rounding explains all of: only for the report.
const PER_SAMPLE: f64 = 0.5;

/// A term found in the residual.
#[derive(Debug, Clone)]
pub struct SensorEffect {
    /// The term.
    pub term: Term,
    /// Half width of its first parameter's 95 % interval.
    pub half_width: f64,
    /// Gain in log-likelihood on the training part.
    pub train_gain: f64,
    /// The effect on the hold-out in its standard errors.
    pub holdout_errors: f64,
}

impl SensorEffect {
    /// The fit with the effect in its closed loop; the prediction error stays as it is.
    #[must_use]
    pub fn beside(&self, fit: &Fit) -> Fit {
        let mut fit = fit.clone();
        fit.model.nominal.physics.push(self.term.clone());
        fit
    }
}

/// The sensor effects that hold on both recordings, `rounding` (`grid`) among them; `continued` says that the hold-out is the same
/// recording's end.
pub fn find(
    fit: &Fit,
    rounding: Option<SensorEffect>,
    train: &Signals,
    unseen: &Signals,
    continued: bool,
) -> Vec<SensorEffect> {
    let Some(rest) = holdout::residual(fit, unseen, &fit.whitener) else { return Vec::new() };
    let held = fit.whitener.apply(&rest);
    let noise = noisier(fit, train, &held, continued);
    rounding.into_iter().chain(noise).collect()
}

fn noisier(fit: &Fit, train: &Signals, held: &[f64], continued: bool) -> Option<SensorEffect> {
    let white = fit.white();
    let change = noise_change::find(&white)?;
    let (before, after) = white.split_at_checked(change.at)?;
    let quiet = loudest(before)?;
    if change.gain < LEAST_GAIN || change.ratio - change.half_width < LEAST_RATIO || softest(after)? <= quiet
    {
        return None;
    }
    let (old, new) = if continued { (before, held) } else { held.split_at_checked(change.at)? };
    let (ratio, errors) = ratio_of(old, new)?;
    if softest(new)? <= loudest(old)? || !(0.6..1.6).contains(&(ratio / change.ratio)) {
        return None;
    }
    let at = (change.at + fit.whitener.order()) as f64 * train.sample_time_s;
    let kind = Kind::named("sensor_noise").ok()?;
    let term = Term { kind, parameters: vec![change.ratio], onset_s: at, spans: Vec::new() };
    term.check().ok()?;
    Some(SensorEffect {
        term,
        half_width: change.half_width,
        train_gain: change.gain,
        holdout_errors: errors,
    })
}

fn part_powers(x: &[f64]) -> Option<Vec<f64>> {
    let length = x.len() / PARTS;
    (length >= 8).then(|| x.chunks_exact(length).map(mean_square).collect())
}

fn loudest(x: &[f64]) -> Option<f64> {
    part_powers(x)?.into_iter().reduce(f64::max)
}

fn softest(x: &[f64]) -> Option<f64> {
    part_powers(x)?.into_iter().reduce(f64::min)
}

/// Ratio of the standard deviations, and the log of it in its standard errors for Gaussian noise.
fn ratio_of(old: &[f64], new: &[f64]) -> Option<(f64, f64)> {
    let (a, b) = (mean_square(old), mean_square(new));
    if !(a > 0.0 && b > 0.0) {
        return None;
    }
    let ratio = libm::sqrt(b / a);
    let error = libm::sqrt(0.5 / old.len() as f64 + 0.5 / new.len() as f64);
    Some((ratio, libm::log(ratio) / error))
}

/// A grid that y lies on in both recordings, where rounding to it explains most of what the fit leaves.
pub(super) fn grid(fit: &Fit, train: &Signals, holdout: &Signals) -> Option<SensorEffect> {
    let grid = quantum::grid(&train.y)?;
    let again = quantum::grid(&holdout.y)?;
    let explained = grid.step * grid.step / 12.0;
    if (grid.step / again.step - 1.0).abs() > 0.01 || explained < LEAST_SHARE * mean_square(&fit.residual) {
        return None;
    }
    let kind = Kind::named("quantization").ok()?;
    let term = Term { kind, parameters: vec![grid.step], onset_s: 0.0, spans: Vec::new() };
    term.check().ok()?;
    let n = |signals: &Signals| signals.y.iter().filter(|y| y.is_finite()).count() as f64;
    Some(SensorEffect {
        term,
        half_width: grid.half_width,
        train_gain: PER_SAMPLE * n(train),
        holdout_errors: libm::sqrt(n(holdout)),
    })
}
