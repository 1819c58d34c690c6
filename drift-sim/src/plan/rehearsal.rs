//! The experiment as a loop would answer it if a cause were the one: its closed loop simulated over a reference, with the noise that the recording
//! showed.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::Recorded;
use crate::control_loop::{Loop, Sensor};
use crate::diagnose::cause::Cause;
use crate::estimate::noise::sequence;
use crate::estimate::signals::Signals;
use crate::likelihood_search::conclude::as_file;
use crate::measured_input::{Enters, Input};
use crate::physics::{Starts, Term};
use crate::simulate::{Start, Trace, simulate};

/// What an experiment is rehearsed with.
#[derive(Debug, Clone, Copy)]
pub struct Stage<'a> {
    /// The loop as stated: its law counts.
    pub stated: &'a Loop,
    /// Where the recording left the loop.
    pub recorded: &'a Recorded,
    /// The end of the recording's r that is diagnosed with the experiment; empty where the experiment is enough.
    pub before: &'a [f64],
}

/// Part of the recording for which the loop rests at the present r before an experiment, so that it begins where that cause holds it.
const REST: f64 = 0.25;
/// Samples for that, at least.
const LEAST_REST: usize = 500;

impl Stage<'_> {
    /// A cause's term as what is rehearsed shows it: without the recording before it, it acts from the start; with it, it begins there.
    pub fn term(&self, cause: &Cause) -> Option<Term> {
        let term = cause.term.clone()?;
        let ts = self.stated.sample_time_s;
        let passed = self.recorded.duration_s - self.before.len() as f64 * ts;
        let onset_s = if self.before.is_empty() { 0.0 } else { (term.onset_s - passed).max(0.0) };
        Some(term.from_s(onset_s))
    }

    /// The loop of a cause, after it has rested.
    fn model(&self, cause: &Cause) -> Loop {
        let mut model = as_file(&cause.model, cause.constant_load);
        model.controller = self.stated.controller.clone();
        model.sensor = Sensor::default();
        model.inputs.clear();
        // What acts from the start has acted on the loop at rest.
        let rest_s = self.rest() as f64 * self.stated.sample_time_s;
        let rested = |term: Term| match term.onset_s {
            onset_s if onset_s > 0.0 => term.from_s(rest_s + onset_s),
            _ => term,
        };
        model.physics.extend(self.term(cause).map(rested));
        model
    }

    /// r, y and u of the experiment without noise; `None` where the loop diverges.
    pub fn quiet(&self, cause: &Cause, r: &[f64]) -> Option<Signals> {
        let run = self.run(&self.model(cause), &[], r)?;
        Some(run.part(self.before.len(), run.len()))
    }

    /// r, y and u of what is diagnosed, with the cause's noise drawn from `seed`, or with the opposite of that noise: the two together tell more than two that are drawn
    /// apart, because what is linear in the noise is gone from their mean.
    pub fn noisy(&self, cause: &Cause, r: &[f64], seed: u64, opposite: bool) -> Option<Signals> {
        let samples = self.rest() + self.before.len() + r.len();
        let sign = if opposite { -1.0 } else { 1.0 };
        let noise = &cause.noise;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let stays = libm::exp(-self.stated.sample_time_s / noise.load_tau_s);
        let load = sequence(samples, sign * noise.load_sd, stays, &mut random);
        let mut sensor = sequence(samples, sign * noise.sensor_sd, noise.sensor_rho, &mut random);
        if let Some(term) = self.term(cause).filter(|term| matches!(term.kind.search, Starts::NoiseChange)) {
            let ratio = term.parameters.first().copied().unwrap_or(1.0);
            let onset = (term.onset_s / self.stated.sample_time_s) as usize;
            sensor.iter_mut().skip(self.rest() + onset).for_each(|noise| *noise *= ratio);
        }
        let mut model = self.model(cause);
        model.inputs.extend([Enters::Load, Enters::Sensor].map(Input::made));
        self.run(&model, &[load, sensor], r)
    }

    fn rest(&self) -> usize {
        let samples = REST * self.recorded.duration_s / self.stated.sample_time_s;
        (samples as usize).max(LEAST_REST)
    }

    /// Rests, then follows what r was before the experiment, then the reference; what is handed back begins after the rest.
    fn run(&self, model: &Loop, inputs: &[Vec<f64>], r: &[f64]) -> Option<Signals> {
        let rest = self.rest();
        let asked = [self.before, r].concat();
        let first = asked.first().copied()?;
        let mut whole = vec![first; rest];
        whole.extend_from_slice(&asked);
        let start = Start::held(first, self.recorded.u);
        let Trace { y, u, .. } = simulate(model, &whole, inputs, 0, Some(&start)).ok()?;
        let part = |column: Vec<f64>| column.get(rest..).unwrap_or(&[]).to_vec();
        Some(Signals {
            sample_time_s: model.sample_time_s,
            start_s: 0.0,
            origin_s: 0.0,
            r: asked,
            y: part(y),
            u: part(u),
            inputs: Vec::new(),
        })
    }
}
