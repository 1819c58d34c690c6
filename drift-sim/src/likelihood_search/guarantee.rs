//! The decision with a guarantee (`--guarantee ALPHA`): the split likelihood ratio. The best fit of what was fitted is held, on what was not, against the
//! best that each kind of physics can do there when its numbers are fitted to it. Where the truth is one of the kinds, it leaves the set with a
//! probability of ALPHA at most, in finite samples (Wasserman, Ramdas & Balakrishnan 2020, "Universal inference", theorem 1, on the likelihood
//! of the later samples given the earlier ones). It assumes that the noise is of the model's kind, that the kinds are all there are, and that the
//! fits reach the maximum; innovations that are correlated still count by their independent share.

use rayon::prelude::*;

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::physics::Kind;

use super::decide::{Decision, Scored, decide, independent_share, left_of};
use super::options::Options;
use super::rivals::Field;

/// Steps of a fit to what was not fitted.
const STEPS: usize = 12;
/// How many times as far as the loop file says numbers may be from it there: a rival is held to its best, not to its likeliest.
const FREER: f64 = 10.0;

/// Judges a field: what is left is what the unseen samples don't speak against.
pub fn decide_surely(field: &Field, data: &Data, options: &Options, alpha: f64) -> Decision {
    let scored = decide(field, options, f64::NEG_INFINITY).scored;
    let nothing = || Decision { scored: scored.clone(), ..Decision::default() };
    let Some(best) = field.rivals.first() else { return nothing() };
    let unseen = data.beyond();
    let Some(held) = held_to(&best.fit, &unseen) else { return nothing() };
    let share = independent_share(&best.fit);
    let most = -libm::log(alpha);
    let is_left = |fit: &Fit| best_of(fit, &unseen).is_none_or(|own| share * (held - own) < most);
    let left: Vec<&'static Kind> =
        field.rivals.par_iter().filter(|rival| is_left(&rival.fit)).map(|rival| rival.kind).collect();
    if is_left(&field.base) {
        // Nothing may be missing: what else is left is no finding.
        return nothing();
    }
    let near: Vec<Scored> = scored.iter().copied().filter(|s| left.contains(&s.kind)).collect();
    left_of(scored, &near)
}

/// Log-likelihood of what was not fitted under a fit as it is, its noise's size among it; up to a constant that all fits share.
fn held_to(fit: &Fit, unseen: &Data) -> Option<f64> {
    let there = Fit::at(&fit.hypothesis, &fit.point, unseen)?;
    let n = there.rows.count as f64;
    let ratio = there.rows.sensor_sd / fit.rows.sensor_sd;
    Some(likelihood(&there) - 0.5 * n * (ratio * ratio - 1.0 - 2.0 * libm::log(ratio)))
}

/// The same where the fit's numbers are fitted to it.
fn best_of(fit: &Fit, unseen: &Data) -> Option<f64> {
    let mut hypothesis = fit.hypothesis.clone();
    for free in &mut hypothesis.free {
        free.prior = free.prior.map(|deviation| FREER * deviation);
    }
    let mut there = Fit::at(&hypothesis, &fit.point, unseen)?;
    there.descend(unseen, STEPS, &[]);
    Some(likelihood(&there))
}

/// Log-likelihood at the noise's own size, without the prior.
fn likelihood(fit: &Fit) -> f64 {
    let prior: f64 = fit.hypothesis.prior_rows(&fit.point).map(|row| row * row).sum();
    -0.5 * (fit.rows.objective - prior)
}
