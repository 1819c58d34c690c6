//! 95 % intervals of fitted numbers: from the curvature of the likelihood, the innovations' correlation that is left being paid for; of
//! rough numbers from the profile of the likelihood itself, the others sliding. They hold for a model whose terms are the right ones.

use nalgebra::{DMatrix, DVector};

use crate::estimate::fit::{Fit, Tangent};
use crate::estimate::hypothesis::{Free, Point, Target};
use crate::estimate::likelihood::Data;
use crate::physics::{Family, Shared};
use crate::plant::Role;

use super::decide::independent_share;
use super::needle::{self, peaks};
use super::one_way;
use super::raggedness::shaken_along;

/// Half width, in standard errors, of a 95 % interval of what is normally distributed.
const NORMAL_95: f64 = 1.96;
/// The 95 % points of chi squared with one degree of freedom, and with three: a valve's numbers jump from peak to peak together.
const CHI_SQUARED: f64 = 3.84;
const CHI_SQUARED_3: f64 = 7.81;
/// Part of a sample by which two ways to simulate one differ: half of a quarter step, and as much again.
const TIMING: f64 = 0.25;
/// Halvings and doublings in which the end of a profile is found.
const TRIES: usize = 24;

/// Half widths of all free numbers, in their own units; infinite where the recording says nothing of one.
pub fn half_widths(fit: &Fit, data: &Data) -> Vec<f64> {
    let n = fit.point.x.len();
    let mut widths = vec![f64::INFINITY; n];
    let Some(tangent) = fit.tangent(data, &[]) else { return widths };
    let share = independent_share(fit);
    let curvature = tangent.curvature(fit);
    // Numbers of which the rows don't depend at all would make it singular.
    let regular = &curvature + DMatrix::from_diagonal_element(n, n, 1e-12 * curvature.amax());
    let Some(inverse) = regular.cholesky().map(|c| c.inverse()) else { return widths };
    let ts = fit.hypothesis.model.sample_time_s;
    let late = fit.hypothesis.place(Target::Late).or_else(|| {
        let delay = fit.hypothesis.numbers.iter().position(|number| number.role == Role::Delay)?;
        fit.hypothesis.place(Target::Plant(delay))
    });
    let rise = CHI_SQUARED / share;
    // A ragged likelihood has another top near by.
    let wider = libm::sqrt(1.0 + 2.0 * shaken_along(fit, data, &tangent) / CHI_SQUARED);
    let needles = needles(fit);
    let of_needles = |place: &usize| needles.iter().any(|own| own.contains(place));
    for (i, width) in widths.iter_mut().enumerate().filter(|(place, _)| !of_needles(place)) {
        let (Some(free), Some(x)) = (fit.hypothesis.free.get(i), fit.point.x.get(i)) else { continue };
        let error = libm::sqrt((inverse[(i, i)] / share).max(0.0));
        // How far the number moves with the time at which y is taken, which another way to cut a sample shifts.
        let moved = late.filter(|late| *late != i).map_or(0.0, |late| {
            let free = fit.hypothesis.free.get(late);
            let shift = free.map_or(0.0, |free| {
                TIMING * ts / free.slope(fit.point.x.get(late).copied().unwrap_or(0.0)).abs()
            });
            inverse[(i, late)] / inverse[(late, late)].max(1e-300) * shift
        });
        // The load that stays moves with the plant's other numbers where it is counted from a level.
        let error = match level_variance(fit, i, &inverse) {
            Some(variance) => libm::sqrt((variance / share).max(0.0)) / free.slope(*x).abs(),
            None => error,
        };
        let by_curvature = libm::hypot(wider * NORMAL_95 * error, moved) * free.slope(*x).abs();
        *width = if free.smooth {
            by_curvature
        } else {
            by_profile(fit, data, &tangent, &[i], rise).map_or(by_curvature, |w| w.max(by_curvature))
        };
        // Of a number that another one takes up wholly the recording says nothing.
        if width.is_nan() {
            *width = f64::INFINITY;
        }
    }
    for (place, shared) in shared(fit, one_way::hides_a_load(fit, data)).filter(|_| !data.has_healthy()) {
        if let Some(width) = widths.get_mut(place) {
            *width = libm::hypot(*width, NORMAL_95 * shared);
        }
    }
    // A needle's top has many peaks: all that are as likely are in the interval.
    let is_as_likely = |peak: &Fit| peak.objective() < fit.objective() + CHI_SQUARED_3 / share;
    let peaks: Vec<Fit> = peaks(fit, data, &needle::ABOUT).into_iter().filter(is_as_likely).collect();
    for own in &needles {
        let tangent = own.iter().fold(tangent.clone(), |tangent, place| tangent.without(*place));
        let together = by_profile(fit, data, &tangent, own, rise).unwrap_or(0.0);
        for place in own {
            let alone = by_profile(fit, data, &tangent, &[*place], rise).unwrap_or(0.0);
            if let Some(width) = widths.get_mut(*place) {
                *width = alone.max(together) + farthest(&peaks, fit, *place);
            }
        }
    }
    for (place, most) in states(fit) {
        // All that it may be is no interval.
        if let Some(width) = widths.get_mut(place).filter(|width| **width > most) {
            *width = f64::INFINITY;
        }
    }
    widths
}

/// Places of the numbers in which a recording begins, with the most that each may be of either sign.
fn states(fit: &Fit) -> Vec<(usize, f64)> {
    let Some(realised) = fit.hypothesis.realise(&fit.point) else { return Vec::new() };
    let free = fit.hypothesis.free.iter().enumerate();
    let state = |(place, free): (usize, &Free)| {
        let Target::Term { term, parameter } = free.target else { return None };
        let term = realised.model.physics.get(term)?;
        Some((place, term.most_of_state(parameter)?))
    };
    free.filter_map(state).collect()
}

/// Places of the candidates' numbers that another number can take up wholly, with the deviation of that one before any recording: the rows tell the two together alone, but for what cutting
/// time into samples makes of them; of a motion that goes one way, where friction is a load, those of friction. Healthy recordings, in which the candidates are not, tell the other one.
fn shared(fit: &Fit, is_load: bool) -> impl Iterator<Item = (usize, f64)> {
    let hypothesis = &fit.hypothesis;
    hypothesis.free.iter().enumerate().filter_map(move |(place, free)| {
        let Target::Term { term, parameter } = free.target else { return None };
        let of = hypothesis.model.physics.get(term).filter(|_| term >= hypothesis.stated)?;
        let parameter = of.kind.parameters.get(parameter)?;
        let is_force = of.kind.family == Some(Family::Friction) && parameter.unit == "{drive}";
        let other = match parameter.shared.or((is_load && is_force).then_some(Shared::ConstantLoad))? {
            Shared::ConstantLoad => Target::ConstantLoad,
            Shared::Viscous => {
                Target::Plant(hypothesis.numbers.iter().position(|number| number.role == Role::Viscous)?)
            }
        };
        let other = hypothesis.place(other)?;
        let (free, x) = (hypothesis.free.get(other)?, fit.point.x.get(other)?);
        Some((place, free.prior? * free.slope(*x).abs()))
    })
}

/// Slope of the constant load in the numbers, at a step of this.
const LOAD_STEP: f64 = 1e-5;

/// The variance of the constant load in its own unit, where the place is its and it is counted from a level.
fn level_variance(fit: &Fit, place: usize, inverse: &DMatrix<f64>) -> Option<f64> {
    fit.hypothesis.level.as_ref().filter(|_| fit.hypothesis.place(Target::ConstantLoad) == Some(place))?;
    let load = |point: &Point| Some(fit.hypothesis.realise(point)?.constant_load);
    let at = load(&fit.point)?;
    let slopes = (0..fit.point.x.len()).map(|i| {
        let mut point = fit.point.clone();
        *point.x.get_mut(i)? += LOAD_STEP;
        Some((load(&point)? - at) / LOAD_STEP)
    });
    let slopes = DVector::from_vec(slopes.collect::<Option<Vec<f64>>>()?);
    Some(slopes.dot(&(inverse * &slopes)))
}

/// How far a number of these fits is from that of another, at most.
fn farthest(of: &[Fit], from: &Fit, place: usize) -> f64 {
    let value = |fit: &Fit| Some(fit.hypothesis.free.get(place)?.value(*fit.point.x.get(place)?));
    let distances = of.iter().filter_map(|fit| Some((value(fit)? - value(from)?).abs()));
    distances.fold(0.0, f64::max)
}

/// The numbers of each term whose peak is as narrow as a needle, along which there is no slope.
fn needles(fit: &Fit) -> Vec<Vec<usize>> {
    let terms = fit.hypothesis.candidates().iter().enumerate();
    let sharp = terms.filter(|(_, term)| term.kind.search.is_peak());
    sharp.map(|(i, _)| fit.hypothesis.places_of(i)).collect()
}

/// The farther of the two distances by which numbers are moved together when the objective has risen by `rise`.
fn by_profile(fit: &Fit, data: &Data, tangent: &Tangent, places: &[usize], rise: f64) -> Option<f64> {
    let first = *places.first()?;
    let free = fit.hypothesis.free.get(first)?;
    let at = *fit.point.x.get(first)?;
    let slope = free.slope(at).abs();
    let others = places.iter().fold(tangent.clone(), |tangent, place| tangent.without(*place));
    let risen = |distance: f64| -> bool {
        let mut point = fit.point.clone();
        for place in places {
            let (Some(free), Some(x)) = (fit.hypothesis.free.get(*place), point.x.get_mut(*place)) else {
                return true;
            };
            *x += distance * slope / free.slope(*x).abs();
            if *x <= free.low || *x >= free.high {
                return true;
            }
        }
        let Some(mut moved) = Fit::at(&fit.hypothesis, &point, data) else { return true };
        if moved.objective() - fit.objective() > 10.0 * rise {
            return true;
        }
        moved.slide(data, &others, 1);
        moved.objective() - fit.objective() > rise
    };
    let end = |side: f64| {
        let mut far = side * 1e-4 * at.abs().max(1e-3);
        let mut near = 0.0;
        for _ in 0..TRIES {
            if risen(far) {
                break;
            }
            near = far;
            far *= 2.0;
        }
        for _ in 0..4 {
            let middle = 0.5 * (near + far);
            if risen(middle) { far = middle } else { near = middle }
        }
        far.abs()
    };
    Some(end(1.0).max(end(-1.0)) * slope)
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::*;
    use crate::control_loop::Loop;
    use crate::estimate::noise::sequence;
    use crate::estimate::signals::Signals;
    use crate::likelihood_search::options::Options;
    use crate::likelihood_search::{self, nominal};
    use crate::physics::Term;

    const SAMPLES: usize = 4_000;
    const SUBSTEPS: usize = 50;
    /// Dry and viscous friction forward and back, beside the motor's own.
    const DRY: [f64; 2] = [0.3, 0.12];
    const VISCOUS: [f64; 2] = [0.2, 0.05];

    /// The speed of a motor of inertia 0.5 and viscous friction 1.1 under a torque that swings, written out in small steps; a speed sensor of 1e-4.
    fn motor() -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let noise = sequence(SAMPLES, 1e-4, 0.0, &mut random);
        let u: Vec<f64> =
            (0..SAMPLES).map(|n| 2.0 * libm::sin(n as f64 / 90.0) + libm::sin(n as f64 / 41.0)).collect();
        let mut speed = 0.0_f64;
        let y = u.iter().zip(noise).map(|(u, noise)| {
            let shown = speed + noise;
            for _ in 0..SUBSTEPS {
                let way = usize::from(speed < 0.0);
                let dry = if speed == 0.0 { 0.0 } else { DRY[way].copysign(speed) };
                speed += 0.01 / SUBSTEPS as f64 * (u - (1.1 + VISCOUS[way]) * speed - dry) / 0.5;
            }
            shown
        });
        let y: Vec<f64> = y.collect();
        Signals { sample_time_s: 0.01, r: y.clone(), y, u, ..Signals::default() }
    }

    /// A motor whose own friction was stated a tenth too small: the friction by direction is told up to what that, and a load, may be.
    #[test]
    fn what_a_number_of_the_loop_can_do_as_well_is_in_the_interval() {
        let text = "[loop]\nsample_time_s = 0.01\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"servo\"\noutput = \"speed\"\ninertia = 0.5\nviscous = 1.0\nactuator_gain = 1.0\n";
        let model = Loop::parse(text, "a motor").unwrap();
        let recordings = vec![motor()];
        let plain = likelihood_search::hypothesis(&model, &recordings, &Options::default());
        let data = Data::new(&plain, recordings, vec![SAMPLES]);
        let numbers =
            [("coulomb_pos", 0.2), ("coulomb_neg", 0.2), ("viscous_pos", 0.0), ("viscous_neg", 0.0)];
        let hypothesis = plain.with(Term::new("directional_friction", &numbers).unwrap());
        let fit = nominal::fit(&hypothesis, &data).unwrap();
        let widths = half_widths(&fit, &data);
        let term = fit.hypothesis.realise(&fit.point).unwrap().model.physics.pop().unwrap();
        let truth = [DRY[0], DRY[1], VISCOUS[0], VISCOUS[1]];
        for ((place, value), truth) in
            fit.hypothesis.places_of(0).into_iter().zip(&term.parameters).zip(truth)
        {
            assert!((value - truth).abs() < widths[place], "{value} +- {}, {truth}", widths[place]);
        }
        // What the two directions differ by is told however much they share.
        let [forward, back] = [term.parameters[2], term.parameters[3]];
        assert!((forward - back - 0.15).abs() < 0.02, "{term:?}");
    }
}
