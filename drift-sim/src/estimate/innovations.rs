//! Innovations: the recorded y less its prediction from the recorded u, sample by sample. The prediction is the full simulation, whose
//! plant, load and sensor noise are corrected at each sample by the [gains](super::gains) of its linear part.

use crate::control_loop::Loop;
use crate::simulate::{Simulation, Start};

use super::gains::Stretch;
use super::noise::Noise;
use super::signals::Signals;

/// Sub-steps of a sample where a term acts along the way: each takes forces at its middle, which is enough beside the filter's corrections and
/// costs a quarter of a simulation's.
const SUBSTEPS: usize = 1;

/// The first samples of a recording, which don't count: the filter finds the state there.
pub const SETTLING: usize = 20;

/// What the filter makes of a recording.
#[derive(Debug, Clone, Default)]
pub struct Innovations {
    /// Innovations over their own deviation, in units of the sensor noise's deviation; 0 where y is missing and in the first samples.
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
    /// Runs over the first `samples` of a recording; `None` where the loop can't be simulated or diverges. `in_detail` keeps load and variances of each sample.
    pub fn run(
        &self,
        signals: &Signals,
        start: &Start,
        samples: usize,
        in_detail: bool,
    ) -> Option<Innovations> {
        let mut simulation = Simulation::with_substeps(self.model, 0, SUBSTEPS).ok()?;
        simulation.start(start).ok()?;
        let samples = samples.min(signals.len());
        let ts = signals.sample_time_s;
        let phi = self.noise.load_phi(ts);
        let rho = self.noise.sensor_rho;
        let per_unit = 1.0 / self.unit;
        let (mut load, mut sensor) = (0.0, 0.0);
        let mut inputs = vec![0.0; signals.inputs.len()];
        let mut out = Innovations { scaled: Vec::with_capacity(samples), ..Innovations::default() };
        let bounds: Vec<usize> = self.gains.iter().map(|stretch| stretch.from).collect();
        let mut stretch = self.gains.first()?;
        let mut next = 1;
        for n in 0..samples {
            if bounds.get(next).is_some_and(|from| n >= *from) {
                stretch = self.gains.get(next)?;
                next += 1;
            }
            if !inputs.is_empty() {
                signals.inputs_at(n, &mut inputs);
            }
            let (shown, rate) = simulation.predict(&inputs);
            let growth = self.noise.growth_at(n as f64 * ts);
            let expected = shown - self.late_s * rate + growth * sensor;
            let y = signals.y[n];
            if y.is_finite() {
                let e = y - expected;
                let (gains, (per_deviation, log_variance)) = stretch.at(n);
                let width = gains.len();
                simulation.correct_from(self.first_state, &gains[..width - 2], e);
                load += gains[width - 2] * e;
                sensor += gains[width - 1] * e;
                if n >= SETTLING {
                    out.log_variances += log_variance;
                    out.count += 1;
                    out.scaled.push(e * per_unit * per_deviation);
                } else {
                    out.scaled.push(0.0);
                }
            } else {
                out.scaled.push(0.0);
            }
            if in_detail {
                out.load.push(self.constant_load + load);
                out.log_scales.push(if y.is_finite() { stretch.at(n).1.1 } else { 0.0 });
            }
            simulation.hold(signals.u[n], &inputs, self.constant_load + load);
            load *= phi;
            sensor *= rho;
        }
        // A diverging run stays diverged: the last sample tells.
        out.scaled.last().is_some_and(|e| e.is_finite()).then_some(out)
    }
}
