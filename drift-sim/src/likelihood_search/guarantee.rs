//! The decision with a guarantee (`--guarantee ALPHA`): the running likelihood ratio. What the best kind says of all samples before it has seen them is held
//! against the most that each kind can say of them with hindsight. It says of the first part its marginal likelihood (by Schwarz's approximation:
//! the likeliest point less half a logarithm of the samples for each free number), and of the rest, given the first, the likelihood at the point
//! that was fitted to the first. Where the truth is one of the kinds, it leaves the set with a probability of ALPHA at most, in recordings of any
//! length (Wasserman, Ramdas & Balakrishnan 2020, "Universal inference", section 8: any density that is chosen beforehand may stand above the
//! maximum). It assumes that the noise is of the model's kind, that the kinds are all there are, and that the fits reach the maximum; innovations
//! that are correlated still count by their independent share.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::physics::Kind;

use super::decide::{Decision, Scored, independent_share, left_of, scored};
use super::rivals::Field;

/// Steps of a fit to everything.
const STEPS: usize = 12;
/// How many times as far as the loop file says numbers may be from it: a rival is held to its best, not to its likeliest.
const FREER: f64 = 10.0;

/// Judges a field: what is left is what the recordings don't speak against.
pub fn decide_surely(field: &Field, data: &Data, alpha: f64) -> Decision {
    let scored = scored(field, data.is_colored());
    let nothing = || Decision { scored: scored.clone(), ..Decision::default() };
    let Some(best) = field.rivals.first() else { return nothing() };
    let share = independent_share(&best.fit);
    let Some(foretold) = foretold(&best.fit, data, share) else { return nothing() };
    let (whole, most) = (data.whole(), -libm::log(alpha));
    let is_left = |fit: &Fit| with_hindsight(fit, &whole).is_none_or(|own| share * (foretold - own) < most);
    if is_left(&field.base) {
        // Nothing may be missing: what else is left is no finding.
        return nothing();
    }
    let left: Vec<&'static Kind> =
        field.rivals.par_iter().filter(|rival| is_left(&rival.fit)).map(|rival| rival.kind).collect();
    let near: Vec<Scored> = scored.iter().copied().filter(|s| left.contains(&s.kind)).collect();
    left_of(scored, &near)
}

/// What a fit says of the samples before it has seen them; up to a constant that all fits share.
fn foretold(fit: &Fit, data: &Data, share: f64) -> Option<f64> {
    // The noise's size is a number as well.
    let numbers = fit.hypothesis.free.len() as f64 + 1.0;
    let cost = 0.5 * numbers * libm::log((share * fit.rows.count as f64).max(2.0)) / share;
    let there = Fit::at(&fit.hypothesis, &fit.point, &data.beyond())?;
    let n = there.rows.count as f64;
    let ratio = there.rows.sensor_sd / fit.rows.sensor_sd;
    let rest = likelihood(&there) - 0.5 * n * (ratio * ratio - 1.0 - 2.0 * libm::log(ratio));
    Some(likelihood(fit) - cost + rest)
}

/// The most that a kind can say of them once it has.
fn with_hindsight(fit: &Fit, whole: &Data) -> Option<f64> {
    let mut hypothesis = fit.hypothesis.clone();
    for free in &mut hypothesis.free {
        free.prior = free.prior.map(|deviation| FREER * deviation);
    }
    let mut there = Fit::at(&hypothesis, &fit.point, whole)?;
    there.descend(whole, STEPS, &[]);
    Some(likelihood(&there))
}

/// Log-likelihood at the noise's own size, without the prior.
fn likelihood(fit: &Fit) -> f64 {
    let prior: f64 = fit.hypothesis.prior_rows(&fit.point).map(|row| row * row).sum();
    -0.5 * (fit.rows.objective - prior)
}
