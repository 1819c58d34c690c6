//! 95 % intervals of fitted numbers: from the curvature of the likelihood, the innovations' correlation that is left being paid for; of
//! rough numbers from the profile of the likelihood itself, the others sliding. They hold for a model whose terms are the right ones.

use nalgebra::{DMatrix, DVector};

use crate::estimate::fit::{Fit, Tangent};
use crate::estimate::hypothesis::{Point, Target};
use crate::estimate::likelihood::Data;
use crate::physics::Starts;
use crate::plant::Role;

use super::decide::independent_share;
use super::needle::{self, peaks};
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
    widths
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
    let sharp = terms.filter(|(_, term)| matches!(term.kind.search, Starts::Peak { .. }));
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
