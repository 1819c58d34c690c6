//! y as a plant makes it of the recorded u, from the start that fits best. Beside a plant that does not forget its errors the [`observer`] corrects the run, and finds the start by
//! itself.

use nalgebra::{DMatrix, DVector};

use crate::control_loop::Loop;
use crate::estimate::signals::{Signals, deviation};
use crate::simulate::{SUBSTEPS, Simulation, Start};

use super::{observer, part_time};

/// Steps of the fit, the relative improvement of the sum of squares at which it stops, and how often a step that does not help is shortened.
const STEPS: usize = 4;
const ENOUGH: f64 = 1e-3;
const SHORTENED: usize = 8;
/// Width of a difference, as part of a number's scale.
const NARROW: f64 = 1e-4;
/// Damping at first, and its factors after a step that helped and one that did not.
const DAMPING: f64 = 1e-3;
const LESS: f64 = 0.2;
const MORE: f64 = 6.0;

/// y of a loop's plant under the recorded u; `None` where it diverges.
pub fn free_run(model: &Loop, signals: &Signals) -> Option<Vec<f64>> {
    let start = Start::from_recording(model, &signals.r, &signals.y, &signals.u);
    let state = start.state_for(model).unwrap_or_default();
    let run = Run { model: part_time::of(model.clone(), signals.origin_s), signals };
    let start = Start { state: Some(state), ..start };
    let fits = across_the_gap(model, &start).into_iter().filter_map(|start| run.fitted(start));
    let best = fits.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
    Some(best.y)
}

/// Starts with the plant in the middle and at either end of the gap between it and its sensor, of which a recording's start says nothing.
fn across_the_gap(model: &Loop, start: &Start) -> Vec<Start> {
    let Some(gap) = model.physics.iter().find_map(|term| term.kind.gap(&term.parameters)) else {
        return vec![start.clone()];
    };
    let moved = |part: f64| {
        let mut start = start.clone();
        if let Some(position) = start.state.as_mut().and_then(|state| state.first_mut()) {
            *position += part * gap;
        }
        start
    };
    [0.0, -0.5, 0.5].into_iter().map(moved).collect()
}

/// A number of the start that is free.
#[derive(Clone, Copy)]
enum Free {
    State(usize),
    /// What was held before the recording: of an unknown law only the dead time's echo tells it.
    Before,
}

impl Free {
    fn moved(self, start: &Start, by: f64) -> Start {
        let mut start = start.clone();
        match self {
            Self::Before => start.u += by,
            Self::State(i) => {
                if let Some(value) = start.state.as_mut().and_then(|state| state.get_mut(i)) {
                    *value += by;
                }
            }
        }
        start
    }
}

/// A loop beside a recording.
struct Run<'a> {
    model: Loop,
    signals: &'a Signals,
}

/// A start and what comes of it.
struct Fitted {
    start: Start,
    y: Vec<f64>,
    /// Measured less simulated y; 0 where y is missing.
    error: DVector<f64>,
    squares: f64,
}

impl Run<'_> {
    /// What is free of a start, with its scale.
    fn free(&self, start: &Start) -> Vec<(Free, f64)> {
        let mut free = Vec::new();
        if !observer::forgets(&self.model.plant) {
            let scale = deviation(&self.signals.y).max(1e-12);
            let of = |value: f64| if value == 0.0 { scale } else { value.abs().max(0.1 * scale) };
            let state = start.state.iter().flatten().enumerate();
            free.extend(state.map(|(i, value)| (Free::State(i), of(*value))));
        }
        let is_open = !self.model.has_law();
        if is_open && self.model.plant.delay_s() >= self.model.sample_time_s {
            free.push((Free::Before, deviation(&self.signals.u).max(1e-12)));
        }
        free
    }

    fn at(&self, start: Start) -> Option<Fitted> {
        let y = self.simulated(&start)?;
        let missed = self.signals.y.iter().zip(&y).map(|(y, own)| if y.is_finite() { y - own } else { 0.0 });
        let error = DVector::from_iterator(y.len(), missed);
        let squares = error.norm_squared();
        squares.is_finite().then_some(Fitted { start, y, error, squares })
    }

    fn simulated(&self, start: &Start) -> Option<Vec<f64>> {
        let signals = self.signals;
        let mut simulation = Simulation::with_substeps(&self.model, 0, SUBSTEPS).ok()?;
        simulation.start(start).ok()?;
        let gains = observer::gains(&self.model.plant, signals.sample_time_s);
        let mut inputs = vec![0.0; signals.inputs.len()];
        let mut simulated = Vec::with_capacity(signals.len());
        for (n, (u, y)) in signals.u.iter().zip(&signals.y).enumerate() {
            signals.inputs_at(n, &mut inputs);
            let own = simulation.replay_step(*u, &inputs).y;
            simulated.push(own);
            if !gains.is_empty() && y.is_finite() {
                simulation.correct(gains.iter().map(|gain| gain * (y - own)));
            }
        }
        // A diverging run stays diverged: the last sample tells.
        simulated.last().is_some_and(|y| y.is_finite()).then_some(simulated)
    }

    /// The start by damped least squares.
    fn fitted(&self, start: Start) -> Option<Fitted> {
        let free = self.free(&start);
        let mut best = self.at(start)?;
        let mut damping = DAMPING;
        for _ in 0..if free.is_empty() { 0 } else { STEPS } {
            let before = best.squares;
            let Some(next) = self.step(&best, &free, &mut damping) else { break };
            best = next;
            if before - best.squares < ENOUGH * before {
                break;
            }
        }
        Some(best)
    }

    fn step(&self, from: &Fitted, free: &[(Free, f64)], damping: &mut f64) -> Option<Fitted> {
        // Each number in its own scale: a column is the change of y by one of it.
        let column = |(free, scale): &(Free, f64)| match self.at(free.moved(&from.start, NARROW * scale)) {
            Some(moved) => (&from.error - moved.error) / NARROW,
            None => DVector::zeros(from.error.len()),
        };
        let columns: Vec<DVector<f64>> = free.iter().map(column).collect();
        // Columns of length one; a number without effect stays where it is.
        let shorten = |column: &DVector<f64>| {
            let length = column.norm();
            if length > 0.0 { 1.0 / length } else { 0.0 }
        };
        let per_length: Vec<f64> = columns.iter().map(shorten).collect();
        let scaled: Vec<DVector<f64>> =
            columns.iter().zip(&per_length).map(|(column, by)| column * *by).collect();
        let scaled = DMatrix::from_columns(&scaled);
        let (normal, right) = (scaled.tr_mul(&scaled), scaled.tr_mul(&from.error));
        for _ in 0..SHORTENED {
            let mut damped = normal.clone();
            (0..damped.nrows()).for_each(|i| damped[(i, i)] += *damping);
            let solved = damped.cholesky().map(|factor| factor.solve(&right));
            let solved =
                solved.map(|by| by.iter().zip(&per_length).map(|(by, per)| by * per).collect::<Vec<f64>>());
            let next = solved.and_then(|by| {
                let moves = free.iter().zip(by);
                self.at(
                    moves.fold(from.start.clone(), |start, ((of, scale), by)| of.moved(&start, scale * by))
                )
            });
            if let Some(next) = next.filter(|next| next.squares < from.squares) {
                *damping *= LESS;
                return Some(next);
            }
            *damping *= MORE;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::free_run;
    use crate::control_loop::Loop;
    use crate::estimate::signals::Signals;

    /// A lag that begins far from where u would hold it, by its closed form: `y = 2 u + (y0 - 2 u) exp(-t/5)`; y's first sample is off by a bad reading.
    #[test]
    fn a_run_begins_where_the_whole_recording_says() {
        let text = "[loop]\nsample_time_s = 0.1\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"first-order\"\ngain = 2.0\ntime_constant_s = 5.0\n";
        let model = Loop::parse(text, "loop.toml").unwrap();
        let exact = |n: usize| 2.0 + 7.0 * libm::exp(-0.1 * n as f64 / 5.0);
        let truth: Vec<f64> = (0..300).map(exact).collect();
        let mut y = truth.clone();
        y[0] += 3.0;
        let u = vec![1.0; y.len()];
        let run = free_run(&model, &Signals { sample_time_s: 0.1, r: y.clone(), y, u, ..Signals::default() })
            .unwrap();
        let worst = run.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // The bad reading is one of 300, and pulls as one of 300 does.
        assert!(worst < 0.15, "{worst}");
    }
}
