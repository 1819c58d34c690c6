//! How ragged a likelihood is: what it costs to move a fit's numbers by a part of their own deviations, beyond what its curvature says. Where a mass sticks and slips under a random load, or
//! an event falls between two samples, a fit ends where it happens to, and another kind gains by what it shakes.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::estimate::fit::{Fit, Tangent};
use crate::estimate::likelihood::Data;

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
    let peaks = candidates.filter(|(_, term)| term.kind.search.is_peak());
    peaks.flat_map(|(candidate, _)| fit.hypothesis.places_of(candidate)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control_loop::Loop;
    use crate::estimate::noise::sequence;
    use crate::estimate::signals::Signals;
    use crate::likelihood_search::options::Options;
    use crate::likelihood_search::{self, nominal};
    use crate::physics::Term;

    const SAMPLES: usize = 6_000;
    const TS: f64 = 0.001;
    const LEVEL: f64 = 1.0;

    /// A mass of 1 with viscous friction of 2, written out in tenths of a sample: u sways over three times the dry friction's level, a random load of a third of it acts beside it, and the mass
    /// stays where it has stopped until the force is more than that level; without it where `sticks` is not set.
    fn way(sticks: bool) -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let load = sequence(SAMPLES, 0.3 * LEVEL, 0.99, &mut random);
        let noise = sequence(SAMPLES, 1e-6, 0.0, &mut random);
        let level = if sticks { LEVEL } else { 0.0 };
        let (mut x, mut v) = (0.0, 0.0_f64);
        let (mut y, mut u) = (Vec::new(), Vec::new());
        for (n, (load, noise)) in load.iter().zip(noise).enumerate() {
            y.push(x + noise);
            u.push(1.5 * LEVEL * libm::sin(n as f64 / 150.0));
            for _ in 0..10 {
                let force = u[n] + load - 2.0 * v;
                let held = if v == 0.0 { force.clamp(-level, level) } else { level.copysign(v) };
                let next = v + 0.1 * TS * (force - held);
                v = if v * next < 0.0 { 0.0 } else { next };
                x += 0.1 * TS * v;
            }
        }
        Signals { sample_time_s: TS, r: y.clone(), y, u, ..Signals::default() }
    }

    /// How far a fit at the true numbers may be off.
    fn shaken_on(sticks: bool) -> f64 {
        let text = "[loop]\nsample_time_s = 0.001\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"servo\"\noutput = \"position\"\ninertia = 1.0\nviscous = 2.0\nactuator_gain = 1.0\n";
        let model = Loop::parse(text, "a mass").unwrap();
        let recordings = vec![way(sticks)];
        let plain = likelihood_search::hypothesis(&model, &recordings, &Options::default());
        let hypothesis = if sticks {
            plain.with(Term::new("coulomb_friction", &[("level", LEVEL)]).unwrap())
        } else {
            plain
        };
        let data = Data::new(&hypothesis, recordings, vec![SAMPLES]);
        let mut fit = nominal::fit_noise(&hypothesis, &data, &[]).unwrap();
        fit.descend(&data, 12, &[]);
        shaken(&fit, &data)
    }

    /// A mass that sticks and slips under a random load leaves a fit where it happens to end; without dry friction the curvature says what a move costs.
    #[test]
    fn a_mass_that_sticks_under_a_random_load_is_ragged() {
        let (free, sticking) = (shaken_on(false), shaken_on(true));
        assert!(free < 2.0, "{free}");
        assert!(sticking > 5.0, "{sticking}");
    }
}
