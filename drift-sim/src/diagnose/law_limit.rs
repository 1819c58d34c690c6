//! A limit of u that the stated law does not have, where u was recorded behind it.
//!
//! The law is replayed with limits at the ends of the recorded u; where that brings it much closer, on the hold-out as well, it was limited
//! there. The replay needs no model of the plant. Such a limit becomes one of the law itself, so that an integrator stops at it as the real one did; a limit behind
//! the recorded u is another matter, and the plant's ([`super::identify`], and the search).

use crate::control_loop::Loop;
use crate::controller::Limits;
use crate::physics::Term;

use super::controller_replay::{ControllerReplay, TOLERANCE, replay};
use super::fit::mean_square;
use super::signals::{Signals, deviation, range};

/// Part of the replay's error, root mean square, that the limit may leave.
const MAY_LEAVE: f64 = 0.6;
/// The same where the hold-out hardly comes to the limit and can only not speak against it.
const MAY_LEAVE_ALONE: f64 = 0.3;
/// Least correlation between u and what the limited law makes.
const FOLLOWS: f64 = 0.5;
/// Least samples at a limit.
const LEAST_SAMPLES: usize = 5;
/// Width of a limit's level, as parts of the range of u: noise of the recorded u. The likeliest is taken.
const WIDTHS: [f64; 3] = [0.002, 0.02, 0.05];

/// The limit.
#[derive(Debug, Clone)]
pub struct LawLimit {
    /// The loop with the limit in its law.
    pub model: Loop,
    /// The limit as physics.
    pub term: Term,
    /// Half widths of the 95 % intervals of its levels; infinite for a side without one.
    pub half_widths: Vec<f64>,
    /// Gain in log-likelihood of u on the training part.
    pub gain: f64,
    /// The same on the hold-out, in standard errors.
    pub holdout_errors: f64,
}

/// One side: its level and the scatter of u around it.
#[derive(Clone, Copy)]
struct Side {
    level: f64,
    half_width: f64,
}

/// The limit, if with it the law comes much closer to the recorded u on both recordings.
pub fn find(model: &Loop, train: &Signals, holdout: &Signals) -> Option<LawLimit> {
    let free = replay(model, train)?;
    if free.relative < TOLERANCE || deviation(&train.u) <= 0.0 {
        return None;
    }
    let (lower, upper) = (levels(-1.0, &train.u), levels(1.0, &train.u));
    let pairs = lower.iter().flat_map(|low| upper.iter().map(move |high| [*low, *high]));
    let (with, sides, limited) = pairs
        .filter_map(|sides| {
            let limited = limited(model, sides)?;
            Some((error(&replay(&limited, train)?, train), sides, limited))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    // Any law comes closer to any u when it is cut to u's range: with the limit it must follow.
    if follows(&replay(&limited, train)?, train) < FOLLOWS {
        return None;
    }
    let without = error(&free, train);
    let (held_with, held_without) =
        (error(&replay(&limited, holdout)?, holdout), error(&replay(model, holdout)?, holdout));
    let much = |part: f64, with: f64, without: f64| with <= part * part * without;
    let on_both = much(MAY_LEAVE, with, without) && much(MAY_LEAVE, held_with, held_without);
    let alone = much(MAY_LEAVE_ALONE, with, without) && held_with <= held_without;
    if !on_both && !alone {
        return None;
    }
    // A side without a limit is put beyond all that the law asked for.
    let reach = free.u.iter().map(|v| v.abs()).fold(0.0, f64::max) * 2.0;
    let finite = |limit: f64| if limit.is_finite() { limit } else { reach * limit.signum() };
    let limits = limited.controller.limits();
    let parameters = [("lower", finite(limits.u_min)), ("upper", finite(limits.u_max))];
    Some(LawLimit {
        term: Term::new("saturation", &parameters).ok()?,
        half_widths: sides.iter().map(|s| s.as_ref().map_or(f64::INFINITY, |s| s.half_width)).collect(),
        gain: 0.5 * train.len() as f64 * libm::log(without / with.max(1e-12 * without)),
        holdout_errors: libm::sqrt(holdout.len() as f64) * (1.0 - held_with / held_without),
        model: limited,
    })
}

/// The loop with these limits beside those that its law states.
fn limited(model: &Loop, sides: [Option<Side>; 2]) -> Option<Loop> {
    let stated = model.controller.limits();
    let [lower, upper] = sides;
    let limits = Limits {
        u_min: lower.map_or(stated.u_min, |side| side.level),
        u_max: upper.map_or(stated.u_max, |side| side.level),
    };
    let other = limits != stated && limits.u_min < limits.u_max;
    other.then(|| Loop { controller: model.controller.clone().with_limits(limits), ..model.clone() })
}

/// Where u may have stayed on this side: no limit, and the mean of what lies within each width of its extreme.
fn levels(side: f64, u: &[f64]) -> Vec<Option<Side>> {
    let (lowest, highest) = range(u);
    let (range, extreme) = (highest - lowest, if side > 0.0 { highest } else { lowest });
    let within = |width: f64| {
        let at: Vec<f64> = u.iter().copied().filter(|u| (extreme - u).abs() <= width * range).collect();
        let level = at.iter().sum::<f64>() / at.len().max(1) as f64;
        let half_width = 1.96 * deviation(&at).max(1e-6 * range);
        (at.len() >= LEAST_SAMPLES).then_some(Side { level, half_width })
    };
    std::iter::once(None).chain(WIDTHS.into_iter().map(within).filter(Option::is_some)).collect()
}

/// Correlation of the law's output with u, late as it may be.
fn follows(replay: &ControllerReplay, signals: &Signals) -> f64 {
    let (n, u) = (signals.len().saturating_sub(replay.shift), signals.u.iter().skip(replay.shift));
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len().max(1) as f64;
    let (mu, mv) = (mean(&signals.u), mean(&replay.u));
    let cross = u.zip(&replay.u).map(|(u, v)| (u - mu) * (v - mv)).sum::<f64>() / n.max(1) as f64;
    cross / (deviation(&signals.u) * deviation(&replay.u)).max(1e-300)
}

/// Mean square of what the law misses u by, late as it may be.
fn error(replay: &ControllerReplay, signals: &Signals) -> f64 {
    let late = signals.u.iter().skip(replay.shift).zip(&replay.u).map(|(u, v)| u - v);
    mean_square(&late.collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::{Controller, Pi};
    use crate::reference::Reference;
    use crate::simulate::simulate;

    /// The paper's loop with a limit of this size in its law.
    fn recorded(limit: f64, seed: u64) -> Signals {
        let mut model = Loop::paper();
        model.controller = model.controller.with_limits(Limits { u_min: -limit, u_max: limit });
        let r = Reference::random(0.0, 1.0, 400, seed).take_samples(8000);
        let trace = simulate(&model, &r, &[], seed, None).unwrap();
        let sample_time_s = model.sample_time_s;
        Signals { sample_time_s, start_s: 0.0, origin_s: 0.0, r, y: trace.y, u: trace.u, inputs: Vec::new() }
    }

    #[test]
    fn a_u_of_another_law_is_not_called_limited() {
        let mut signals = recorded(1e9, 1);
        signals.u = (0..signals.len()).map(|n| libm::cos(0.143 * n as f64)).collect();
        let (train, holdout) = (signals.part(0, 5600), signals.part(5600, 8000));
        let mut model = Loop::paper();
        model.controller = model.controller.with_limits(Limits::NONE);
        assert!(find(&model, &train, &holdout).is_none());
    }

    #[test]
    fn a_limit_that_the_law_does_not_state_is_found_and_none_where_there_is_none() {
        let mut model = Loop::paper();
        model.controller = model.controller.with_limits(Limits::NONE);
        assert!(matches!(&model.controller, Controller::Pi(Pi { .. })));
        let free = recorded(1e9, 1);
        assert!(find(&model, &free, &recorded(1e9, 2)).is_none());
        let mut sizes: Vec<f64> = free.u.iter().map(|u| u.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let limit = sizes[sizes.len() * 9 / 10];
        let found = find(&model, &recorded(limit, 1), &recorded(limit, 2)).unwrap();
        assert!((found.term.value("upper").unwrap() / limit - 1.0).abs() < 1e-3, "{found:?}");
        assert!((found.term.value("lower").unwrap() / limit + 1.0).abs() < 1e-3, "{found:?}");
    }
}
