//! The control law, judged by its own error in u: what it makes of the recorded r and y against the recorded u. It needs no plant, and
//! feedback can't bias it. A law that misses u is mended by one ratio of all its gains first, or by other numbers, then by a delay or a limit; one that can't be
//! mended is another law.

use crate::control_loop::Loop;
use crate::controller::{Controller, Limits};
use crate::estimate::law_replay::{ControllerReplay, TOLERANCE, replay};
use crate::estimate::signals::{Signals, deviation, range};
use crate::init::control_law;
use crate::physics::{Place, Term};

/// Relative error of u beyond which a law that nothing mends is another one.
const ANOTHER: f64 = 0.1;
/// Part of the law's error that a mend of more than its numbers must leave at most.
const MAY_LEAVE: f64 = 0.5;
/// Error of u, relative, below which laws do not differ.
const EXACT: f64 = 1e-3;
/// Times that the ratio of a law's gains is fitted: its integrator begins where the law before has it.
const SCALED: usize = 3;
/// Delays tried, in samples.
const LONGEST_DELAY: usize = 12;
/// Part of the range of u within which samples dwell at a limit, and the least number of them.
const DWELLS: [f64; 3] = [0.002, 0.02, 0.05];
const LEAST_DWELL: usize = 5;
/// Least correlation between u and what a limited law makes: cut to u's own range any law comes closer to it.
const FOLLOWS: f64 = 0.5;
/// Relative change from which a number of the law is another.
pub const OTHER_NUMBER: f64 = 0.01;

/// What the recordings say of the law.
#[derive(Debug, Clone)]
pub struct Law {
    /// The loop with its law mended, as far as that was needed.
    pub model: Loop,
    /// Terms that are wrong with it.
    pub terms: Vec<Term>,
    /// Its numbers, where others are needed: (name, as stated, as recorded).
    pub numbers: Vec<(String, f64, f64)>,
    /// Whether nothing mends it.
    pub is_another: bool,
    /// The stated law's replay of the first recording.
    pub replay: Option<ControllerReplay>,
}

impl Law {
    /// Where the first fault is.
    pub fn place(&self) -> Option<Place> {
        if !self.numbers.is_empty() {
            return Some(Place::Controller);
        }
        self.terms.first().map(|term| term.kind.place)
    }
}

/// A mended loop and how far it misses u, rms over u's deviation, at the worst of the recordings.
struct Mend {
    model: Loop,
    terms: Vec<Term>,
    error: f64,
}

/// Judges the stated law on all recordings.
pub fn examine(stated: &Loop, recordings: &[Signals]) -> Law {
    let unknown = !stated.has_law();
    let replayed = recordings.first().and_then(|signals| replay(stated, signals));
    let fine = Law {
        model: stated.clone(),
        terms: Vec::new(),
        numbers: Vec::new(),
        is_another: false,
        replay: replayed,
    };
    let Some(before) = (!unknown).then(|| error(stated, recordings)).flatten() else { return fine };
    if before < TOLERANCE {
        return fine;
    }
    // The simplest first; each next one must leave half of what the one before leaves.
    let mut best: Option<Mend> = None;
    for mend in mends(stated, recordings) {
        if best.as_ref().is_none_or(|best| best.error > TOLERANCE && mend.error < MAY_LEAVE * best.error)
            && mend.error < MAY_LEAVE * before
        {
            best = Some(mend);
        }
    }
    match best.filter(|mend| mend.error < ANOTHER.max(MAY_LEAVE * before) && mend.error < 3.0 * ANOTHER) {
        Some(mend) => {
            Law { numbers: changed(stated, &mend.model), model: mend.model, terms: mend.terms, ..fine }
        }
        None => Law { is_another: before > ANOTHER, ..fine },
    }
}

/// How far a law misses u at the worst.
fn error(model: &Loop, recordings: &[Signals]) -> Option<f64> {
    let errors: Option<Vec<f64>> =
        recordings.iter().map(|signals| replay(model, signals).map(|replay| replay.relative)).collect();
    errors?.into_iter().reduce(f64::max)
}

/// Ways to mend the law, the simplest first.
fn mends(stated: &Loop, recordings: &[Signals]) -> Vec<Mend> {
    let mut found = Vec::new();
    let judged = |model: Loop, terms: Vec<Term>| {
        let at_work = Loop {
            physics: model
                .physics
                .iter()
                .cloned()
                .chain(terms.iter().filter(|t| t.kind.place == Place::Controller).cloned())
                .collect(),
            ..model.clone()
        };
        let error = error(&at_work, recordings)?;
        Some(Mend { model: at_work, terms, error })
    };
    let renumbered_alone = renumbered(stated, recordings, 0).and_then(|model| judged(model, Vec::new()));
    let scaled = scaled(stated, recordings).and_then(|term| judged(stated.clone(), vec![term]));
    // Numbers of their own leave about as much as one ratio of all where it is one.
    let is_one_ratio = |scaled: &Mend| {
        renumbered_alone.as_ref().is_none_or(|own| MAY_LEAVE * scaled.error < own.error.max(EXACT))
    };
    found.extend(scaled.filter(is_one_ratio));
    found.extend(renumbered_alone);
    let late: Vec<Term> = (1..=LONGEST_DELAY).filter_map(|samples| delay(stated, samples)).collect();
    let limits = limits(stated, recordings);
    let best_of = |mends: Vec<Mend>| mends.into_iter().min_by(|a, b| a.error.total_cmp(&b.error));
    found
        .extend(best_of(late.iter().filter_map(|term| judged(stated.clone(), vec![term.clone()])).collect()));
    found.extend(best_of(
        limits.iter().filter_map(|(model, term)| judged(model.clone(), vec![term.clone()])).collect(),
    ));
    found.extend(best_of(
        limits
            .iter()
            .flat_map(|(model, limit)| late.iter().map(move |late| (model, limit, late)))
            .filter_map(|(model, limit, late)| judged(model.clone(), vec![limit.clone(), late.clone()]))
            .collect(),
    ));
    found.extend(best_of(
        (1..=3)
            .filter_map(|samples| {
                judged(renumbered(stated, recordings, samples)?, vec![delay(stated, samples)?])
            })
            .collect(),
    ));
    found
}

fn delay(stated: &Loop, samples: usize) -> Option<Term> {
    Term::new("controller_delay", &[("delay_s", samples as f64 * stated.sample_time_s)]).ok()
}

/// All gains times one ratio; `None` of a law with one gain, of which that is another number.
fn scaled(stated: &Loop, recordings: &[Signals]) -> Option<Term> {
    let gains = match &stated.controller {
        Controller::Pi(law) => [law.kp, law.ki, 0.0],
        Controller::Pid(law) => [law.kp, law.ki, law.kd],
        Controller::PVelocity(_) | Controller::Recorded => return None,
    };
    if gains.iter().filter(|gain| **gain != 0.0).count() < 2 {
        return None;
    }
    let signals = recordings.first()?;
    let term = |ratio: f64| Term::new("controller_gain", &[("ratio", ratio)]).ok();
    let mut ratio = 1.0;
    for _ in 0..SCALED {
        let mut model = stated.clone();
        model.physics.push(term(ratio)?);
        ratio *= replay(&model, signals)?.gain;
    }
    term(ratio).filter(|_| ratio > 0.0 && (ratio - 1.0).abs() > OTHER_NUMBER)
}

/// The law with the numbers that a regression finds, of the stated kind; u late by so many samples.
fn renumbered(stated: &Loop, recordings: &[Signals], late: usize) -> Option<Loop> {
    let signals = recordings.first()?;
    let n = signals.len().checked_sub(late)?;
    let early = Signals { u: signals.u.get(late..)?.to_vec(), ..signals.part(0, n) };
    let found = control_law::find(stated, &early).controller;
    let controller = with_numbers_of(&stated.controller, &found)?;
    Some(Loop { controller, ..stated.clone() })
}

/// The stated law with the gains of another of its kind; a PI law is a PID law without derivative, and a P law a PI law without integral.
fn with_numbers_of(stated: &Controller, found: &Controller) -> Option<Controller> {
    let mut law = stated.clone();
    match (&mut law, found) {
        (Controller::Pi(law), Controller::Pi(found)) => (law.kp, law.ki) = (found.kp, found.ki),
        (Controller::Pid(law), Controller::Pid(found)) => {
            (law.kp, law.ki, law.kd) = (found.kp, found.ki, found.kd);
            law.derivative_filter_s = found.derivative_filter_s;
        }
        (Controller::PVelocity(law), Controller::PVelocity(found)) => (law.kp, law.kv) = (found.kp, found.kv),
        _ => return None,
    }
    Some(law)
}

/// The law limited where u dwells, with the limit as a term.
fn limits(stated: &Loop, recordings: &[Signals]) -> Vec<(Loop, Term)> {
    let Some(signals) = recordings.first() else { return Vec::new() };
    let (lowest, highest) = range(&signals.u);
    let dwell = |extreme: f64| -> Vec<Option<f64>> {
        let levels = DWELLS.iter().filter_map(|width| {
            let at: Vec<f64> = signals
                .u
                .iter()
                .copied()
                .filter(|u| (extreme - u).abs() <= width * (highest - lowest))
                .collect();
            (at.len() >= LEAST_DWELL).then(|| at.iter().sum::<f64>() / at.len() as f64)
        });
        std::iter::once(None).chain(levels.map(Some)).collect()
    };
    let own = stated.controller.limits();
    let mut found = Vec::new();
    for low in dwell(lowest) {
        for high in dwell(highest) {
            let limits = Limits { u_min: low.unwrap_or(own.u_min), u_max: high.unwrap_or(own.u_max) };
            if limits == own || limits.u_min >= limits.u_max {
                continue;
            }
            let model = Loop { controller: stated.controller.clone().with_limits(limits), ..stated.clone() };
            let Some(replayed) = replay(&model, signals) else { continue };
            if follows(&replayed, signals) < FOLLOWS {
                continue;
            }
            // A side without a limit is put beyond all that the law asked for.
            let reach = 2.0
                * replay(stated, signals)
                    .map_or(1.0, |free| free.u.iter().map(|u| u.abs()).fold(0.0, f64::max));
            let side = |limit: Option<f64>, sign: f64| {
                limit.unwrap_or(sign * reach.max(highest.abs()).max(lowest.abs()))
            };
            let parameters = [("lower", side(low, -1.0)), ("upper", side(high, 1.0))];
            if let Ok(term) = Term::new("saturation", &parameters) {
                found.push((model, term));
            }
        }
    }
    found
}

/// Correlation of the law's output with u, late as it may be.
fn follows(replay: &ControllerReplay, signals: &Signals) -> f64 {
    let late: Vec<f64> = signals.u.iter().skip(replay.shift).copied().collect();
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len().max(1) as f64;
    let (mu, mv) = (mean(&late), mean(&replay.u));
    let cross =
        late.iter().zip(&replay.u).map(|(u, v)| (u - mu) * (v - mv)).sum::<f64>() / late.len().max(1) as f64;
    cross / (deviation(&late) * deviation(&replay.u)).max(1e-300)
}

/// The law's numbers that are other than stated.
fn changed(stated: &Loop, mended: &Loop) -> Vec<(String, f64, f64)> {
    let pairs = stated.controller.gains().into_iter().zip(mended.controller.gains());
    pairs
        .filter(|((_, a), (_, b))| (a - b).abs() > OTHER_NUMBER * a.abs().max(b.abs()))
        .map(|((name, a), (_, b))| (format!("controller.{name}"), a, b))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Recording, RowState};
    use crate::reference::Reference;
    use crate::simulate::simulate;

    /// What is stated of the law, and what is found of it on a heater that was recorded under another one.
    fn examined(kp: f64, ki: f64) -> Law {
        let under = |kp: f64, ki: f64| {
            let text = format!(
                "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"pi\"\nkp = {kp}\nki = {ki}\n[plant]\nkind = \"first-order\"\ngain = 2.0\ntime_constant_s = 60.0\n[sensor]\nnoise = 0.05\n"
            );
            Loop::parse(&text, "loop.toml").unwrap()
        };
        let r = Reference::random(20.0, 30.0, 150, 3).take_samples(1_200);
        let trace = simulate(&under(kp, ki), &r, &[], 1, None).unwrap();
        let state = vec![RowState::Valid; r.len()];
        let recording =
            Recording { sample_time_s: 1.0, r, y: trace.y, u: trace.u, state, ..Recording::default() };
        let stated = under(1.5, 0.03);
        examine(&stated, &[Signals::new(&recording, &stated).unwrap()])
    }

    /// Both gains 1.3 times as large are one ratio.
    #[test]
    fn gains_that_are_larger_by_one_ratio_are_named_as_such() {
        let law = examined(1.3 * 1.5, 1.3 * 0.03);
        let [term] = &law.terms[..] else { panic!("{:?}", law.terms) };
        assert_eq!(term.kind.name, "controller_gain");
        assert!((term.parameters[0] - 1.3).abs() < 0.002, "{:?}", term.parameters);
        assert!(law.numbers.is_empty() && !law.is_another);
    }

    /// One of them is a number of its own.
    #[test]
    fn one_gain_that_is_larger_is_another_number() {
        let law = examined(1.5, 1.3 * 0.03);
        assert!(law.terms.is_empty(), "{:?}", law.terms);
        let names: Vec<&str> = law.numbers.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(names, ["controller.ki"]);
    }
}
