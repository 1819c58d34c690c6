//! What an experiment would have to tell apart: the causes that a recording left, each with the numbers and the noise with which it explains that
//! recording best. [`crate::plan`] starts from them.

use serde_json::{Value, json};

use crate::control_loop::Loop;
use crate::estimate::fit::Fit;
use crate::physics::Term;

/// A loop that explains the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// The physics that is missing; `None`: nothing is.
    pub term: Option<Term>,
    /// The loop without it, its own numbers as they are likeliest beside it.
    pub model: Loop,
    /// A load that stays, in the drive's unit.
    pub constant_load: f64,
    /// Log-likelihood that the term gains after the cost of its numbers.
    pub gain: f64,
    /// Whether the recording left it; else it is the next best.
    pub is_left: bool,
    /// The noise beside it.
    pub noise: CauseNoise,
}

/// The noise with which a cause explains the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CauseNoise {
    /// Deviation of the sensor's noise, in the unit of y.
    pub sensor_sd: f64,
    /// What stays of it from sample to sample.
    pub sensor_rho: f64,
    /// Deviation of the slow random load, in the drive's unit.
    pub load_sd: f64,
    /// Its time constant, in seconds.
    pub load_tau_s: f64,
}

impl CauseNoise {
    /// The noise of single samples of which this one's are the means of `factor` each.
    fn of_single_samples(self, factor: usize) -> Self {
        // Means are correlated the more the more samples are. Below 1 by so much their noise could no longer be told from a drift.
        let (mut least, mut most) = (0.0, 1.0 - 1e-6);
        for _ in 0..HALVINGS {
            let rho = 0.5 * (least + most);
            if correlation_of_means(rho, factor) < self.sensor_rho { least = rho } else { most = rho }
        }
        let sensor_sd = self.sensor_sd / libm::sqrt(variance_of_means(least, factor));
        Self { sensor_sd, sensor_rho: least, ..self }
    }
}

/// Halvings by which a number between 0 and 1 is found to 1e-9.
const HALVINGS: usize = 30;

/// Variance of the mean of so many samples of which a part stays from each to the next, over that of one.
fn variance_of_means(rho: f64, samples: usize) -> f64 {
    let n = samples as f64;
    let beside: f64 = (1..samples).map(|k| (n - k as f64) * libm::pow(rho, k as f64)).sum();
    (n + 2.0 * beside) / (n * n)
}

/// Correlation of one such mean with the next.
fn correlation_of_means(rho: f64, samples: usize) -> f64 {
    let n = samples as f64;
    let stays: f64 = (0..samples).map(|k| libm::pow(rho, k as f64)).sum();
    rho * stays * stays / (n * n * variance_of_means(rho, samples))
}

impl Cause {
    /// Of a fit to means of `factor` samples each, its last candidate the term, in the samples of the stated loop; `None` where the fit can't be simulated.
    pub fn of(fit: &Fit, stated: &Loop, factor: usize, gain: f64, is_left: bool) -> Option<Self> {
        let realised = fit.hypothesis.realise(&fit.point)?;
        let mut model = Loop { sample_time_s: stated.sample_time_s, ..realised.model };
        let term = if fit.hypothesis.candidates().is_empty() { None } else { model.physics.pop() };
        let sensor_sd = fit.rows.sensor_sd;
        let noise = CauseNoise {
            sensor_sd,
            sensor_rho: realised.noise.sensor_rho,
            load_sd: realised.noise.load_ratio * sensor_sd,
            load_tau_s: realised.noise.load_tau_s,
        };
        let noise = if factor > 1 { noise.of_single_samples(factor) } else { noise };
        Some(Self { term, model, constant_load: realised.constant_load, gain, is_left, noise })
    }

    /// The same where nothing is proven: that nothing is missing is left too.
    #[must_use]
    pub(crate) fn or_nothing(self) -> Self {
        Self { is_left: self.is_left || self.term.is_none(), ..self }
    }

    /// As a document for programs. `loop` is a loop file without the cause.
    pub fn to_json(&self) -> Value {
        let term = self.term.as_ref().map(|term| {
            let numbers = term.kind.parameters.iter().zip(&term.parameters);
            let numbers: serde_json::Map<String, Value> =
                numbers.map(|(parameter, value)| (parameter.name.to_owned(), json!(value))).collect();
            json!({"kind": term.kind.name, "onset_s": term.onset_s, "parameters": numbers})
        });
        json!({
            "left": self.is_left,
            "gain": self.gain,
            "physics": term,
            "constant_load": self.constant_load,
            "sensor_sd": self.noise.sensor_sd,
            "sensor_rho": self.noise.sensor_rho,
            "load_sd": self.noise.load_sd,
            "load_tau_s": self.noise.load_tau_s,
            "loop": self.model.to_toml(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::noise::sequence;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng as _;

    /// Means of three samples of drawn noise, of which nothing, a third and nine tenths stay: from their deviation and correlation, those of the samples.
    #[test]
    fn noise_of_single_samples_is_told_by_their_means() {
        for rho in [0.0, 0.33, 0.9] {
            let drawn = sequence(600_000, 1.0, rho, &mut ChaCha8Rng::seed_from_u64(7));
            let means: Vec<f64> =
                drawn.chunks_exact(3).map(|three| three.iter().sum::<f64>() / 3.0).collect();
            let variance = means.iter().map(|x| x * x).sum::<f64>() / means.len() as f64;
            let next = means.windows(2).map(|x| x[0] * x[1]).sum::<f64>() / means.len() as f64;
            let of_means = CauseNoise {
                sensor_sd: libm::sqrt(variance),
                sensor_rho: next / variance,
                load_sd: 2.0,
                load_tau_s: 5.0,
            };
            let single = of_means.of_single_samples(3);
            assert!((single.sensor_rho - rho).abs() < 0.02, "{rho}: {single:?}");
            assert!((single.sensor_sd - 1.0).abs() < 0.02, "{rho}: {single:?}");
            assert_eq!((single.load_sd, single.load_tau_s), (2.0, 5.0));
        }
    }
}
