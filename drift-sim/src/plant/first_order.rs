//! A heater, a flow, a level with self-regulation: `time_constant_s*dy/dt = offset + gain*u(t - delay_s) - y`.

use super::StateSpace;

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
    /// From the steady value `offset + gain*u` to y.
    pub(super) fn state_space(&self) -> StateSpace {
        let rate = 1.0 / self.time_constant_s;
        StateSpace { a: vec![vec![-rate]], b: vec![rate], c: vec![1.0], d: 0.0 }
    }
}
