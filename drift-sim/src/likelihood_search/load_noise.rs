//! A load that is noise of another kind than one that drifts, because it jumps or swings: what it is looked for beside, how a fit goes on under it, and how every kind is judged
//! anew there.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Hypothesis, Point, Target, is_noise};
use crate::estimate::likelihood::Data;
use crate::physics::Kind;

use super::decide::priced;
use super::glance::{Glance, Round};
use super::nominal;
use super::options::Options;
use super::plants::Identified;
use super::rivals::{self, Field, last_kind, shared_point, stuck, with_shared};

/// Part of the leading kind's gain from which on such a load is looked for beside a kind, and the most of such kinds.
const LEADING: f64 = 0.5;
const KINDS: usize = 2;
/// Steps of a fit under it, and of the fit that kinds are judged beside.
const STEPS: usize = 6;
const LONG: usize = 20;
/// Logarithm of the load's size over the drive's where only what is uncommon is left of it, and its time constant as the negative part of the recording: what it has jumped to stays.
const LEFT_OF_LOAD: (f64, f64) = (-5.0, -5.0);
/// The longest time constant of such a load, in durations of the recording: with a tenth of one a clean loop under three waves (9305) did not come to them.
const LONGEST_TAU: f64 = 20.0;

/// The base, and the fits of the kinds that lead, but for those that are such a load themselves.
pub fn looked_beside(field: &Field, is_itself: fn(&Kind) -> bool) -> Vec<&Fit> {
    let top = field.rivals.first().map_or(0.0, |best| field.gain(best));
    let leading = field
        .rivals
        .iter()
        .filter(|rival| rival.ended && !is_itself(rival.kind) && field.gain(rival) > LEADING * top);
    std::iter::once(&field.base).chain(leading.take(KINDS).map(|rival| &rival.fit)).collect()
}

/// What a second kind costs at least beside the one that leads, in a load of the usual kind: where two things have begun together, or show only together, the load beside one of them seems to
/// jump or to swing. Minus a log-likelihood, with what their numbers cost.
pub fn price_of_two(field: &Field, data: &Data, options: &Options) -> f64 {
    let leading = field.rivals.first();
    let two = leading.and_then(|leading| rivals::field(&leading.fit, data, Round::Later(options.least_gain)));
    let prices = two.iter().flat_map(|two| &two.rivals).map(|rival| 0.5 * priced(&rival.fit));
    prices.fold(f64::INFINITY, f64::min)
}

/// A fit gone on under such a load: from its own noise, from one that holds the load else, and from the stated numbers, which what was no noise before had bent.
pub fn refitted(fit: &Fit, data: &Data) -> Option<Fit> {
    let mut hypothesis = fit.hypothesis.clone();
    let longest = libm::log(LONGEST_TAU * hypothesis.scales.duration_s);
    let tau = hypothesis.free.iter_mut().find(|free| free.target == Target::LoadTau);
    tau.into_iter().for_each(|free| free.high = longest);
    let hypothesis = &hypothesis;
    let rho = hypothesis.place(Target::SensorRho).and_then(|place| fit.point.x.get(place));
    let rho = rho.copied().unwrap_or(0.0);
    let (size, tau) = LEFT_OF_LOAD;
    let held = |point: &Point| nominal::with_noise(hypothesis, point, size, tau, rho);
    let is_stated = !hypothesis.is_guessed && hypothesis.candidates().is_empty();
    let stated = is_stated.then(|| held(&keeping_noise(hypothesis, hypothesis.own_point(), &fit.point)));
    let points = [Some(fit.point.clone()), Some(held(&fit.point)), stated];
    let begun = points.iter().flatten().filter_map(|point| Fit::at(hypothesis, point, data));
    let mut begun: Vec<Fit> = begun.collect();
    begun.par_iter_mut().for_each(|fit| fit.descend(data, STEPS, &stuck(&fit.hypothesis)));
    begun.into_iter().min_by(|a, b| a.objective().total_cmp(&b.objective()))
}

/// A point with the noise of another one of its hypothesis.
fn keeping_noise(hypothesis: &Hypothesis, mut point: Point, of: &Point) -> Point {
    let noise =
        hypothesis.free.iter().zip(&mut point.x).zip(&of.x).filter(|((free, _), _)| is_noise(free.target));
    noise.for_each(|((_, x), of)| *x = *of);
    point
}

/// Every kind again, beside the base under such a load, of which these data know: from the base's own numbers, and from those that it shares with the fit that led to it. What it was
/// looked for beside is offered.
pub fn judged_again(
    led: &Fit,
    data: Data,
    (found, field, beside): (&Identified, &Field, Vec<&Fit>),
    options: &Options,
) -> Option<(Identified, Field)> {
    let on = |fit: &Fit| refitted(fit, &data);
    let base = &field.base;
    let of_led = Fit::at(&base.hypothesis, &shared_point(base, led), &data);
    let begun = [on(base), of_led.and_then(|fit| on(&fit))].into_iter().flatten();
    let mut base = begun.min_by(|a, b| a.objective().total_cmp(&b.objective()))?;
    base.descend(&data, LONG, &[]);
    nominal::under_other_noise(&mut base, &data);
    let look = data.look();
    let base = base.on_look(&data)?;
    let mut glance = Glance::of(&base, look, Round::First(options.least_gain))?;
    for fit in beside.into_iter().skip(1) {
        let of_led = || on(&Fit::at(&fit.hypothesis, &with_shared(fit, led), &data)?);
        let begun = [on(fit), of_led()].into_iter().flatten();
        let best = begun.min_by(|a, b| a.objective().total_cmp(&b.objective()));
        if let Some((kind, fit)) = last_kind(fit).zip(best.and_then(|fit| fit.on_look(&data))) {
            glance.offer(kind, fit);
        }
    }
    let field = glance.sketched(look).finished(&base, &data)?;
    let nominal = field.base.clone();
    Some((Identified { nominal, data, is_guessed: found.is_guessed }, field))
}
