//! A likelihood as narrow as a needle, of a valve that sticks: the way to its top, and the points about it that are as likely.

use crate::cores::AcrossCores as _;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::estimate::fit::{Fit, SLID_GAIN};
use crate::estimate::inner_product::dot;
use crate::estimate::likelihood::Data;
use crate::physics::{Kind, Range, Start, Starts};

use super::apart::apart;
use super::begun;
use super::climb::{Steps, climb};
use super::rivals::{last_kind, stuck};
use super::starts::{Look, needles};

/// Log-likelihood from which on a needle is searched for: what gains less slips too seldom to have one.
pub const LEAST_GAIN: f64 = 60.0;
/// At the fine points all about a fit, and at the finest, of which few samples tell nothing.
const FINE: Look = Look { seen: 6_000, first_seen: 2_500, run: 16, apart: 0.03, reach: 0.004 };
const FINEST: Look = Look { first_seen: 6_000, ..FINE };
/// The points about a fit that are looked at.
#[derive(Clone, Copy)]
enum Grid {
    Fine,
    Finest,
}

/// How often, each time from the numbers that the last search found, and the points of each from which the other numbers are fitted again.
const AGAIN: usize = 3;
const POINTS: usize = 3;
/// Part of the band by which two tops differ, at least, that do nearly the same.
const SAME_TOP: f64 = 0.03;
/// Gain below which a search is the last, in the objective.
const LAST: f64 = 15.0;
/// Steps of the fits from a point.
const LONG: usize = 12;
/// Steps of the last climb, and their reach.
const STEPS: usize = 100;
const REACH: f64 = 0.002;
/// The first and the last width, as parts of the largest number, by which a number of either sign is moved.
const SIGNED: (f64, f64) = (0.25, 0.002);
/// Where other peaks of a top are looked for.
pub struct Surroundings {
    /// Points that are forecast.
    count: usize,
    /// How far the first of three is drawn from the top, as a part of the largest number; the second half as far, the third a quarter.
    reach: f64,
    /// How they are looked at.
    look: Look,
}

/// Those from which the way up goes on, and all that an interval may have in it.
const VERY_TOP: Look = Look { seen: 30_000, first_seen: 30_000, run: 32, apart: 0.0007, reach: 0.001 };
const BESIDE: Surroundings = Surroundings { count: 600, reach: 0.012, look: VERY_TOP };
pub const ABOUT: Surroundings =
    Surroundings { count: 2_400, reach: 0.03, look: Look { run: 48, apart: 0.004, ..VERY_TOP } };
/// Where other tops are looked for anywhere, and log-likelihood by which they may be behind.
const ANYWHERE: Look = Look { seen: 6_000, first_seen: 6_000, run: 24, apart: 0.1, reach: 0.05 };
const AS_LIKELY: f64 = 15.0;
/// The least number as a part of the largest, and slides of the other numbers at a peak.
const LEAST: f64 = 1e-3;
const SLIDES: usize = 2;
/// Points beside one that is in step with a top, and how far the first of three is drawn from it, the second half as far, the third a quarter: along the jump the peak is 0.03 % wide and as
/// far away (`tests/cases/run 9324`).
const CLOSER_BY: usize = 240;
const CLOSER: f64 = 0.001;
/// Gain in the objective from which the way up goes on from another peak.
const HIGHER: f64 = 1.0;
/// Points that are drawn about a top, and how far: by as much of the band as real valves slip early or late, and by halves of that as often, to as little as a needle is wide where slips are
/// exact (a flow at rest: all that lies 0.2 % beside its top is 6 000 nats worse).
const DRAWN: usize = 128;
const SCATTER: f64 = 0.03;
const HALVES: usize = 8;

/// A fit's last term in its kind's other forms, in which it does about the same.
pub fn in_other_forms(fit: &Fit, data: &Data) -> Vec<Fit> {
    let Some((kind, about)) = last_kind(fit).zip(parameters(fit)) else { return Vec::new() };
    let Starts::Peak { forms, .. } = kind.search else { return Vec::new() };
    let other = |parameters: Vec<f64>| {
        let mut hypothesis = fit.hypothesis.clone();
        hypothesis.model.physics.last_mut()?.parameters.clone_from(&parameters);
        let point = hypothesis.started(&fit.point, &Start::of(parameters), 0.0);
        Fit::at(&hypothesis, &point, data)
    };
    forms(&about).into_iter().filter_map(other).collect()
}

/// The fit near the peak that a fit beside it leads to.
pub fn near_needle(mut fit: Fit, data: &Data) -> Fit {
    for _ in 0..AGAIN {
        let before = fit.objective();
        fit = nearer(fit, data, Grid::Fine);
        if before - fit.objective() < LAST {
            break;
        }
    }
    fit
}

/// The same where the peak lies between the points that led there.
pub fn nearest_needle(fit: Fit, data: &Data) -> Fit {
    let before = fit.objective();
    let near = nearer(fit, data, Grid::Finest);
    if before - near.objective() < LAST { near } else { near_needle(near, data) }
}

/// The best fit from the points of a grid about one.
fn nearer(fit: Fit, data: &Data, grid: Grid) -> Fit {
    let Some((kind, about)) = last_kind(&fit).zip(parameters(&fit)) else { return fit };
    let Starts::Peak { fine, finest, .. } = kind.search else { return fit };
    let (points, look) = match grid {
        Grid::Fine => (fine(&about), FINE),
        Grid::Finest => (finest(&about), FINEST),
    };
    let fixed = stuck(&fit.hypothesis);
    let ends = needles(&fit, data, points, look).into_iter().take(POINTS).filter_map(|begin| {
        let mut near = Fit::at(&begin.hypothesis, &begin.point, data)?;
        near.descend(data, LONG, &fixed);
        Some(near)
    });
    ends.fold(fit, |best, end| if end.objective() < best.objective() { end } else { best })
}

/// The fit at the top of the peak that a fit is near to, or of a higher one that does nearly the same: from one to the next, for the numbers of what is in step with a top that is off by
/// several half jumps are not quite right.
pub fn at_needle(fit: Fit, kind: &Kind, data: &Data) -> Fit {
    let mut fit = at_the_top(fit, kind, data);
    for _ in 0..AGAIN {
        let higher = in_step(&fit, kind, data).filter(|other| other.objective() < fit.objective() - HIGHER);
        let Some(other) = higher else { break };
        fit = at_the_top(other, kind, data);
    }
    fit
}

/// The likeliest of the fits that do nearly what one at its top does. Where the stem was when a recording began is another place beside each of them, and they are told apart by what comes
/// later.
fn in_step(fit: &Fit, kind: &Kind, data: &Data) -> Option<Fit> {
    let Starts::Peak { in_step, .. } = kind.search else { return None };
    let of_first = data.fitted.first().copied()?.min(fit.rows.z.len());
    let later = |parameters: Vec<f64>| {
        let z = with(fit, &parameters, data)?.rows.z;
        let later = z.get(of_first / 2..of_first)?;
        Some((dot(later, later), parameters))
    };
    let mut judged: Vec<(f64, Vec<f64>)> =
        in_step(&parameters(fit)?).into_par_iter().filter_map(later).collect();
    let by_error = |a: &(f64, Vec<f64>), b: &(f64, Vec<f64>)| a.0.total_cmp(&b.0);
    judged.sort_by(by_error);
    let are_near = |a: &(f64, Vec<f64>), b: &(f64, Vec<f64>)| {
        let of_band = |of: &[f64]| of.first().copied().unwrap_or(0.0);
        (of_band(&a.1) - of_band(&b.1)).abs() < SAME_TOP * of_band(&b.1)
    };
    let fixed = stuck(&fit.hypothesis);
    let ended = apart(judged, POINTS, are_near).into_iter().filter_map(|first| {
        let closer = closer_by(&first.1).into_par_iter().filter_map(later);
        let (_, parameters) = closer.chain([first]).min_by(by_error)?;
        let mut other = with(fit, &parameters, data)?;
        begun::settle(&mut other, data);
        other.descend(data, LONG, &fixed);
        Some(other)
    });
    ended.min_by(|a, b| a.objective().total_cmp(&b.objective()))
}

/// Points beside one, each number off by a part of itself: what is in step with a top has a peak of its own, whose jump is not quite the same.
fn closer_by(parameters: &[f64]) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut off = |i: usize| {
        let draw: f64 = StandardNormal.sample(&mut random);
        libm::exp(CLOSER / f64::from(1 << (i % 3)) * draw)
    };
    (0..CLOSER_BY).map(|i| parameters.iter().map(|value| value * off(i)).collect()).collect()
}

/// The fit at the top of the peak that a fit is near to.
fn at_the_top(fit: Fit, kind: &Kind, data: &Data) -> Fit {
    let fixed = stuck(&fit.hypothesis);
    let climbed = |from: Fit| {
        let Some(mut climbed) = climbed(&from, kind, data) else { return from };
        climbed.descend(data, LONG, &fixed);
        settle_signed(&mut climbed, data);
        begun::settle(&mut climbed, data);
        climbed
    };
    let mut fit = climbed(fit);
    for _ in 0..AGAIN {
        let higher = |about: &Surroundings| {
            let highest = peaks(&fit, data, about).into_iter().next();
            highest.filter(|other| other.objective() < fit.objective() - HIGHER)
        };
        let Some(other) = higher(&BESIDE).or_else(|| higher(&ABOUT)) else { break };
        fit = climbed(other);
    }
    fit
}

/// Moves the numbers of the last term that may have either sign (where the stem was at the start), by parts of its largest number: a climb moves each by a part of
/// itself, and one near zero nowhere.
fn settle_signed(fit: &mut Fit, data: &Data) {
    let Some((kind, top)) = top(fit) else { return };
    let Some(tangent) = fit.tangent(data, &stuck(&fit.hypothesis)) else { return };
    let largest = top.iter().copied().fold(0.0, f64::max);
    for (place, parameter) in stuck(&fit.hypothesis).into_iter().zip(kind.parameters) {
        let Some(free) = fit.hypothesis.free.get(place).filter(|_| parameter.range == Range::Any) else {
            continue;
        };
        let mut width = SIGNED.0 * largest / free.scale;
        let least = SIGNED.1 * largest / free.scale;
        while width > least {
            let moved = [-width, width].into_iter().any(|by| {
                let mut point = fit.point.clone();
                point.x.get_mut(place).iter_mut().for_each(|x| **x += by);
                fit.tried(point, data, Some(&tangent), SLID_GAIN)
            });
            if !moved {
                width *= 0.5;
            }
        }
    }
}

/// Fits at other peaks about the top, the likeliest first: a needle's top has many, some per cent of its numbers apart.
pub fn peaks(fit: &Fit, data: &Data, about: &Surroundings) -> Vec<Fit> {
    let Some((kind, top)) = top(fit) else { return Vec::new() };
    let points = drawn(kind, &top, about.count, |i| about.reach / f64::from(1 << (i % 3)));
    let begins = needles(fit, data, points, about.look);
    let Some(tangent) = fit.tangent(data, &stuck(&fit.hypothesis)) else { return Vec::new() };
    let slid = begins.into_par_iter().filter_map(|begin| {
        let mut near = Fit::at(&begin.hypothesis, &begin.point, data)?;
        near.slide(data, &tangent, SLIDES);
        Some(near)
    });
    let mut peaks: Vec<Fit> = slid.collect();
    peaks.sort_by(|a, b| a.objective().total_cmp(&b.objective()));
    peaks
}

/// Points about a top, deviations of so large a part of the largest number from it: all together, and each by itself besides, for what is left between
/// two of them may be known best.
fn drawn(kind: &Kind, top: &[f64], count: usize, reach: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    let largest = top.iter().copied().fold(0.0, f64::max);
    (0..count)
        .map(|i| {
            let all = libm::exp(2.0 * reach(i) * draw());
            let moved = top.iter().zip(kind.parameters).map(|(value, parameter)| {
                let moved = all * (value + reach(i) * largest * draw());
                if !parameter.fitted {
                    return *value;
                }
                if parameter.range == Range::Any { moved } else { moved.max(LEAST * largest) }
            });
            moved.collect()
        })
        .collect()
}

/// The last part of the way, by runs of the filter: one event that comes a sample late costs more than all numbers do.
fn climbed(fit: &Fit, kind: &Kind, data: &Data) -> Option<Fit> {
    let steps = Steps { count: STEPS, reach: REACH, seed: 0 };
    let worth = |parameters: &[f64]| Some(-with(fit, parameters, data)?.objective());
    with(fit, &climb(kind, (parameters(fit)?, -fit.objective()), steps, worth).0, data)
}

/// The kind of a needle, and the numbers at its top; none of another kind.
fn top(fit: &Fit) -> Option<(&'static Kind, Vec<f64>)> {
    last_kind(fit).zip(parameters(fit)).filter(|_| !stuck(&fit.hypothesis).is_empty())
}

/// The fit's last term's parameters.
fn parameters(fit: &Fit) -> Option<Vec<f64>> {
    Some(fit.hypothesis.realise(&fit.point)?.model.physics.pop()?.parameters)
}

/// The fit with others.
fn with(fit: &Fit, parameters: &[f64], data: &Data) -> Option<Fit> {
    let point = fit.hypothesis.started(&fit.point, &Start::of(parameters.to_vec()), 0.0);
    Fit::at(&fit.hypothesis, &point, data)
}

/// Fits at other tops, anywhere, that are about as likely as this one; none of another kind, nor beside a stated plant, which tells them apart. Where a valve slips few times, several of
/// them explain what was fitted to.
pub fn other_tops(fit: &Fit, data: &Data) -> Vec<Fit> {
    let Some((kind, about)) = top(fit).filter(|_| fit.hypothesis.is_guessed) else { return Vec::new() };
    let Starts::Peak { dense, .. } = kind.search else { return Vec::new() };
    let mut points = dense(&fit.hypothesis.scales);
    points.retain(|point| kind.is_one_form(point, &about));
    let begins = needles(fit, data, points, ANYWHERE);
    let fixed = stuck(&fit.hypothesis);
    let ended = begins.into_par_iter().filter_map(|begin| {
        let mut other = Fit::at(&begin.hypothesis, &begin.point, data)?;
        other.descend(data, LONG, &fixed);
        Some(climbed(&other, kind, data).unwrap_or(other))
    });
    let mut tops: Vec<Fit> = ended.collect();
    tops.retain(|other| 0.5 * (other.objective() - fit.objective()) < AS_LIKELY);
    tops
}

/// Other fits about the top of a needle, near and as far as the slips of a real valve scatter; none of another kind.
pub fn near_the_top(fit: &Fit, data: &Data) -> Vec<Fit> {
    let Some((kind, top)) = top(fit) else { return Vec::new() };
    let drawn = drawn(kind, &top, DRAWN, |i| SCATTER / f64::from(1 << (i % HALVES)));
    drawn.par_iter().filter_map(|parameters| with(fit, parameters, data)).collect()
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

    const SAMPLES: usize = 9_000;
    /// u rests within the band until then.
    const RESTS: usize = 4_000;
    const BAND: f64 = 1.0;

    /// A flow behind a valve, written out: the stem stays until u is a band away from it, then goes to within the band less the jump of it; y follows with gain 2 and
    /// a lag of 10 samples. u is noisy (0.05), rests at first, then swings over three bands to and fro.
    fn flow(jump: f64) -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let (of_u, of_y) =
            (sequence(SAMPLES, 0.05, 0.0, &mut random), sequence(SAMPLES, 0.02, 0.0, &mut random));
        let (mut stem, mut level) = (0.0_f64, 0.0);
        let (mut u, mut y) = (Vec::new(), Vec::new());
        for (n, (of_u, of_y)) in of_u.iter().zip(of_y).enumerate() {
            let swing = n.saturating_sub(RESTS) as f64 / 130.0;
            u.push(3.0 * libm::sin(swing) + of_u);
            y.push(level + of_y);
            let off = u[n] - stem;
            if off.abs() > BAND {
                stem = u[n] - (BAND - jump).copysign(off);
            }
            level += (1.0 - libm::exp(-0.1)) * (2.0 * stem - level);
        }
        Signals { sample_time_s: 1.0, r: y.clone(), y, u, ..Signals::default() }
    }

    /// A fit that has the valve's lag and hardly a jump, from which the way leads to the needle.
    fn beside(jump: f64) -> (Fit, Data) {
        let text = "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"first-order\"\ngain = 2.1\ntime_constant_s = 9.0\n";
        let model = Loop::parse(text, "a flow").unwrap();
        let recordings = vec![flow(jump)];
        let plain = likelihood_search::hypothesis(&model, &recordings, &Options::default());
        let data = Data::new(&plain, recordings, vec![SAMPLES]);
        let beside = [("stick_band", BAND - 0.5 * jump), ("slip_jump", 0.02), ("stem_at_start", 0.0)];
        let hypothesis = plain.with(Term::new("stiction", &beside).unwrap());
        let fit = nominal::fit_noise(&hypothesis, &data, &hypothesis.places_of(0)).unwrap();
        (fit, data)
    }

    /// From what backlash of the same lag would be, the way leads to the needle, though no valve moves in the first samples.
    #[test]
    fn a_valve_that_rests_at_first_is_found() {
        let jump = 0.4;
        let (fit, data) = beside(jump);
        let near = near_needle(fit, &data);
        let found = parameters(&near).unwrap();
        assert!((found[0] - BAND).abs() < 0.005 * BAND, "{found:?}");
        let kind = last_kind(&near).unwrap();
        let top = at_needle(near, kind, &data);
        let found = parameters(&top).unwrap();
        assert!((found[0] - BAND).abs() < 0.003 * BAND && (found[1] - jump).abs() < 0.05 * jump, "{found:?}");
    }

    /// A jump that lies between the fine points, from which the way ends beside the needle: the finest lead to it.
    #[test]
    fn a_valve_that_the_fine_points_miss_is_found() {
        let jump = 0.71;
        let (fit, data) = beside(jump);
        let band = |fit: &Fit| parameters(fit).unwrap()[0];
        let near = near_needle(fit, &data);
        assert!((band(&near) - BAND).abs() > 0.01 * BAND, "{}", band(&near));
        let nearest = nearest_needle(near.clone(), &data);
        assert!((band(&nearest) - BAND).abs() < 0.005 * BAND, "{}", band(&nearest));
        assert!(nearest.objective() < near.objective() - 1_000.0);
    }

    /// The top that a way from a valve that slips in step with the true one leads to, whose band is off by these parts of the jump and the jump by such a part of itself.
    fn top_from(jump: f64, off: f64, of_jump: f64) -> Vec<f64> {
        let (fit, data) = beside(jump);
        let kind = last_kind(&fit).unwrap();
        let in_step = with(&fit, &[BAND + off * jump, jump * (1.0 + of_jump), 0.0], &data).unwrap();
        parameters(&at_needle(in_step, kind, &data)).unwrap()
    }

    /// Such valves slip at the same times as long as u goes one way: from half a jump beside the truth, and from two jumps where the jump is not quite right, the way to the top leads past
    /// them.
    #[test]
    fn valves_in_step_are_told_from_the_true_one() {
        let jump = 0.4;
        for (off, of_jump) in [(0.5, 0.0), (2.03, 0.002)] {
            let found = top_from(jump, off, of_jump);
            let is_true = (found[0] - BAND).abs() < 0.003 * BAND && (found[1] - jump).abs() < 0.02 * jump;
            assert!(is_true, "{off}: {found:?}");
        }
    }
}
