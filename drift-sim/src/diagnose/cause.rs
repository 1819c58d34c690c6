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

impl Cause {
    /// Of a fit, its last candidate the term; `None` where the fit can't be simulated.
    pub fn of(fit: &Fit, gain: f64, is_left: bool) -> Option<Self> {
        let realised = fit.hypothesis.realise(&fit.point)?;
        let mut model = realised.model;
        let term = if fit.hypothesis.candidates().is_empty() { None } else { model.physics.pop() };
        let sensor_sd = fit.rows.sensor_sd;
        let noise = CauseNoise {
            sensor_sd,
            sensor_rho: realised.noise.sensor_rho,
            load_sd: realised.noise.load_ratio * sensor_sd,
            load_tau_s: realised.noise.load_tau_s,
        };
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
