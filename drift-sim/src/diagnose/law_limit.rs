//! A limit of u that the stated law does not have, where u was recorded behind it.
//!
//! The law's own output goes beyond the recorded u there, and only there, and u stays at one level. The replay needs no model of the
//! plant. Such a limit becomes one of the law itself, so that an integrator stops at it as the real one did; a limit behind
//! the recorded u is another matter, and the plant's ([`super::identify`], and the search).

use crate::control_loop::Loop;
use crate::controller::{Controller, Limits};
use crate::physics::{Place, Term};

use super::closed_loop::fit_pct;
use super::controller_replay::{ControllerReplay, TOLERANCE, replay};
use super::fit::mean_square;
use super::signals::{Signals, deviation};
use super::{Diagnosis, Fits, Named, Verdict};

/// Part of the replay's error, root mean square, that the limit may leave.
const MAY_LEAVE: f64 = 0.6;
/// Least share of the samples at a limit.
const LEAST_SAMPLES: f64 = 0.01;
/// Width of a limit's level, as a part of the range of u: noise of the recorded u.
const LEVEL: f64 = 0.05;
/// How far beyond the level the law must want to go, as a part of the range of u.
const BEYOND: f64 = 0.05;

/// The limit.
#[derive(Debug, Clone)]
pub struct LawLimit {
    /// The loop with the limit in its law.
    pub model: Loop,
    /// The limit as physics.
    pub term: Term,
    /// Half widths of the 95 % intervals of its levels; infinite for a side without one.
    pub half_widths: Vec<f64>,
    gain: f64,
    holdout_errors: f64,
}

/// One side: its level and the scatter of u around it.
struct Side {
    level: f64,
    half_width: f64,
}

/// The limit, if the law goes beyond what was recorded, and with the limit it comes much closer on both recordings.
pub fn find(model: &Loop, train: &Signals, holdout: &Signals) -> Option<LawLimit> {
    let free = replay(model, train)?;
    if free.relative < TOLERANCE || deviation(&train.u) <= 0.0 {
        return None;
    }
    let sides = [-1.0, 1.0].map(|side| level(side, &train.u, &free.u));
    let stated = model.controller.limits();
    let limits = Limits {
        u_min: sides[0].as_ref().map_or(stated.u_min, |side| side.level),
        u_max: sides[1].as_ref().map_or(stated.u_max, |side| side.level),
    };
    if limits == stated || limits.u_min >= limits.u_max {
        return None;
    }
    let limited = Loop { controller: with_limits(&model.controller, limits)?, ..model.clone() };
    let left = |signals: &Signals| {
        let (with, without) = (replay(&limited, signals)?, replay(model, signals)?);
        Some((error(&with, signals), error(&without, signals)))
    };
    let ((with, without), (held_with, held_without)) = (left(train)?, left(holdout)?);
    let much = MAY_LEAVE * MAY_LEAVE;
    if with > much * without || held_with > much * held_without {
        return None;
    }
    // A side without a limit is put beyond all that the law asked for.
    let reach = free.u.iter().map(|v| v.abs()).fold(0.0, f64::max) * 2.0;
    let finite = |limit: f64| if limit.is_finite() { limit } else { reach * limit.signum() };
    let parameters = [("lower", finite(limits.u_min)), ("upper", finite(limits.u_max))];
    Some(LawLimit {
        term: Term::new("saturation", &parameters).ok()?,
        half_widths: sides.iter().map(|s| s.as_ref().map_or(f64::INFINITY, |s| s.half_width)).collect(),
        gain: 0.5 * train.len() as f64 * libm::log(without / with.max(1e-12 * without)),
        holdout_errors: libm::sqrt(holdout.len() as f64) * (1.0 - held_with / held_without),
        model: limited,
    })
}

/// Mean square of what the law misses u by, late as it may be.
fn error(replay: &ControllerReplay, signals: &Signals) -> f64 {
    let late = signals.u.iter().skip(replay.shift).zip(&replay.u).map(|(u, v)| u - v);
    mean_square(&late.collect::<Vec<f64>>())
}

/// Where u stays while the law wants to go further on this side.
fn level(side: f64, u: &[f64], wanted: &[f64]) -> Option<Side> {
    let (lowest, highest) =
        u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(*u), b.max(*u)));
    let range = highest - lowest;
    let extreme = if side > 0.0 { highest } else { lowest };
    let at: Vec<f64> = u
        .iter()
        .zip(wanted)
        .filter(|(u, v)| (extreme - **u).abs() < LEVEL * range && side * (**v - extreme) > BEYOND * range)
        .map(|(u, _)| *u)
        .collect();
    // While it wants to go further, u must be there: elsewhere the law is another, not limited.
    let wants = wanted.iter().filter(|v| side * (**v - extreme) > BEYOND * range).count();
    if (at.len() as f64) < LEAST_SAMPLES * u.len() as f64 || 2 * at.len() < wants {
        return None;
    }
    let level = at.iter().sum::<f64>() / at.len() as f64;
    Some(Side { level, half_width: 1.96 * deviation(&at).max(1e-6 * range) })
}

fn with_limits(controller: &Controller, limits: Limits) -> Option<Controller> {
    let mut controller = controller.clone();
    match &mut controller {
        Controller::Pi(law) => law.limits = limits,
        Controller::Pid(law) => law.limits = limits,
        Controller::PVelocity(law) => law.limits = limits,
        Controller::Recorded => return None,
    }
    Some(controller)
}

impl Diagnosis {
    /// The diagnosis of the limited loop as that of the loop as it was stated.
    #[must_use]
    pub(super) fn with_law_limit(
        mut self,
        limit: LawLimit,
        stated: &Loop,
        train: &Signals,
        holdout: &Signals,
    ) -> Self {
        let unlimited = |model: &Loop| Loop { controller: stated.controller.clone(), ..model.clone() };
        self.nominal = unlimited(&self.nominal);
        self.refitted = unlimited(&self.refitted);
        let fits = |of: &Fits, signals: &Signals| Fits {
            nominal: fit_pct(&self.nominal, signals),
            before: fit_pct(&self.refitted, signals),
            ..*of
        };
        (self.train, self.holdout) = (fits(&self.train, train), fits(&self.holdout, holdout));
        let named = Named {
            first: None,
            term: limit.term,
            half_widths: limit.half_widths,
            tied: Vec::new(),
            train_gain: limit.gain,
            holdout_errors: limit.holdout_errors,
        };
        self.physics.insert(0, named);
        self.place = Some(Place::Actuator);
        self.verdict = Verdict::MissingPhysics;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::Pi;
    use crate::reference::Reference;
    use crate::simulate::simulate;

    /// The paper's loop with a limit of this size in its law.
    fn recorded(limit: f64, seed: u64) -> Signals {
        let mut model = Loop::paper();
        model.controller = with_limits(&model.controller, Limits { u_min: -limit, u_max: limit }).unwrap();
        let r = Reference::random(0.0, 1.0, 400, seed).take_samples(8000);
        let trace = simulate(&model, &r, &[], seed, None).unwrap();
        let sample_time_s = model.sample_time_s;
        Signals { sample_time_s, start_s: 0.0, origin_s: 0.0, r, y: trace.y, u: trace.u, inputs: Vec::new() }
    }

    #[test]
    fn a_limit_that_the_law_does_not_state_is_found_and_none_where_there_is_none() {
        let mut model = Loop::paper();
        model.controller = with_limits(&model.controller, Limits::NONE).unwrap();
        assert!(matches!(&model.controller, Controller::Pi(Pi { .. })));
        let free = recorded(1e9, 1);
        assert!(find(&model, &free, &recorded(1e9, 2)).is_none());
        let limit = 0.5 * free.u.iter().map(|u| u.abs()).fold(0.0, f64::max);
        let found = find(&model, &recorded(limit, 1), &recorded(limit, 2)).unwrap();
        assert!((found.term.value("upper").unwrap() / limit - 1.0).abs() < 1e-3, "{found:?}");
        assert!((found.term.value("lower").unwrap() / limit + 1.0).abs() < 1e-3, "{found:?}");
    }
}
