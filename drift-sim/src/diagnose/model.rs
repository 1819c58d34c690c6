//! A loop with free parameters: the nominal plant's own numbers, the numbers of candidate terms, onsets, and the
//! state in which the recording begins. A point x is turned into a loop that the simulator runs.

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::physics::{Range, Term};
use crate::plant::Plant;
use crate::simulate::{SUBSTEPS, Simulation, Start};

use super::observer;
use super::part_time;
use super::signals::{Signals, deviation};

/// What a free parameter stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// The plant's own number of this place in [`plant_numbers`].
    Plant(usize),
    /// Parameter `parameter` of term `term`.
    Term {
        /// Index into the loop's physics.
        term: usize,
        /// Index into the term's parameters.
        parameter: usize,
    },
    /// When the term begins, s.
    Onset(usize),
    /// A state at the first sample.
    State(usize),
    /// The u that was held before the first sample and is still in the dead time.
    Before,
}

impl Target {
    /// Whether it is of one recording alone, not of the loop.
    pub fn is_start(self) -> bool {
        matches!(self, Self::State(_) | Self::Before)
    }
}

/// One free parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// What it stands for.
    pub target: Target,
    /// Its name in reports.
    pub name: String,
    /// What it may be.
    pub range: Range,
    /// Its typical size: steps of the search are fractions of it.
    pub scale: f64,
}

/// A loop and what is free in it.
#[derive(Debug, Clone)]
pub struct Model {
    /// The loop at the starting point.
    pub nominal: Loop,
    /// What may move.
    pub free: Vec<Free>,
    /// The starting point, in the order of `free`.
    pub x: Vec<f64>,
    start: Start,
    substeps: usize,
    whitens: bool,
}

/// The numbers of a plant that a refit may move: name, value, range. What only scales all the others (a servo's
/// actuator gain against inertia and viscous friction) stays.
pub fn plant_numbers(plant: &Plant) -> Vec<(String, f64, Range)> {
    let own = |name: &str, value, range| (format!("plant.{name}"), value, range);
    match plant {
        Plant::Servo(p) => {
            vec![own("inertia", p.inertia, Range::Positive), own("viscous", p.viscous, Range::NotNegative)]
        }
        Plant::FirstOrder(p) => vec![
            own("gain", p.gain, Range::Any),
            own("time_constant_s", p.time_constant_s, Range::Positive),
            own("delay_s", p.delay_s, Range::NotNegative),
            own("offset", p.offset, Range::Any),
        ],
        Plant::StateSpace(p) => {
            let mut numbers: Vec<_> = magnitudes(&p.a)
                .into_iter()
                .enumerate()
                .map(|(i, value)| own(&format!("a{}", i + 1), value, Range::Positive))
                .collect();
            numbers.push(own("gain", 1.0, Range::Any));
            numbers
        }
        Plant::TransferFunction(p) => {
            let mut numbers: Vec<_> = (p.num.iter().enumerate())
                .filter(|(_, c)| **c != 0.0)
                .map(|(i, c)| own(&format!("num[{i}]"), *c, Range::Any))
                .collect();
            numbers.extend(
                p.den
                    .iter()
                    .enumerate()
                    .skip(1)
                    .filter(|(_, c)| **c != 0.0)
                    .map(|(i, c)| own(&format!("den[{i}]"), *c, Range::Any)),
            );
            if p.delay_s > 0.0 {
                numbers.push(own("delay_s", p.delay_s, Range::NotNegative));
            }
            if p.offset != 0.0 {
                numbers.push(own("offset", p.offset, Range::Any));
            }
            numbers
        }
        Plant::Tank(p) => {
            vec![own("inflow_gain", p.inflow_gain, Range::Any), own("outflow", p.outflow, Range::NotNegative)]
        }
        Plant::Identify => Vec::new(),
    }
}

/// The different magnitudes in a matrix, each once: entries of equal magnitude are one number of the physics (the
/// two damping entries and the two frequency entries of an oscillator, say) and move together.
fn magnitudes(a: &[Vec<f64>]) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::new();
    for value in a.iter().flatten().map(|v| v.abs()).filter(|v| *v > 0.0) {
        if !found.iter().any(|other| (other - value).abs() <= 1e-9 * value) {
            found.push(value);
        }
    }
    found
}

/// The plant with its numbers replaced, in the order of [`plant_numbers`].
pub fn with_plant_numbers(plant: &Plant, values: &[f64]) -> Plant {
    let mut plant = plant.clone();
    let mut values = values.iter().copied();
    let mut set = |slot: &mut f64| {
        if let Some(value) = values.next() {
            *slot = value;
        }
    };
    match &mut plant {
        Plant::Servo(p) => {
            set(&mut p.inertia);
            set(&mut p.viscous);
        }
        Plant::FirstOrder(p) => {
            set(&mut p.gain);
            set(&mut p.time_constant_s);
            set(&mut p.delay_s);
            set(&mut p.offset);
        }
        Plant::StateSpace(p) => {
            for old in magnitudes(&p.a) {
                let mut new = old;
                set(&mut new);
                for entry in p.a.iter_mut().flatten() {
                    if (entry.abs() - old).abs() <= 1e-9 * old {
                        *entry = new * entry.signum();
                    }
                }
            }
            let mut gain = 1.0;
            set(&mut gain);
            p.b.iter_mut().for_each(|b| *b *= gain);
            p.d *= gain;
        }
        Plant::TransferFunction(p) => {
            p.num.iter_mut().filter(|c| **c != 0.0).for_each(&mut set);
            p.den.iter_mut().skip(1).filter(|c| **c != 0.0).for_each(&mut set);
            if p.delay_s > 0.0 {
                set(&mut p.delay_s);
            }
            if p.offset != 0.0 {
                set(&mut p.offset);
            }
        }
        Plant::Tank(p) => {
            set(&mut p.inflow_gain);
            set(&mut p.outflow);
        }
        Plant::Identify => {}
    }
    plant
}

impl Model {
    /// The nominal loop with its plant's numbers and its starting state free.
    pub fn refit(nominal: &Loop, signals: &Signals) -> Self {
        let start = Start::from_recording(nominal, &signals.r, &signals.y, &signals.u);
        let mut model = Self {
            nominal: nominal.clone(),
            free: Vec::new(),
            x: Vec::new(),
            start,
            substeps: SUBSTEPS,
            whitens: true,
        };
        for (i, (name, value, range)) in plant_numbers(&nominal.plant).into_iter().enumerate() {
            let scale = match (value.abs() > 0.0, &nominal.plant) {
                (_, Plant::FirstOrder(_)) if name == "plant.offset" => deviation(&signals.y),
                (_, Plant::FirstOrder(p)) if name == "plant.delay_s" => {
                    p.delay_s.max(nominal.sample_time_s).max(0.05 * p.time_constant_s)
                }
                (_, Plant::TransferFunction(_)) if name == "plant.offset" => deviation(&signals.u),
                (true, _) => value.abs(),
                (false, _) => 1.0,
            };
            model.push(Free { target: Target::Plant(i), name, range, scale }, value);
        }
        let state = model.start.state_for(nominal).unwrap_or_default();
        let scale = deviation(&signals.y).max(1e-12);
        for (i, value) in state.iter().enumerate() {
            if !observer::forgets(&nominal.plant) {
                let free = Free {
                    target: Target::State(i),
                    name: format!("state[{i}]"),
                    range: Range::Any,
                    scale: if *value == 0.0 { scale } else { value.abs().max(0.1 * scale) },
                };
                model.push(free, *value);
            }
        }
        model.start.state = Some(state);
        // A known law tells what it held; of an unknown one only the dead time's echo does.
        if nominal.controller == Controller::Recorded && nominal.plant.delay_s() >= nominal.sample_time_s {
            let scale = deviation(&signals.u).max(1e-12);
            let free = Free { target: Target::Before, name: "u before".into(), range: Range::Any, scale };
            let held = model.start.u;
            model.push(free, held);
        }
        model
    }

    fn push(&mut self, free: Free, value: f64) {
        self.free.push(free);
        self.x.push(value);
    }

    /// The same at another point.
    #[must_use]
    pub fn at(&self, x: &[f64]) -> Self {
        Self { x: x.to_vec(), ..self.clone() }
    }

    /// The same, predicted with one step a sample also where terms act along the way: to search with, not to conclude.
    #[must_use]
    pub fn coarse(mut self) -> Self {
        self.substeps = 1;
        self
    }

    /// The same, predicted as the simulator does it.
    #[must_use]
    pub fn fine(mut self) -> Self {
        self.substeps = SUBSTEPS;
        self
    }

    /// The same, fitted to the prediction error as it is, without a noise model ([`Model::whitens`]).
    #[must_use]
    pub fn plain(mut self) -> Self {
        self.whitens = false;
        self
    }

    /// Whether a noise model goes with it. Whitening counts what changes fast as much as what changes slowly: right where
    /// the model is; where small fast physics stays unmodelled (a frame that swings), it bends the slow numbers to serve that.
    pub fn whitens(&self) -> bool {
        self.whitens
    }

    /// One more term, its parameters free (but for those of `fixed`), its onset free if wanted.
    #[must_use]
    pub fn with_term(&self, term: &Term, free_onset: bool, duration_s: f64) -> Self {
        let mut model = self.clone();
        let index = model.nominal.physics.len();
        for (i, (parameter, value)) in term.kind.parameters.iter().zip(&term.parameters).enumerate() {
            // What a file may leave out (growing noise, a phase) is not for this search to find.
            if parameter.default.is_some() {
                continue;
            }
            let free = Free {
                target: Target::Term { term: index, parameter: i },
                name: format!("{}.{}", term.kind.name, parameter.name),
                range: parameter.range,
                scale: if *value == 0.0 { 1.0 } else { value.abs() },
            };
            model.push(free, *value);
        }
        if free_onset {
            let free = Free {
                target: Target::Onset(index),
                name: format!("{}.onset_s", term.kind.name),
                range: Range::Between(0.0, duration_s),
                scale: duration_s,
            };
            model.push(free, term.onset_s);
        }
        model.nominal.physics.push(term.clone());
        model
    }

    /// The same at its point without one of its terms.
    #[must_use]
    pub fn without_term(&self, gone: usize) -> Self {
        let mut model = self.clone();
        if gone >= model.nominal.physics.len() {
            return model;
        }
        model.nominal.physics.remove(gone);
        let of_gone = |target: Target| matches!(target, Target::Term { term, .. } | Target::Onset(term) if term == gone);
        let earlier = |term: usize| if term > gone { term - 1 } else { term };
        let kept = self.free.iter().zip(&self.x).filter(|(free, _)| !of_gone(free.target));
        (model.free, model.x) = kept
            .map(|(free, x)| {
                let mut free = free.clone();
                match &mut free.target {
                    Target::Term { term, .. } | Target::Onset(term) => *term = earlier(*term),
                    Target::Plant(_) | Target::State(_) | Target::Before => {}
                }
                (free, *x)
            })
            .unzip();
        model
    }

    /// The same with the plant in the middle and at either end of the gap between it and its sensor, of which a recording's start says nothing;
    /// the model alone where there is none.
    pub fn across_the_gap(&self) -> Vec<Self> {
        let physics = &self.nominal.physics;
        let Some(gap) = physics.iter().find_map(|term| term.kind.gap(&term.parameters)) else {
            return vec![self.clone()];
        };
        let moved = |part: f64| {
            let mut model = self.clone();
            if let Some(position) = model.start.state.as_mut().and_then(|state| state.first_mut()) {
                *position += part * gap;
            }
            model
        };
        [0.0, -0.5, 0.5].into_iter().map(moved).collect()
    }

    /// The same with the start held at where it is.
    #[must_use]
    pub fn start_held(&self) -> Self {
        let mut model = self.clone();
        if let Some((_, start)) = self.loop_at(&self.x) {
            model.start = start;
            let kept = self.free.iter().zip(&self.x).filter(|(free, _)| !free.target.is_start());
            (model.free, model.x) = kept.map(|(free, x)| (free.clone(), *x)).unzip();
        }
        model
    }

    /// The same with one number held at where it is.
    #[must_use]
    pub fn held(&self, target: Target) -> Self {
        let mut model = self.clone();
        if let (Some(at), Some((point, _))) =
            (self.free.iter().position(|free| free.target == target), self.loop_at(&self.x))
        {
            match target {
                // The others stay free, so that only this one moves to where it is held.
                Target::Plant(index) => {
                    let mut numbers: Vec<f64> =
                        plant_numbers(&self.nominal.plant).into_iter().map(|(_, value, _)| value).collect();
                    let there = plant_numbers(&point.plant).get(index).map(|(_, value, _)| *value);
                    if let (Some(slot), Some(value)) = (numbers.get_mut(index), there) {
                        *slot = value;
                    }
                    model.nominal.plant = with_plant_numbers(&self.nominal.plant, &numbers);
                }
                Target::Term { .. } | Target::Onset(_) => model.nominal.physics = point.physics,
                Target::State(_) | Target::Before => return model,
            }
            model.free.remove(at);
            model.x.remove(at);
        }
        model
    }

    /// Number of free parameters without those of the starting state.
    pub fn physical(&self) -> usize {
        let numbers = self.free.iter().filter(|f| !f.target.is_start()).count();
        // Each edge of a span is a number that was found as well.
        numbers + self.nominal.physics.iter().map(|term| 2 * term.spans.len()).sum::<usize>()
    }

    /// The loop and the start at x; `None` where a value is out of its range.
    pub fn loop_at(&self, x: &[f64]) -> Option<(Loop, Start)> {
        let mut model = self.nominal.clone();
        let mut start = self.start.clone();
        let mut plant: Vec<f64> =
            plant_numbers(&model.plant).into_iter().map(|(_, value, _)| value).collect();
        for (free, value) in self.free.iter().zip(x) {
            if !free.range.allows(*value) {
                return None;
            }
            match free.target {
                Target::Plant(i) => *plant.get_mut(i)? = *value,
                Target::Term { term, parameter } => {
                    *model.physics.get_mut(term)?.parameters.get_mut(parameter)? = *value;
                }
                Target::Onset(term) => model.physics.get_mut(term)?.onset_s = *value,
                Target::Before => start.u = *value,
                Target::State(i) => *start.state.as_mut()?.get_mut(i)? = *value,
            }
        }
        model.plant = with_plant_numbers(&model.plant, &plant);
        Some((model, start))
    }

    /// y as predicted from the recorded u, at x; `None` where x is impossible or the prediction diverges.
    pub fn predict(&self, x: &[f64], signals: &Signals) -> Option<Vec<f64>> {
        self.predict_with(x, signals, self.substeps)
    }

    /// The same with another number of sub-steps where terms act along the way.
    pub fn predict_with(&self, x: &[f64], signals: &Signals, substeps: usize) -> Option<Vec<f64>> {
        let (model, start) = self.loop_at(x)?;
        let model = part_time::of(model, signals.origin_s);
        let mut simulation = Simulation::with_substeps(&model, 0, substeps).ok()?;
        simulation.start(&start).ok()?;
        let mut now = vec![0.0; signals.inputs.len()];
        let gains = observer::gains(&self.nominal.plant, signals.sample_time_s);
        let mut predicted = Vec::with_capacity(signals.len());
        for (n, (u, y)) in signals.u.iter().zip(&signals.y).enumerate() {
            signals.inputs_at(n, &mut now);
            let step = simulation.replay_step(*u, &now).y;
            predicted.push(step);
            if !gains.is_empty() && y.is_finite() {
                let error = y - step;
                simulation.correct(gains.iter().map(|gain| gain * error));
            }
        }
        // A diverging run stays diverged: the last sample tells.
        predicted.last().is_some_and(|y| y.is_finite()).then_some(predicted)
    }

    /// Measured less predicted y; 0 where y is missing.
    pub fn residual(&self, x: &[f64], signals: &Signals) -> Option<Vec<f64>> {
        let mut residual = self.predict(x, signals)?;
        for (value, y) in residual.iter_mut().zip(&signals.y) {
            *value = if y.is_finite() { y - *value } else { 0.0 };
        }
        residual.iter().all(|e| e.is_finite()).then_some(residual)
    }
}
