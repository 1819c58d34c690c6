//! Waves beside a loop that are part of its noise.

use serde_json::{Value, json};

use crate::estimate::likelihood::Data;

/// What swings beside the loop in the first recording.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadWaves {
    /// The frequencies, in Hz.
    pub frequencies_hz: Vec<f64>,
}

impl LoadWaves {
    /// Those that data know of; `None` where nothing swings in the first recording.
    pub(crate) fn of(data: &Data) -> Option<Self> {
        let frequencies_hz = data.waves().of(0).to_vec();
        (!frequencies_hz.is_empty()).then_some(Self { frequencies_hz })
    }

    /// As a document for programs.
    pub fn to_json(&self) -> Value {
        json!({"frequencies_hz": self.frequencies_hz})
    }
}
