//! What is wrong with the control law, where its replay does not give the recorded u: other gains, or a late output.
//!
//! Gains: the recorded u is regressed on the replayed one, the constant taking up the integrator's start. Delay: the shift
//! at which both agree best. Either must remove most of the error, on the hold-out as well.

use crate::control_loop::Loop;
use crate::physics::{Kind, Term};

use super::controller_replay::{ControllerReplay, TOLERANCE, replay};
use super::fit::mean_square;
use super::signals::Signals;
use super::whiten::effective_samples;

/// Part of the replay's error, root mean square, that the fault may leave.
const MAY_LEAVE: f64 = 0.3;
/// Longest delay looked for, in samples.
const LONGEST: usize = 20;
/// The least change of gain that is one.
const LEAST_CHANGE: f64 = 0.01;

/// A fault of the law.
#[derive(Debug, Clone)]
pub struct ControllerFault {
    /// The term.
    pub term: Term,
    /// Half width of its parameter's 95 % interval.
    pub half_width: f64,
    /// Gain in log-likelihood of u on the training part.
    pub train_gain: f64,
    /// Part of the error that is gone on the hold-out.
    pub holdout_share: f64,
}

/// u on v: slope, its half width and the root mean square of what is left.
struct Line {
    slope: f64,
    half_width: f64,
    left: f64,
}

fn line(v: &[f64], u: &[f64]) -> Option<Line> {
    let n = v.len().min(u.len()) as f64;
    let mean = |x: &[f64]| x.iter().take(n as usize).sum::<f64>() / n;
    let (mv, mu) = (mean(v), mean(u));
    let pairs = || v.iter().zip(u).map(|(v, u)| (v - mv, u - mu));
    let power: f64 = pairs().map(|(v, _)| v * v).sum();
    if n < 50.0 || power <= 0.0 {
        return None;
    }
    let slope = pairs().map(|(v, u)| v * u).sum::<f64>() / power;
    let rest: Vec<f64> = pairs().map(|(v, u)| u - slope * v).collect();
    let variance = mean_square(&rest) * n / effective_samples(&rest);
    Some(Line {
        slope,
        half_width: 1.96 * libm::sqrt(variance / power),
        left: libm::sqrt(mean_square(&rest)),
    })
}

/// The law's output late by `shift` samples, against u without its first samples.
fn late(replay: &ControllerReplay, signals: &Signals, shift: usize) -> Option<Line> {
    line(&replay.u, signals.u.get(shift..)?)
}

/// The fault, if the law does not give the recorded u and one explains why on both recordings.
pub fn find(
    model: &Loop,
    trained: &ControllerReplay,
    train: &Signals,
    holdout: &Signals,
) -> Option<ControllerFault> {
    if trained.relative < TOLERANCE {
        return None;
    }
    let held = replay(model, holdout)?;
    // A constant between the two is the integrator's unknown start, not a fault.
    let error = |u: &[f64], v: &[f64]| {
        let e: Vec<f64> = u.iter().zip(v).map(|(u, v)| u - v).collect();
        let mean = e.iter().sum::<f64>() / e.len().max(1) as f64;
        libm::sqrt(mean_square(&e.iter().map(|e| e - mean).collect::<Vec<_>>()))
    };
    let (before, before_held) = (error(&train.u, &trained.u), error(&holdout.u, &held.u));
    let (shift, found) = (0..=LONGEST)
        .filter_map(|shift| Some((shift, late(trained, train, shift)?)))
        .min_by(|a, b| a.1.left.total_cmp(&b.1.left))?;
    let again = late(&held, holdout, shift)?;
    if found.left > MAY_LEAVE * before || again.left > MAY_LEAVE * before_held {
        return None;
    }
    let (name, value, half_width) = if shift == 0 {
        ("controller_gain", found.slope, found.half_width)
    } else {
        ("controller_delay", shift as f64 * train.sample_time_s, 0.5 * train.sample_time_s)
    };
    if shift == 0
        && ((found.slope - 1.0).abs() < LEAST_CHANGE.max(found.half_width)
            || (found.slope - again.slope).abs()
                > 0.05 * found.slope.abs() + found.half_width + again.half_width)
    {
        return None;
    }
    let kind = Kind::named(name).ok()?;
    let term = Term { kind, parameters: vec![value], onset_s: 0.0, spans: Vec::new() };
    term.check().ok()?;
    Some(ControllerFault {
        term,
        half_width,
        train_gain: train.len() as f64 * libm::log(before / found.left.max(1e-12 * before)),
        holdout_share: 1.0 - again.left / before_held,
    })
}
