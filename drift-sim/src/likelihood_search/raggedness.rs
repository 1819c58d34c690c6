//! How ragged a likelihood is: what it costs to move a fit's numbers by a part of their own deviations, beyond what its curvature says. Where a mass sticks and slips under a random load, or
//! an event falls between two samples, a fit ends where it happens to, and another kind gains by what it shakes.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::estimate::fit::{Fit, Tangent};
use crate::estimate::likelihood::Data;
use crate::physics::Starts;

/// Points that are drawn about a fit, and how far from it, in deviations of its numbers.
const DRAWN: usize = 8;
const REACH: f64 = 0.3;

/// Gain that means nothing, in costs of such a move. Of 96 loops of ten seeds of `.ci/wide` with a second effect, one that is right gained 12 and more, most of them 50, and
/// six of eleven that are wrong less than 9.
const SHAKEN: f64 = 10.0;

/// By how much a fit's log-likelihood may be off for where it happens to have ended; 0 where no point about it can be run. Costs a tangent and eight runs of the filter.
pub fn shaken(fit: &Fit, data: &Data) -> f64 {
    fit.tangent(data, &[]).map_or(0.0, |tangent| shaken_along(fit, data, &tangent))
}

/// The same with the tangent of all numbers.
pub fn shaken_along(fit: &Fit, data: &Data, tangent: &Tangent) -> f64 {
    let tangent = without_slope(fit).into_iter().fold(tangent.clone(), |rest, place| rest.without(place));
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let Some(near) = fit.scattered(data, &tangent, DRAWN, || REACH * normal()) else { return 0.0 };
    let by_curvature = 0.5 * REACH * REACH * tangent.moving.len() as f64;
    let mut costs: Vec<f64> =
        near.iter().map(|objective| 0.5 * (objective - fit.objective()) - by_curvature).collect();
    costs.sort_by(f64::total_cmp);
    SHAKEN * costs.get(costs.len().saturating_sub(1) / 2).map_or(0.0, |cost| cost.max(0.0))
}

/// Numbers of which no curvature tells a deviation: those of terms whose likelihood is a needle.
fn without_slope(fit: &Fit) -> Vec<usize> {
    let candidates = fit.hypothesis.candidates().iter().enumerate();
    let peaks = candidates.filter(|(_, term)| matches!(term.kind.search, Starts::Peak { .. }));
    peaks.flat_map(|(candidate, _)| fit.hypothesis.places_of(candidate)).collect()
}
