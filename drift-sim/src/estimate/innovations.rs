//! Innovations: the recorded y less its prediction from the recorded u, sample by sample. The prediction is the full simulation, whose
//! plant, load and sensor noise are corrected at each sample by the [gains](super::gains) of its linear part.

use std::ops::Range;

use crate::control_loop::Loop;
use crate::physics::Term;
use crate::simulate::{Corrects, Observer, Simulation, Start};

use super::gains::{Parts, Stretch};
use super::lattice::ROUNDING;
use super::noise::Noise;
use super::rest::Rest;
use super::side_by_side::Gains;
use super::signals::Signals;

/// Sub-steps of a sample where a term acts along the way: each takes forces at its middle, which is enough beside the filter's corrections and
/// costs a quarter of a simulation's.
const SUBSTEPS: usize = 1;

/// The first samples of a recording, which don't count: the filter finds the state there.
pub const SETTLING: usize = 20;

/// A loop as the filter runs it, started; `None` where it can't be simulated. To round what is foretold would lose what y tells between two steps: rounding is part of the noise.
pub fn simulation(model: &Loop, start: &Start) -> Option<Simulation> {
    let mut simulation = match model.physics.iter().any(is_rounding) {
        true => {
            let physics = model.physics.iter().filter(|term| !is_rounding(term)).cloned().collect();
            Simulation::with_substeps(&Loop { physics, ..model.clone() }, 0, SUBSTEPS)
        }
        false => Simulation::with_substeps(model, 0, SUBSTEPS),
    }
    .ok()?;
    simulation.start(start).ok()?;
    Some(simulation)
}

fn is_rounding(term: &Term) -> bool {
    term.kind.name == ROUNDING
}

/// What the filter makes of a recording.
#[derive(Debug, Clone, Default)]
pub struct Innovations {
    /// Innovations over their own deviation, in units of the sensor noise's deviation; 0 where y is missing and in samples that don't count.
    pub scaled: Vec<f64>,
    /// Logarithms of their variances, of that unit squared, one a sample.
    pub log_scales: Vec<f64>,
    /// Sum of the logarithms of their variances.
    pub log_variances: f64,
    /// How many count.
    pub count: usize,
    /// The load that the filter saw, in the drive's unit, one a sample.
    pub load: Vec<f64>,
}

/// What the filter needs besides the loop.
pub struct Filter<'a> {
    /// The loop, with the terms at their numbers; its own sensor noise is left out.
    pub model: &'a Loop,
    /// The noise.
    pub noise: &'a Noise,
    /// The gains.
    pub gains: &'a [Stretch],
    /// Which of the simulation's states is the first of the linear part.
    pub first_state: usize,
    /// How much later than the simulation the recording shows y, in seconds: less than a sample, and of either sign.
    pub late_s: f64,
    /// Deviation of the sensor's noise to which innovations are scaled.
    pub unit: f64,
    /// A load that stays, in the drive's unit.
    pub constant_load: f64,
}

impl Filter<'_> {
    /// Runs over the first samples of a recording, of which those in `counted` count; `None` where the loop can't be simulated or diverges. `in_detail` keeps load and variances of each sample.
    pub fn run(
        &self,
        signals: &Signals,
        start: &Start,
        counted: Range<usize>,
        in_detail: bool,
    ) -> Option<Innovations> {
        let mut simulation = simulation(self.model, start)?;
        let samples = counted.end.min(signals.len());
        let ts = signals.sample_time_s;
        let mut run = Run {
            filter: self,
            signals,
            phi: self.noise.load_phi(ts),
            per_unit: 1.0 / self.unit,
            load: 0.0,
            sensor: 0.0,
            inputs: vec![0.0; signals.inputs.len()],
            stretch: self.gains.first()?,
            rest: Rest::new(1.0 / self.unit),
            at_rest: [0.0; 2],
            later: self.gains.get(1..)?,
            in_detail,
            counts_from: counted.start.max(SETTLING),
            out: Innovations { scaled: Vec::with_capacity(samples), ..Innovations::default() },
        };
        simulation.observe(0..samples, self.first_state, &mut run);
        // A diverging run stays diverged: the last sample tells.
        run.out.scaled.last().is_some_and(|e| e.is_finite()).then_some(run.out)
    }
}

/// The filter at work on a recording.
struct Run<'a> {
    filter: &'a Filter<'a>,
    signals: &'a Signals,
    phi: f64,
    per_unit: f64,
    load: f64,
    sensor: f64,
    inputs: Vec<f64>,
    stretch: &'a Stretch,
    rest: Rest<f64>,
    at_rest: [f64; 2],
    later: &'a [Stretch],
    in_detail: bool,
    counts_from: usize,
    out: Innovations,
}

impl Observer for Run<'_> {
    #[inline]
    fn inputs(&mut self, n: usize) -> &[f64] {
        if !self.inputs.is_empty() {
            self.signals.inputs_at(n, &mut self.inputs);
        }
        &self.inputs
    }

    #[inline]
    fn error(&mut self, n: usize, shown: f64, rate: f64, lacks: Option<f64>) -> Option<(f64, Corrects<'_>)> {
        if let Some((next, later)) = self.later.split_first()
            && n >= next.from
        {
            (self.stretch, self.later) = (next, later);
        }
        let noise = self.filter.noise;
        let growth = noise.growth_at(n as f64 * self.signals.sample_time_s);
        let y = self.signals.y[n];
        let e = y - (shown - self.filter.late_s * rate + growth * self.sensor);
        if !y.is_finite() {
            self.out.scaled.push(0.0);
            if self.in_detail {
                self.out.log_scales.push(0.0);
            }
            return None;
        }
        let Parts { states, shown, load, sensor, scales } = self.stretch.at(n);
        let (per_deviation, log_variance) = scales;
        let per_deviation = self.per_unit * per_deviation;
        let first = self.filter.first_state;
        let own = self.stretch.rest.as_ref().and_then(|law| {
            let at = |i: usize| i.checked_sub(first).and_then(|i| states.get(i)).copied().unwrap_or(0.0);
            let states = std::array::from_fn(at);
            let moving = Gains { states, shown: 0.0, load, sensor, per_deviation, log_variance };
            self.rest.gains(law, n, (lacks.is_some(), lacks.unwrap_or(0.0)), &moving, e)
        });
        let (observed, load, sensor, per_deviation, log_variance) = match own {
            Some(own) => {
                self.at_rest = own.states;
                (self.at_rest.get(first..)?, own.load, own.sensor, own.per_deviation, own.log_variance)
            }
            None => (states, load, sensor, per_deviation, log_variance),
        };
        if self.in_detail {
            self.out.log_scales.push(log_variance);
        }
        let counts = n >= self.counts_from;
        if counts {
            self.out.log_variances += log_variance;
            self.out.count += 1;
        }
        self.out.scaled.push(if counts { e * per_deviation } else { 0.0 });
        self.load += load * e;
        self.sensor += sensor * e;
        Some((e, Corrects { states: observed, shown }))
    }

    #[inline]
    fn held(&mut self, n: usize) -> (f64, f64) {
        let load = self.filter.constant_load + self.load;
        if self.in_detail {
            self.out.load.push(load);
        }
        self.load *= self.phi;
        self.sensor *= self.filter.noise.sensor_rho;
        (self.signals.u[n], load)
    }
}
