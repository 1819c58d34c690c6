//! The loop as stated, its numbers and its noise fitted: what every kind of physics has to beat.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Hypothesis, Point, Target, is_noise, is_of_loop};
use crate::estimate::likelihood::Data;

/// Noise that fits begin with: logarithm of the load's size over the drive's, its time constant in samples (positive) or as the
/// negative part of the recording, atanh of what stays of the sensor's noise.
const STARTS: [(f64, f64, f64); 7] = [
    (-8.0, 20.0, 0.0),
    (-8.0, 4.0, 0.0),
    (-3.0, 30.0, 0.0),
    (-3.0, -1.0 / 30.0, 0.0),
    (-2.0, -1.0 / 100.0, 0.5),
    (-4.0, -1.0 / 100.0, 1.4),
    (-8.0, 20.0, 1.4),
];
/// Steps of each of these, and of the best two of them.
const SHORT: usize = 2;
const LONG: usize = 15;
/// Fall of the objective from which other noise is likelier.
const LIKELIER: f64 = 1.0;

/// The likeliest of the fits from several noises; `None` where the loop can't be simulated at all.
pub fn fit(hypothesis: &Hypothesis, data: &Data) -> Option<Fit> {
    fit_noise(hypothesis, data, &[])
}

/// The same with some numbers held where they are stated.
pub fn fit_noise(hypothesis: &Hypothesis, data: &Data, held: &[usize]) -> Option<Fit> {
    let mut begun = under_all_noises(hypothesis, &hypothesis.own_point(), data, held);
    begun.truncate(2);
    begun.par_iter_mut().for_each(|fit| fit.descend(data, LONG, held));
    begun.into_iter().min_by(|a, b| a.objective().total_cmp(&b.objective()))
}

/// Short fits from a point under each of the noises, the likeliest first.
fn under_all_noises(hypothesis: &Hypothesis, point: &Point, data: &Data, held: &[usize]) -> Vec<Fit> {
    let begun = STARTS.par_iter().filter_map(|(size, tau, rho)| {
        let mut fit = Fit::at(hypothesis, &with_noise(hypothesis, point, *size, *tau, *rho), data)?;
        fit.descend(data, SHORT, held);
        Some(fit)
    });
    let mut begun: Vec<Fit> = begun.collect();
    begun.sort_by(|a, b| a.objective().total_cmp(&b.objective()));
    begun
}

/// A fit once more, from its own noise and from others: the likeliest of them.
pub fn fit_again(fit: &Fit, data: &Data) -> Option<Fit> {
    let others = STARTS.iter().filter_map(|(size, tau, rho)| {
        Fit::at(&fit.hypothesis, &with_noise(&fit.hypothesis, &fit.point, *size, *tau, *rho), data)
    });
    let mut begun: Vec<Fit> = others.chain([fit.clone()]).collect();
    begun.par_iter_mut().for_each(|fit| fit.descend(data, LONG, &[]));
    begun.into_iter().min_by(|a, b| a.objective().total_cmp(&b.objective()))
}

/// A fit on other data, all of its numbers held but those of the noise.
pub fn under_own_noise(fit: &Fit, data: &Data) -> Option<Fit> {
    let held = all_but_noise(&fit.hypothesis);
    let own = Fit::at(&fit.hypothesis, &fit.point, data);
    let mut begun = under_all_noises(&fit.hypothesis, &fit.point, data, &held);
    begun.truncate(1);
    begun.extend(own);
    begun.par_iter_mut().for_each(|fit| fit.descend(data, LONG, &held));
    begun.into_iter().min_by(|a, b| a.objective().total_cmp(&b.objective()))
}

/// Places of a hypothesis's numbers that are none of its noise.
fn all_but_noise(hypothesis: &Hypothesis) -> Vec<usize> {
    let is_held = |i: &usize| hypothesis.free.get(*i).is_none_or(|free| !is_noise(free.target));
    (0..hypothesis.free.len()).filter(is_held).collect()
}

/// A fit under other noise, where that is likelier: the noise's own numbers have local optima, and what two fits differ by is not to be one of those.
pub fn under_other_noise(fit: &mut Fit, data: &Data) {
    let hypothesis = &fit.hypothesis;
    let held = all_but_noise(hypothesis);
    let best = under_all_noises(hypothesis, &fit.point, data, &held).into_iter().next();
    if let Some(mut best) = best.filter(|best| best.objective() < fit.objective() - LIKELIER) {
        best.descend(data, LONG, &super::rivals::stuck(&best.hypothesis));
        *fit = best;
    }
}

/// A point with other noise.
pub fn with_noise(hypothesis: &Hypothesis, point: &Point, size: f64, tau: f64, rho: f64) -> Point {
    let mut point = point.clone();
    let scales = &hypothesis.scales;
    let tau_s = if tau > 0.0 { tau * scales.sample_time_s } else { -tau * scales.duration_s };
    for (target, value) in
        [(Target::LoadSize, size), (Target::LoadTau, libm::log(tau_s)), (Target::SensorRho, rho)]
    {
        if let Some(place) = hypothesis.place(target)
            && let (Some(free), Some(x)) = (hypothesis.free.get(place), point.x.get_mut(place))
        {
            *x = value.clamp(free.low, free.high);
        }
    }
    point
}

/// Logarithm of the load's size over the drive's in a quiet fit, at most, and how much less it is than in the nominal one.
const QUIET: f64 = -3.5;
const QUIETER: f64 = 2.0;

/// The fit of the same numbers under little process noise: the noise of the nominal fit has already swallowed what is missing.
pub fn quiet(fit: &Fit, data: &Data) -> Option<Fit> {
    let hypothesis = &fit.hypothesis;
    let at = |target| hypothesis.place(target).and_then(|i| fit.point.x.get(i)).copied().unwrap_or(0.0);
    let size = (at(Target::LoadSize) - QUIETER).min(QUIET);
    let mut point = with_noise(hypothesis, &fit.point, size, -1.0 / 100.0, at(Target::SensorRho).min(1.5));
    for (free, x) in hypothesis.free.iter().zip(&mut point.x) {
        if is_of_loop(free.target) {
            *x = 0.0;
        }
    }
    let noise: Vec<usize> = (0..hypothesis.free.len())
        .filter(|i| hypothesis.free.get(*i).is_some_and(|free| is_noise(free.target)))
        .collect();
    let mut quiet = Fit::at(hypothesis, &point, data)?;
    quiet.descend(data, SHORT, &noise);
    Some(quiet)
}
