//! The sampled loop. At each sample n, `t = n*Ts`:
//!
//! 1. the true y is taken just before u changes, then the sensor's terms, its own noise and measured sensor inputs
//!    make the measured y of it;
//! 2. the control law turns r and y into u (controller terms change it);
//! 3. measured actuator inputs are added, the actuator's terms follow in the order of the loop's list, then the
//!    dead time; that value is held until the next sample;
//! 4. the plant moves on by Ts.
//!
//! Linear plants take one exact step a sample, also for a dead time that is not a multiple of Ts. Where a term acts
//! along the way (lags, forces that depend on position or speed, varying friction), the sample is cut into
//! [`SUBSTEPS`]; see `linear`, `servo` and `tank` for what is exact there. Dry friction that depends on the direction
//! alone is exact without. Loads that change with time act by their value at the middle of the step.

pub(crate) mod batch;
mod body;
mod delay_line;
mod direct;
mod driving;
mod exact;
mod law;
mod linear;
mod observed;
mod servo;
mod start;
mod straight;
mod tank;
mod terms;

pub use driving::{DEFAULT_SAMPLES, Driving, Row, samples, samples_within, time_s};
pub use law::replay_law;
pub use observed::{Corrects, Observer};
pub use start::Start;
pub(crate) use start::median;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::control_loop::Loop;
use crate::controller::Law;
use crate::measured_input::{Enters, Input};
use crate::physics::Numbers;
use crate::plant::Plant;
use crate::sentences::typed;
use crate::{Error, Result};
use body::{Body, Sample};
use delay_line::DelayLine;
use direct::Direct;
use terms::Terms;

/// Sub-steps of a sample where a term acts along the way.
pub const SUBSTEPS: usize = 4;

/// The longest dead time, in samples.
const LONGEST_DELAY: f64 = 1e6;

/// One sample of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// What the sensor shows.
    pub y: f64,
    /// What the controller puts out.
    pub u: f64,
    /// y as it is.
    pub true_y: f64,
    /// The plant's drive at the end of the sample, before forces that depend on the motion, in the drive's unit.
    pub drive: f64,
}

/// Where each measured input enters, and what of it.
type Inputs = Vec<(Enters, f64)>;

/// What the measured inputs are worth at a place.
#[inline]
fn entering(list: &Inputs, place: Enters, values: &[f64]) -> f64 {
    let here = list.iter().zip(values).filter(|((enters, _), _)| *enters == place);
    here.map(|((_, gain), value)| gain * value).sum()
}

/// What happens to the loop's numbers at a tick.
#[derive(Clone)]
struct Change {
    tick: u64,
    law_ratio: f64,
    sensor_noise: f64,
    whole: usize,
    part: f64,
    body: Body,
}

/// A loop at work: streaming, without allocation per step. The same loop, seed and input give the same bytes on
/// every machine.
#[derive(Clone)]
pub struct Simulation {
    sample_time_s: f64,
    substeps: usize,
    tick: u64,
    law: Law,
    terms: Terms,
    inputs: Inputs,
    line: DelayLine,
    body: Body,
    drive_gain: f64,
    drive_offset: f64,
    held_drive: f64,
    sensor_noise: f64,
    noise: ChaCha8Rng,
    changes: Vec<Change>,
    next_change: usize,
    /// Whether nothing acts besides the law ([`straight`]).
    is_plain: bool,
    /// The law, where the loop is of the kind that takes the shortest path ([`direct`]).
    direct: Option<Direct>,
    /// The last sample that did not take it. By value it would be returned in memory, and so would those that did: a caller that reads y and u together would
    /// wait for two stores.
    left: Step,
    model: Loop,
}

impl Simulation {
    /// The loop at rest ([`Start::rest`]), before its first sample. Noise follows from `seed`: each term has its own
    /// stream, named after its kind, so that adding a term does not change the noise of another.
    ///
    /// # Errors
    /// A term is unsound or can't act on the plant, the plant is still to be identified, or its numbers are beyond
    /// what can be computed.
    pub fn new(model: &Loop, seed: u64) -> Result<Self> {
        Self::with_substeps(model, seed, SUBSTEPS)
    }

    /// The same with another number of sub-steps (at least 1), to see what they cost in accuracy.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn with_substeps(model: &Loop, seed: u64, substeps: usize) -> Result<Self> {
        model.check()?;
        model.inputs.iter().try_for_each(Input::check)?;
        if !(model.sample_time_s > 0.0 && model.sample_time_s.is_finite()) {
            return Err(Error::new(format!("sample_time_s = {}", typed(model.sample_time_s)))
                .allowed("a finite number > 0"));
        }
        model.plant.linear()?;
        let mut terms = Terms::new(model, seed, model.sample_time_s / substeps.max(1) as f64);
        let stepwise = terms.need_substeps() || matches!(model.plant, Plant::Tank(_));
        let within_sample = |tick: &u64| {
            let numbers = terms.numbers(*tick, nominal(model));
            delay_line::split(numbers.delay_s, model.sample_time_s).1 > 0.0
        };
        // Friction alone is exact over a whole sample; with a drive that changes within it, it is not.
        let unsteady = terms.has_load() || terms.changes().iter().any(within_sample);
        let stepwise = stepwise || (terms.has_friction() && unsteady);
        let substeps = if stepwise { substeps.max(1) } else { 1 };
        if substeps == 1 {
            terms = Terms::new(model, seed, model.sample_time_s);
        }
        let changes = changes(model, &terms, substeps)?;
        let longest = changes.iter().map(|change| change.whole).max().unwrap_or(0);
        let Some(first) = changes.first().cloned() else { return Err(Error::new("the loop has no numbers")) };
        let mut simulation = Self {
            sample_time_s: model.sample_time_s,
            substeps,
            tick: 0,
            law: Law::new(&model.controller, model.sample_time_s),
            terms,
            inputs: model.inputs.iter().map(|input| (input.enters, input.gain.value())).collect(),
            line: DelayLine::new(longest),
            body: first.body,
            drive_gain: model.plant.drive_gain(),
            drive_offset: model.plant.drive_offset(),
            held_drive: 0.0,
            sensor_noise: model.sensor.noise,
            noise: ChaCha8Rng::seed_from_u64(seed),
            changes,
            next_change: 0,
            is_plain: false,
            direct: None,
            left: Step { y: 0.0, u: 0.0, true_y: 0.0, drive: 0.0 },
            model: model.clone(),
        };
        simulation.is_plain = simulation.is_plain();
        simulation.start(&Start::rest(model))?;
        Ok(simulation)
    }

    /// Puts the loop, before its first step, at an operating point.
    ///
    /// # Errors
    /// The state in full has another length than the plant's.
    pub fn start(&mut self, start: &Start) -> Result<()> {
        let state = start.state_for(&self.model)?;
        let order = self.model.plant.linear()?.map_or(1, |linear| linear.order());
        if state.len() != order {
            return Err(Error::new(format!("a starting state of {} numbers", state.len()))
                .allowed(format!("the plant has {order}")));
        }
        for (slot, value) in self.body.state_mut().iter_mut().zip(&state) {
            *slot = *value;
        }
        // What was held has passed the actuator: a hidden limit, say. The terms themselves begin with the first sample.
        let held = self.terms.clone().actuator(0, 0.0, start.u);
        self.line.fill(held);
        self.held_drive = self.drive_gain * held + self.drive_offset;
        self.law.start(start.integrator, start.y, start.velocity, start.u);
        self.terms.shows(start.y);
        Ok(())
    }

    /// One sample in closed loop: r and the measured inputs in the order of the loop's list (missing ones count as
    /// zero). A recorded controller holds the u that it was started with.
    #[inline]
    pub fn step(&mut self, r: f64, inputs: &[f64]) -> Step {
        if let Some(step) = self.direct_step(r) {
            return step;
        }
        self.longer_step(r, inputs);
        self.left
    }

    // Apart: the shortest path would save registers that only this one needs.
    #[inline(never)]
    fn longer_step(&mut self, r: f64, inputs: &[f64]) {
        self.left = if self.is_straight() { self.straight_step(r) } else { self.general_step(r, inputs) };
    }

    fn general_step(&mut self, r: f64, inputs: &[f64]) -> Step {
        self.change();
        let (true_y, y) = self.measure(inputs);
        let law = self.law.step(r, y);
        let u = self.terms.command(self.tick, law);
        self.advance(u, inputs);
        Step { y, u, true_y, drive: self.held_drive }
    }

    /// One sample with the controller's output as recorded: actuator, plant and sensor follow it.
    #[inline]
    pub fn replay_step(&mut self, u: f64, inputs: &[f64]) -> Step {
        self.change();
        let (true_y, y) = self.measure(inputs);
        self.advance(u, inputs);
        Step { y, u, true_y, drive: self.held_drive }
    }

    /// The same, the law running along on what was measured.
    pub fn follow(&mut self, r: f64, measured: f64, u: f64, inputs: &[f64]) -> Step {
        self.change();
        let (true_y, y) = self.measure(inputs);
        let law = self.law.step(r, measured);
        self.terms.command(self.tick, law);
        self.advance(u, inputs);
        Step { y, u, true_y, drive: self.held_drive }
    }

    /// The plant's state before the next sample: a servo's position and speed, a tank's level, or the states of the
    /// linear model (followed by zeros where it has between 4 and 16).
    pub fn state(&self) -> &[f64] {
        self.body.state()
    }

    /// Corrects the state, as an observer does: these are added to it, and what the sensor shows moves along.
    #[inline]
    pub fn correct(&mut self, by: impl Iterator<Item = f64>) {
        let before = self.body.output(self.held_drive);
        for (state, by) in self.body.state_mut().iter_mut().zip(by) {
            *state += by;
        }
        let after = self.body.output(self.held_drive);
        self.terms.correct(after - before, None);
    }

    /// The controller's integrator, in the unit of u.
    pub fn integrator(&self) -> f64 {
        self.law.integrator()
    }

    /// The time of the next sample, in seconds.
    pub fn time_s(&self) -> f64 {
        self.tick as f64 * self.sample_time_s
    }

    #[inline]
    fn change(&mut self) {
        if self.changes.get(self.next_change).is_some_and(|change| change.tick <= self.tick) {
            self.apply_change();
        }
    }

    #[cold]
    fn apply_change(&mut self) {
        let Some(change) = self.changes.get_mut(self.next_change) else { return };
        self.next_change += 1;
        self.law.set_ratio(change.law_ratio);
        self.line.set(change.whole, change.part);
        self.sensor_noise = change.sensor_noise;
        change.body.goes_on_from(&self.body);
        std::mem::swap(&mut self.body, &mut change.body);
        self.direct = self.find_direct();
    }

    #[inline]
    fn measure(&mut self, inputs: &[f64]) -> (f64, f64) {
        let t = self.time_s();
        let true_y = self.body.output(self.held_drive);
        let mut y = self.terms.sense(self.tick, t, true_y);
        if self.sensor_noise > 0.0 {
            let normal: f64 = StandardNormal.sample(&mut self.noise);
            y += self.sensor_noise * normal;
        }
        y += entering(&self.inputs, Enters::Sensor, inputs);
        (true_y, self.terms.sensor(self.tick, t, y))
    }

    #[inline]
    fn advance(&mut self, u: f64, inputs: &[f64]) {
        let t = self.time_s();
        let w = self.terms.actuator(self.tick, t, u + entering(&self.inputs, Enters::Actuator, inputs));
        let (older, newer) = self.line.push(w);
        let offset = self.drive_offset - entering(&self.inputs, Enters::Load, inputs);
        let (tick, part, gain) = (self.tick, self.line.part, self.drive_gain);
        let sample = Sample { tick, t, older, newer, part, gain, offset };
        self.held_drive = self.body.advance(&sample, &mut self.terms, self.sample_time_s, self.substeps);
        self.tick += 1;
    }
}

/// The loop's numbers before any term.
fn nominal(model: &Loop) -> Numbers {
    let (inertia, viscous) = match &model.plant {
        Plant::Servo(servo) => (servo.inertia, servo.viscous),
        _ => (1.0, 0.0),
    };
    let delay_s = model.plant.delay_s();
    Numbers { inertia, viscous, law_ratio: 1.0, delay_s, sensor_noise: model.sensor.noise }
}

/// All that will happen to the loop's numbers, prepared, so that a step neither allocates nor fails.
fn changes(model: &Loop, terms: &Terms, substeps: usize) -> Result<Vec<Change>> {
    let prepare = |tick: u64| {
        let numbers = terms.numbers(tick, nominal(model));
        let (whole, part) = delay_line::split(numbers.delay_s, model.sample_time_s);
        if whole > LONGEST_DELAY {
            return Err(Error::new(format!("the dead time is {} s", typed(numbers.delay_s))).allowed(
                format!(
                    "up to {} s, which are {} samples, are allowed",
                    typed(LONGEST_DELAY * model.sample_time_s),
                    typed(LONGEST_DELAY)
                ),
            ));
        }
        let body = Body::new(model, terms, &numbers, part, substeps)?;
        let Numbers { law_ratio, sensor_noise, .. } = numbers;
        Ok(Change { tick, law_ratio, sensor_noise, whole: whole as usize, part, body })
    };
    terms.changes().into_iter().map(prepare).collect()
}

/// A whole run, one value a sample, all of the reference's length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    /// What the sensor shows.
    pub y: Vec<f64>,
    /// What the controller puts out.
    pub u: Vec<f64>,
    /// y as it is.
    pub true_y: Vec<f64>,
}

/// Runs a loop in closed loop over a reference; `inputs` holds one column for each of the loop's inputs, in their
/// order; `start` is rest where none is given.
///
/// # Errors
/// As [`Simulation::new`]; the controller is only recorded; columns of another length; or the loop diverges.
pub fn simulate(
    model: &Loop,
    reference: &[f64],
    inputs: &[Vec<f64>],
    seed: u64,
    start: Option<&Start>,
) -> Result<Trace> {
    if !model.has_law() {
        return Err(Error::new("controller kind 'recorded' has no law to close the loop with")
            .allowed("pi, pid, p-velocity; or give a recording with its u"));
    }
    let mut simulation = started(model, reference, inputs, seed, start)?;
    simulation.change();
    if simulation.is_straight() {
        return straight(model, simulation, reference);
    }
    run(model, simulation, reference, inputs, |simulation, r, now| simulation.step(r, now))
}

fn straight(model: &Loop, mut simulation: Simulation, reference: &[f64]) -> Result<Trace> {
    let mut trace =
        Trace { y: vec![0.0; reference.len()], u: vec![0.0; reference.len()], true_y: Vec::new() };
    simulation.straight_run(reference, &mut trace);
    let is_finite = |(y, u): (&f64, &f64)| y.is_finite() && u.is_finite();
    if let Some(n) = trace.y.iter().zip(&trace.u).position(|row| !is_finite(row)) {
        return Err(diverged(n as f64 * model.sample_time_s));
    }
    trace.true_y = trace.y.clone();
    Ok(trace)
}

/// Runs actuator, plant and sensor behind a recorded u; otherwise as [`simulate`].
///
/// # Errors
/// As [`Simulation::new`]; columns of another length; or the plant diverges.
pub fn replay(
    model: &Loop,
    u: &[f64],
    inputs: &[Vec<f64>],
    seed: u64,
    start: Option<&Start>,
) -> Result<Trace> {
    let simulation = started(model, u, inputs, seed, start)?;
    run(model, simulation, u, inputs, |simulation, u, now| simulation.replay_step(u, now))
}

/// What leaves the actuator's terms under a recorded u.
pub fn actuated(model: &Loop, u: &[f64]) -> Vec<f64> {
    let mut terms = Terms::new(model, 0, model.sample_time_s);
    let mut leaving = u.to_vec();
    terms.actuator_over(model.sample_time_s, &mut leaving);
    leaving
}

/// The loop before the first sample of a run that these drive.
fn started(
    model: &Loop,
    driving: &[f64],
    inputs: &[Vec<f64>],
    seed: u64,
    start: Option<&Start>,
) -> Result<Simulation> {
    let wanted = model.inputs.len();
    if inputs.len() != wanted || inputs.iter().any(|column| column.len() != driving.len()) {
        return Err(Error::new("the inputs don't fit the loop")
            .allowed(format!("{wanted} columns of {} rows", driving.len())));
    }
    let mut simulation = Simulation::new(model, seed)?;
    if let Some(start) = start {
        simulation.start(start)?;
    }
    Ok(simulation)
}

fn run(
    model: &Loop,
    mut simulation: Simulation,
    driving: &[f64],
    inputs: &[Vec<f64>],
    step: impl Fn(&mut Simulation, f64, &[f64]) -> Step,
) -> Result<Trace> {
    let (mut y, mut u, mut true_y) = (Vec::new(), Vec::new(), Vec::new());
    for column in [&mut y, &mut u, &mut true_y] {
        column.reserve_exact(driving.len());
    }
    let mut now = vec![0.0; inputs.len()];
    for (n, driving) in driving.iter().enumerate() {
        for (value, column) in now.iter_mut().zip(inputs) {
            *value = column.get(n).copied().unwrap_or(0.0);
        }
        let step = step(&mut simulation, *driving, &now);
        if !(step.y.is_finite() && step.u.is_finite()) {
            return Err(diverged(n as f64 * model.sample_time_s));
        }
        y.push(step.y);
        u.push(step.u);
        true_y.push(step.true_y);
    }
    Ok(Trace { y, u, true_y })
}

/// The error for a run whose numbers are no longer finite.
pub fn diverged(t: f64) -> Error {
    Error::new(format!("the loop diverges: not finite at t = {} s", typed(t)))
        .allowed("a stable loop: check gains, their signs, dead time and sample time")
}

#[cfg(test)]
mod tests;
