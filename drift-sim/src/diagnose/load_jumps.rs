//! Jumps of a load that are part of its noise: how often it jumps, and how far.

use serde_json::{Value, json};

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;

/// Jumps of the load in the first recording.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadJumps {
    /// When it jumps, in seconds from the first sample.
    pub at_s: Vec<f64>,
    /// Root of the mean square of the jumps, in the drive's unit.
    pub size: f64,
}

impl LoadJumps {
    /// Those beside a fit; `None` where the load does not jump in the first recording.
    pub(crate) fn of(fit: &Fit, data: &Data) -> Option<Self> {
        let sample_time_s = fit.hypothesis.model.sample_time_s;
        let jumps = data.jumps();
        let at_s: Vec<f64> = jumps.of(0).iter().map(|sample| *sample as f64 * sample_time_s).collect();
        (!at_s.is_empty()).then_some(Self { at_s, size: jumps.deviation(fit.rows.sensor_sd) })
    }

    /// As a document for programs.
    pub fn to_json(&self) -> Value {
        json!({"at_s": self.at_s, "size": self.size})
    }
}
