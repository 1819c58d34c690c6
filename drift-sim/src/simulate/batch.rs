//! What a filter needs to run a linear plant by itself, several points of a fit side by side: the plant's steps, and all that reaches it under a
//! recorded u (actuator, dead time, loads), worked out once.

use super::body::Body;
use super::exact::Exact;
use super::servo::{Acting, ServoBody};
use super::terms::place;
use super::{Change, Inputs, Simulation, entering};
use crate::measured_input::Enters;
use crate::physics::{Motion, Term};
use crate::plant::Output;

/// What reaches a plant, sample by sample, but for what a filter adds.
#[derive(Debug, Clone, Default)]
pub struct Driven {
    /// What leaves the dead time over each sample, in the unit of u: the older value, then the newer. Of a plant that is stepped along the way twice the
    /// mean over the sample, behind the terms that act there.
    pub held: Vec<(f64, f64)>,
    /// Load of the terms and the measured inputs; empty where there is none.
    pub load: Vec<f64>,
    /// What measured inputs add at the sensor; empty where there are none.
    pub at_sensor: Vec<f64>,
}

/// What decides what reaches a plant under a recorded u: the terms on the way to it, the measured inputs, what is held before the first sample, the
/// dead times, each from some sample on, and whether the plant takes the mean over a sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Reached {
    terms: Vec<Term>,
    inputs: Inputs,
    before: u64,
    dead_times: Vec<(u64, usize, u64)>,
    is_mean: bool,
}

/// One step of a linear plant of N states: `x <- phi x + older o + newer w` for drives o and w, y of it before, and dy/dt.
#[derive(Debug, Clone, Copy)]
pub struct LinearStep<const N: usize> {
    /// States to states.
    pub phi: [[f64; N]; N],
    /// The drive's older value to states, and its newer one.
    pub older: [f64; N],
    /// The newer one.
    pub newer: [f64; N],
    /// States to y, and the drive to y.
    pub c: [f64; N],
    /// The drive to y.
    pub d: f64,
    /// States to dy/dt, and the drive to dy/dt.
    pub rate_state: [f64; N],
    /// The drive to dy/dt.
    pub rate_drive: f64,
    /// States to y at the middle of the sample, and the drive to it: where forces are looked at.
    pub middle_state: [f64; N],
    /// The drive to y at the middle.
    pub middle_drive: f64,
}

impl Simulation {
    /// How many states its plant has, where it is linear but for forces and takes one step a sample; at most four.
    pub fn linear_order(&self) -> Option<usize> {
        let order = self.order_of(&self.body)?;
        self.changes.iter().all(|change| self.order_of(&change.body) == Some(order)).then_some(order)
    }

    fn order_of(&self, body: &Body) -> Option<usize> {
        match body {
            Body::One(_) => Some(1),
            Body::Two(_) => Some(2),
            Body::Three(_) => Some(3),
            Body::Four(_) => Some(4),
            Body::Linear(plant) if self.substeps == 1 => Some(plant.x.len()).filter(|n| (1..=4).contains(n)),
            _ => None,
        }
    }

    /// The plant's step from a sample on; `None` where it has another number of states.
    pub fn linear_step<const N: usize>(&self, sample: usize) -> Option<LinearStep<N>> {
        let begun = self.changes.iter().rev().find(|change| change.tick <= sample as u64)?;
        match &begun.body {
            Body::One(plant) => step_of(plant),
            Body::Two(plant) => step_of(plant),
            Body::Three(plant) => step_of(plant),
            Body::Four(plant) => step_of(plant),
            Body::Linear(plant) => plant.step(),
            _ => None,
        }
    }

    /// Samples at which the plant's numbers change, the first of them 0.
    pub fn changes_at(&self) -> impl Iterator<Item = usize> {
        self.changes.iter().map(|change| place(change.tick))
    }

    /// Drive per unit of u, drive besides, and the drive before the first sample.
    pub fn drives(&self) -> (f64, f64, f64) {
        (self.drive_gain, self.drive_offset, self.held_drive)
    }

    /// What decides what reaches the plant under a recorded u.
    pub fn reached_by(&self) -> Reached {
        let physics = |index: &usize| self.model.physics.get(*index).cloned();
        let dead_time = |change: &Change| (change.tick, change.whole, change.part.to_bits());
        Reached {
            terms: self.terms.before_the_plant().iter().filter_map(physics).collect(),
            inputs: self.inputs.clone(),
            before: self.line.first().to_bits(),
            dead_times: self.changes.iter().map(dead_time).collect(),
            is_mean: self.takes_the_mean(),
        }
    }

    /// Whether the plant is stepped along the way.
    fn takes_the_mean(&self) -> bool {
        matches!(self.body, Body::Linear(_) | Body::Servo(_) | Body::Tank(_))
    }

    /// What reaches the plant under a recorded u and the columns of its inputs, from the first sample on; to be asked for once.
    pub fn driven(&mut self, u: &[f64], columns: &[Vec<f64>]) -> Driven {
        let mut driven = Driven::default();
        if self.terms.has_load() || !columns.is_empty() {
            driven.load = self.terms.load_over(self.sample_time_s, u.len());
            self.add_inputs(Enters::Load, columns, &mut driven.load);
        }
        if !columns.is_empty() {
            driven.at_sensor = vec![0.0; u.len()];
            self.add_inputs(Enters::Sensor, columns, &mut driven.at_sensor);
        }
        driven.held = if self.terms.has_actuator() || !columns.is_empty() {
            let mut passed = u.to_vec();
            self.add_inputs(Enters::Actuator, columns, &mut passed);
            self.terms.actuator_over(self.sample_time_s, &mut passed);
            self.delayed(&passed)
        } else {
            self.delayed(u)
        };
        if self.takes_the_mean() {
            self.filter(&mut driven.held);
        }
        driven
    }

    /// What the measured inputs add at a place, from the first sample on.
    fn add_inputs(&self, place: Enters, columns: &[Vec<f64>], sums: &mut [f64]) {
        if columns.is_empty() {
            return;
        }
        let mut now = vec![0.0; columns.len()];
        for (n, sum) in sums.iter_mut().enumerate() {
            for (value, column) in now.iter_mut().zip(columns) {
                *value = column.get(n).copied().unwrap_or(0.0);
            }
            *sum += entering(&self.inputs, place, &now);
        }
    }

    /// What reaches a plant that is stepped along the way over each sample, as its mean, of what leaves the dead time.
    fn filter(&mut self, held: &mut [(f64, f64)]) {
        let mut changes = self.changes.iter().map(|change| (change.tick, change.part)).peekable();
        let mut part = 0.0;
        for (tick, held) in (0..).zip(held) {
            while let Some((_, begun)) = changes.next_if(|(from, _)| *from <= tick) {
                part = begun;
            }
            let (older, newer) = *held;
            let w = self.terms.filter(tick, newer + part * (older - newer));
            *held = (w, w);
        }
    }

    /// What leaves the dead time, the older value and the newer, of what enters it.
    fn delayed(&self, entering: &[f64]) -> Vec<(f64, f64)> {
        let before = self.line.first();
        let mut held = vec![(before, before); entering.len()];
        for (i, change) in self.changes.iter().enumerate() {
            let next = self.changes.get(i + 1).map_or(u64::MAX, |next| next.tick);
            let [from, until] = [change.tick, next].map(|tick| place(tick).min(entering.len()));
            // Until something has passed the dead time, what was before does.
            let mut late = |by: usize, set: fn(&mut (f64, f64), f64)| {
                let first = from.max(by);
                let slots = held.get_mut(first..until).unwrap_or(&mut []);
                let passed = entering.get(first - by..).unwrap_or(&[]);
                slots.iter_mut().zip(passed).for_each(|(slot, value)| set(slot, *value));
            };
            late(change.whole + usize::from(change.part > 0.0), |slot, value| slot.0 = value);
            late(change.whole, |slot, value| slot.1 = value);
        }
        held
    }

    /// Whether terms change what the sensor shows.
    pub fn has_sensor_terms(&self) -> bool {
        self.terms.has_sensor() || self.terms.heeds_corrections()
    }

    /// What the sensor itself makes of y at a sample, before anything is added to it.
    pub fn sensed(&mut self, sample: usize, y: f64) -> f64 {
        let tick = sample as u64;
        self.terms.sense(tick, tick as f64 * self.sample_time_s, y)
    }

    /// Tells the sensor by how much y was corrected, and what it shows where that is known.
    pub fn corrected(&mut self, y_by: f64, shown_by: Option<f64>) {
        self.terms.correct(y_by, shown_by);
    }

    /// What the sensor shows of a y at a sample.
    pub fn shown(&mut self, sample: usize, y: f64) -> f64 {
        let tick = sample as u64;
        self.terms.sensor(tick, tick as f64 * self.sample_time_s, y)
    }
}

/// How a mass moves over a sample from some sample on: `x + way*v + way_of_force*net`, `left*v + speed_of_force*net` under a net
/// force.
#[derive(Debug, Clone, Copy)]
pub struct ServoStep {
    /// What is left of the speed.
    pub left: f64,
    /// Way per speed.
    pub way: f64,
    /// Speed per net force.
    pub speed_of_force: f64,
    /// Way per net force.
    pub way_of_force: f64,
    /// Mass.
    pub inertia: f64,
    /// Viscous friction: force per speed.
    pub viscous: f64,
    /// The sample, in seconds.
    pub h: f64,
    /// Whether y is the position: else it is the speed.
    pub shows_position: bool,
}

/// A mass that is moved one step a sample, by a filter that runs several side by side.
impl Simulation {
    /// Whether its plant is a mass under dry friction or forces, stepped once a sample.
    pub fn is_servo(&self) -> bool {
        self.substeps == 1 && self.changes.iter().all(|change| matches!(change.body, Body::Servo(_)))
    }

    /// The mass from a sample on.
    fn servo(&self, sample: usize) -> Option<&ServoBody> {
        let begun = self.changes.iter().rev().find(|change| change.tick <= sample as u64)?;
        match &begun.body {
            Body::Servo(servo) => Some(servo),
            _ => None,
        }
    }

    /// How it moves from a sample on.
    pub fn servo_step(&self, sample: usize) -> Option<ServoStep> {
        let servo = self.servo(sample)?;
        let (h, inertia, whole) = (self.sample_time_s, servo.inertia, servo.whole);
        Some(ServoStep {
            left: whole.left,
            way: h * whole.first,
            speed_of_force: h * whole.first / inertia,
            way_of_force: h * h * whole.second / inertia,
            inertia,
            viscous: servo.viscous,
            h,
            shows_position: servo.output == Output::Position,
        })
    }

    /// Position and speed a sample later, whatever happens on the way.
    pub fn servo_after(&self, sample: usize, x: [f64; 2], (actuator, outside): (f64, f64)) -> [f64; 2] {
        let Some(mut servo) = self.servo(sample).cloned() else { return [f64::NAN; 2] };
        servo.x = x;
        let tick = sample as u64;
        let force = |motion| self.terms.force(tick, motion);
        let friction =
            |direction, speed, transmitted| self.terms.friction(tick, direction, speed, transmitted);
        servo.substep(&Acting { actuator, outside, force, friction, varying: self.has_varying_forces() });
        servo.x
    }

    /// Samples at which friction or forces begin.
    pub fn forces_begin_at(&self) -> impl Iterator<Item = usize> {
        self.terms.forces_begin_at().map(place)
    }

    /// Whether forces or friction are looked at along the way.
    pub fn has_varying_forces(&self) -> bool {
        self.terms.need_substeps()
    }

    /// Whether a force depends on the motion.
    pub fn has_forces(&self) -> bool {
        self.terms.has_force()
    }

    /// Whether friction depends on more than the direction.
    pub fn has_varying_friction(&self) -> bool {
        self.terms.varying_friction
    }

    /// The forces that depend on the motion at a sample.
    #[inline]
    pub fn force(&self, sample: usize, position: f64, velocity: f64) -> f64 {
        self.terms.force(sample as u64, Motion { position, velocity })
    }

    /// The dry friction that is available at a sample.
    #[inline]
    pub fn friction(&self, sample: usize, direction: f64, speed: f64, transmitted: f64) -> f64 {
        self.terms.friction(sample as u64, direction, speed, transmitted)
    }
}

/// The numbers of a plant of M states, where M is N.
fn step_of<const M: usize, const N: usize>(plant: &Exact<M>) -> Option<LinearStep<N>> {
    let same = |of: &[f64; M]| -> Option<[f64; N]> { of.as_slice().try_into().ok() };
    let mut phi = [[0.0; N]; N];
    for (at, column) in plant.phi.iter().enumerate() {
        for (row, entry) in phi.iter_mut().zip(same(column)?) {
            *row.get_mut(at)? = entry;
        }
    }
    Some(LinearStep {
        phi,
        older: same(&plant.older)?,
        newer: same(&plant.newer)?,
        c: same(&plant.c)?,
        d: plant.d,
        rate_state: same(&plant.rate_state)?,
        rate_drive: plant.rate_drive,
        middle_state: [0.0; N],
        middle_drive: 0.0,
    })
}
