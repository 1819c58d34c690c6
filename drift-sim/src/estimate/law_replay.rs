//! Controller replay: u as the stated law makes it of the recorded r and y, against the recorded u. It needs no plant
//! model, both sides are measured, and feedback can't bias it.

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::simulate::{Start, replay_law};

use super::signals::{Signals, deviation, held};

/// What the replay shows.
#[derive(Debug, Clone)]
pub struct ControllerReplay {
    /// u as the law makes it.
    pub u: Vec<f64>,
    /// Recorded less replayed u.
    pub error: Vec<f64>,
    /// Its root mean square over u's standard deviation.
    pub relative: f64,
    /// The ratio by which the law's output must be multiplied to fit best.
    pub gain: f64,
    /// The shift, in samples, at which it fits best.
    pub shift: usize,
}

/// Share of u from which the law is not the one stated.
pub const TOLERANCE: f64 = 0.02;

/// Replays the law; `None` where it is unknown.
pub fn replay(model: &Loop, signals: &Signals) -> Option<ControllerReplay> {
    if model.controller == Controller::Recorded {
        return None;
    }
    let start = Start::from_recording(model, &signals.r, &signals.y, &signals.u);
    let replayed = replay_law(model, &signals.r, &held(&signals.y), &start);
    let error: Vec<f64> = signals.u.iter().zip(&replayed).map(|(u, v)| u - v).collect();
    let scale = deviation(&signals.u).max(1e-300);
    let rms = |e: &[f64]| libm::sqrt(e.iter().map(|e| e * e).sum::<f64>() / e.len().max(1) as f64);
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len().max(1) as f64;
    let (mu, mv) = (mean(&signals.u), mean(&replayed));
    let cross: f64 = signals.u.iter().zip(&replayed).map(|(u, v)| (u - mu) * (v - mv)).sum();
    let power: f64 = replayed.iter().map(|v| (v - mv) * (v - mv)).sum();
    let shift = (0..10)
        .min_by(|a, b| {
            let late = |k: usize| {
                let e: Vec<f64> = signals.u.iter().skip(k).zip(&replayed).map(|(u, v)| u - v).collect();
                rms(&e)
            };
            late(*a).total_cmp(&late(*b))
        })
        .unwrap_or(0);
    Some(ControllerReplay {
        relative: rms(&error) / scale,
        u: replayed,
        error,
        gain: cross / power.max(1e-300),
        shift,
    })
}
