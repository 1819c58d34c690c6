//! Controller replay: u as the stated law makes it of the recorded r and y, against the recorded u. It needs no plant
//! model, both sides are measured, and feedback can't bias it.

use crate::control_loop::Loop;
use crate::simulate::{Start, median, replay_law};

use super::signals::{Signals, deviation, held, rms};

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

/// u as the law makes it from a start on, and the recorded u less that.
fn from_start(model: &Loop, signals: &Signals, start: &Start) -> (Vec<f64>, Vec<f64>) {
    let replayed = replay_law(model, &signals.r, &held(&signals.y), start);
    let error = signals.u.iter().zip(&replayed).map(|(u, v)| u - v).collect();
    (replayed, error)
}

/// Replays the law; `None` where it is unknown.
pub fn replay(model: &Loop, signals: &Signals) -> Option<ControllerReplay> {
    if !model.has_law() {
        return None;
    }
    let start = Start::from_recording(model, &signals.r, &signals.y, &signals.u);
    let scale = deviation(&signals.u).max(1e-300);
    let (mut replayed, mut error) = from_start(model, signals, &start);
    if rms(&error) > TOLERANCE * scale {
        // What a filtered derivative was at the first sample is not recorded: the integrator had that u without it.
        let integrator = start.integrator + median(error.iter().copied().filter(|e| e.is_finite()).collect());
        let again = from_start(model, signals, &Start { integrator, ..start });
        if rms(&again.1) < rms(&error) {
            (replayed, error) = again;
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Recording, RowState};
    use crate::reference::Reference;
    use crate::simulate::simulate;

    /// A PID law with a filtered derivative, recorded from the middle of a movement on: what the filter was at then is not recorded, and is taken for no fault of the law.
    #[test]
    fn a_recording_that_begins_in_a_movement_shows_the_law_as_it_is() {
        let text = "[loop]\nsample_time_s = 0.01\n[controller]\nkind = \"pid\"\nkp = 3.0\nki = 2.0\nkd = 2.0\nderivative_filter_s = 0.05\nu_min = -1e4\nu_max = 1e4\n\
            [plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 0.5\n";
        let model = Loop::parse(text, "loop.toml").unwrap();
        let r = Reference::random(-1.0, 1.0, 150, 3).take_samples(1_200);
        let trace = simulate(&model, &r, &[], 1, None).unwrap();
        let late = |values: &[f64]| values[305..].to_vec();
        let (r, y, u) = (late(&r), late(&trace.y), late(&trace.u));
        let state = vec![RowState::Valid; r.len()];
        let recording = Recording { sample_time_s: 0.01, r, y, u, state, ..Recording::default() };
        let replayed = replay(&model, &Signals::new(&recording, &model).unwrap()).unwrap();
        assert!(replayed.relative < TOLERANCE, "{}", replayed.relative);
    }
}
