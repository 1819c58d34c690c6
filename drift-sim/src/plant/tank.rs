//! A tank that drains by its own head: `area*dh/dt = inflow_gain*u - outflow*sqrt(h)`, `h >= 0` (Torricelli).

use super::number::put;
use super::{Number, Role};

/// Parameters of the tank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tank {
    /// Cross-section, > 0: flow unit times s per unit of the level.
    pub area: f64,
    /// Flow per unit of u, flow unit per u unit.
    pub inflow_gain: f64,
    /// Flow out at a level of 1, >= 0, flow unit.
    pub outflow: f64,
}

impl Tank {
    pub(super) fn numbers(&self) -> Vec<Number> {
        vec![
            Number::new("inflow_gain", self.inflow_gain, Role::Gain),
            Number::new("outflow", self.outflow, Role::Shape),
        ]
    }

    pub(super) fn with_numbers(mut self, values: &[f64]) -> Self {
        put(values, [&mut self.inflow_gain, &mut self.outflow]);
        self
    }

    /// dh/dt at a level under a net drive (a flow).
    #[inline]
    pub(crate) fn rate(&self, level: f64, drive: f64) -> f64 {
        let rate = (drive - self.outflow * libm::sqrt(level.max(0.0))) / self.area;
        // An empty tank can't get emptier.
        if level <= 0.0 { rate.max(0.0) } else { rate }
    }
}
