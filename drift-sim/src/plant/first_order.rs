//! A heater, a flow, a level with self-regulation: `time_constant_s*dy/dt = offset + gain*u(t - delay_s) - y`.

use super::number::put;
use super::{Number, Role, StateSpace};

/// Parameters of the first-order plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstOrder {
    /// Unit of y per unit of u.
    pub gain: f64,
    /// Time constant in seconds, > 0.
    pub time_constant_s: f64,
    /// Dead time in seconds, >= 0; need not be a multiple of the sample time.
    pub delay_s: f64,
    /// y at u = 0 (the ambient temperature, say).
    pub offset: f64,
}

impl FirstOrder {
    pub(super) fn numbers(&self) -> Vec<Number> {
        vec![
            Number::new("gain", self.gain, Role::Gain),
            Number::new("time_constant_s", self.time_constant_s, Role::Time),
            Number::new("delay_s", self.delay_s, Role::Delay),
            Number::new("offset", self.offset, Role::Offset),
        ]
    }

    pub(super) fn with_numbers(mut self, values: &[f64]) -> Self {
        put(values, [&mut self.gain, &mut self.time_constant_s, &mut self.delay_s, &mut self.offset]);
        self
    }

    /// From the steady value `offset + gain*u` to y.
    pub(super) fn state_space(&self) -> StateSpace {
        let rate = 1.0 / self.time_constant_s;
        StateSpace { a: vec![vec![-rate]], b: vec![rate], c: vec![1.0], d: 0.0 }
    }
}
