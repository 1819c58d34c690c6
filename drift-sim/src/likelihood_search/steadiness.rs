//! Whether a change that lasts gains as long as it lasts. A load that jumps now and then is noise of another kind than is reckoned with: a plant that changes when it jumps seems to explain the
//! jump, and gains in the few samples in which the load does, and nowhere else.

use crate::estimate::fit::Fit;
use crate::estimate::inner_product::dot;
use crate::physics::{Kind, Place};

use super::decide::has_onset;

/// Part of the samples that is left out, those that decide most.
const DECIDING: f64 = 0.005;
/// Log-likelihood that has to be gained in the others. On 40 loops of `tests/cases/run` and `.ci/wide` whose plant or actuator changed it is 13 and more, beside loads that jump at most 6.
const LEAST: f64 = 8.0;

/// Whether a fit, its kind the last candidate, gains over a base by what lasts: true of kinds that act from the start, and of those that are a jump themselves.
pub fn is_steady(kind: &Kind, fit: &Fit, base: &Fit) -> bool {
    !(lasts(kind) && fit.point.onsets.last().is_some_and(|onset| *onset > 0.0))
        || gain_of_most(&base.rows.z, &fit.rows.z) > LEAST
}

/// Whether a kind changes what the loop does from some time on, and not what it is loaded with or shows.
fn lasts(kind: &Kind) -> bool {
    has_onset(kind) && matches!(kind.place, Place::Plant | Place::Actuator)
}

/// Log-likelihood by which one row of innovations is ahead of another, without the samples that decide most.
fn gain_of_most(of_base: &[f64], of_fit: &[f64]) -> f64 {
    let samples = of_base.len().max(1) as f64;
    let variance = libm::sqrt(dot(of_base, of_base) * dot(of_fit, of_fit)) / samples;
    let mut gains: Vec<f64> =
        of_base.iter().zip(of_fit).map(|(base, fit)| 0.5 * (base * base - fit * fit) / variance).collect();
    gains.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
    gains.iter().skip(libm::ceil(DECIDING * samples) as usize).sum()
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::{LEAST, gain_of_most};
    use crate::estimate::noise::sequence;

    /// White noise with 60 nats more in the base: in a tenth of its samples, or in three of them.
    #[test]
    fn what_is_gained_in_few_samples_is_not_counted() {
        let noise = sequence(6_000, 1.0, 0.0, &mut ChaCha8Rng::seed_from_u64(5));
        let with = |every: usize, squares: f64| -> Vec<f64> {
            let more = |(n, z): (usize, &f64)| {
                if n % every == 0 { libm::copysign(libm::sqrt(z * z + squares), *z) } else { *z }
            };
            noise.iter().enumerate().map(more).collect()
        };
        assert!(gain_of_most(&with(10, 0.2), &noise) > 40.0);
        assert!(gain_of_most(&with(2_000, 40.0), &noise) < LEAST);
    }
}
