//! The straight path: a linear plant that takes one exact step a sample, and nothing that acts on the loop besides its law: no terms,
//! no noise, no measured inputs, no part of a sample of dead time. Operation by operation it is what the general path does, down to
//! the zeros that are added, so its numbers are the same to the last bit; what the general path asks at each sample, it asks once.

use super::body::Body;
use super::direct::Direct;
use super::exact::Exact;
use super::{Simulation, Step, Trace};
use crate::controller::{Controller, Law};

/// The sum of no terms: adding it changes nothing, subtracting it makes a zero of either sign positive.
const NOTHING: f64 = -0.0;

impl Simulation {
    /// Whether the loop is such a one from this sample on.
    #[inline]
    pub(super) fn is_straight(&self) -> bool {
        self.is_plain && self.next_change == self.changes.len()
    }

    /// Whether terms, inputs, noise and plant leave nothing but the law and exact steps, once the numbers have been set.
    pub(super) fn is_plain(&self) -> bool {
        let is_exact = !matches!(self.body, Body::Linear(_) | Body::Servo(_) | Body::Tank(_));
        let parts = self.changes.iter().all(|change| change.part == 0.0 && change.sensor_noise == 0.0);
        is_exact && parts && self.terms.is_empty() && self.inputs.is_empty()
    }

    /// What is added to the plant's drive.
    #[inline]
    fn rest(&self) -> f64 {
        self.drive_offset - NOTHING - NOTHING
    }

    /// The law of the shortest path, where these numbers of the loop allow it.
    pub(super) fn find_direct(&self) -> Option<Direct> {
        let shows_its_first_state = match &self.body {
            Body::One(plant) => plant.shows_its_first_state(),
            Body::Two(plant) => plant.shows_its_first_state(),
            Body::Three(plant) => plant.shows_its_first_state(),
            Body::Four(plant) => plant.shows_its_first_state(),
            // Of a larger plant the law is the smaller part.
            _ => false,
        };
        #[expect(clippy::float_cmp, reason = "only these very numbers change nothing")]
        let is_driven_by_u = self.drive_gain == 1.0 && self.rest() == 0.0 && self.line.is_short();
        if !(self.is_straight() && shows_its_first_state && is_driven_by_u) {
            return None;
        }
        Direct::of(&self.law, self.sample_time_s)
    }

    /// One sample by the shortest path, where the loop is the paper's or like it; `None` at a sample that leaves the path.
    #[inline]
    pub(super) fn direct_step(&mut self, r: f64) -> Option<Step> {
        let direct = self.direct?;
        let step = match &mut self.body {
            Body::One(plant) => direct_step_of(&direct, plant, &mut self.law, r),
            Body::Two(plant) => direct_step_of(&direct, plant, &mut self.law, r),
            Body::Three(plant) => direct_step_of(&direct, plant, &mut self.law, r),
            Body::Four(plant) => direct_step_of(&direct, plant, &mut self.law, r),
            _ => None,
        }?;
        self.held_drive = step.drive;
        self.tick += 1;
        Some(step)
    }

    /// One sample in closed loop.
    pub(super) fn straight_step(&mut self, r: f64) -> Step {
        let y = self.body.output(self.held_drive);
        let u = self.law.step(r, y);
        let w = if self.line.is_short() { u } else { self.line.push(u).1 };
        self.held_drive = self.drive_gain * w + self.rest();
        self.body.advance_exact(self.held_drive);
        self.tick += 1;
        Step { y, u, true_y: y, drive: self.held_drive }
    }

    /// The whole run over a reference; up to the first sample that is not finite.
    pub(super) fn straight_run(&mut self, reference: &[f64], trace: &mut Trace) {
        match self.body.clone() {
            Body::One(plant) => self.straight_run_of(plant, reference, trace),
            Body::Two(plant) => self.straight_run_of(plant, reference, trace),
            Body::Three(plant) => self.straight_run_of(plant, reference, trace),
            Body::Four(plant) => self.straight_run_of(plant, reference, trace),
            Body::Eight(plant) => self.straight_run_of(*plant, reference, trace),
            Body::Sixteen(plant) => self.straight_run_of(*plant, reference, trace),
            Body::Linear(_) | Body::Servo(_) | Body::Tank(_) => {}
        }
    }

    fn straight_run_of<const N: usize>(&mut self, plant: Exact<N>, reference: &[f64], trace: &mut Trace) {
        let run = Run { gain: self.drive_gain, rest: self.rest(), held: self.held_drive };
        let mut law = self.law.clone();
        if let Some(direct) = self.direct {
            return run.directly_over(plant, &direct, law, reference, trace);
        }
        if !self.line.is_short() {
            let line = &mut self.line;
            return run.over(plant, reference, trace, |r, y| law.step(r, y), |u| line.push(u).1);
        }
        // The commonest law by itself, so that its memory stays in a register.
        if let (Controller::Pi(pi), ratio) = law.stated() {
            let mut integrator = law.integrator();
            let sample_time_s = self.sample_time_s;
            let step = |r: f64, y: f64| pi.step(r - y, sample_time_s, ratio, &mut integrator);
            return run.over(plant, reference, trace, step, |u| u);
        }
        run.over(plant, reference, trace, |r, y| law.step(r, y), |u| u);
    }
}

/// What stays the same over a run, and the drive held before it.
struct Run {
    gain: f64,
    rest: f64,
    held: f64,
}

#[inline(always)]
fn direct_step_of<const N: usize>(
    direct: &Direct,
    plant: &mut Exact<N>,
    law: &mut Law,
    r: f64,
) -> Option<Step> {
    let sampled = direct.sample(plant, &plant.x, law.integrator(), r)?;
    plant.x = sampled.x;
    law.went_on(sampled.y, sampled.integrator);
    let (y, u) = (sampled.y, sampled.u);
    Some(Step { y, u, true_y: y, drive: u })
}

impl Run {
    /// By the shortest path, where it can be taken.
    fn directly_over<const N: usize>(
        self,
        mut plant: Exact<N>,
        direct: &Direct,
        mut law: Law,
        reference: &[f64],
        trace: &mut Trace,
    ) {
        let (mut x, mut integrator, mut held) = (plant.x, law.integrator(), self.held);
        let room = trace.y.iter_mut().zip(&mut trace.u);
        for ((shown, put_out), r) in room.zip(reference) {
            if let Some(sampled) = direct.sample(&plant, &x, integrator, *r) {
                (*shown, *put_out) = (sampled.y, sampled.u);
                (x, integrator, held) = (sampled.x, sampled.integrator, sampled.u);
                law.went_on(sampled.y, integrator);
                continue;
            }
            plant.x = x;
            (*shown, *put_out) = self.straight_sample(&mut plant, &mut law, &mut held, *r);
            (x, integrator) = (plant.x, law.integrator());
        }
    }

    /// One sample that the shortest path leaves.
    #[cold]
    #[inline(never)]
    fn straight_sample<const N: usize>(
        &self,
        plant: &mut Exact<N>,
        law: &mut Law,
        held: &mut f64,
        r: f64,
    ) -> (f64, f64) {
        let y = plant.output(*held);
        let u = law.step(r, y);
        *held = self.gain * u + self.rest;
        plant.advance(*held, *held);
        (y, u)
    }

    #[inline]
    fn over<const N: usize>(
        self,
        mut plant: Exact<N>,
        reference: &[f64],
        trace: &mut Trace,
        mut law: impl FnMut(f64, f64) -> f64,
        mut delayed: impl FnMut(f64) -> f64,
    ) {
        let mut held = self.held;
        let room = trace.y.iter_mut().zip(&mut trace.u);
        for ((shown, put_out), r) in room.zip(reference) {
            let y = plant.output(held);
            let u = law(*r, y);
            (*shown, *put_out) = (y, u);
            held = self.gain * delayed(u) + self.rest;
            plant.advance(held, held);
        }
    }
}
