//! A mass on a drive: `inertia*dv/dt = actuator_gain*u - viscous*v`, `dx/dt = v`.

use super::number::put;
use super::{Number, Role, StateSpace};

/// What is measured of the mass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// The position x, the integral of the speed.
    Position,
    /// The speed v.
    Speed,
}

impl Output {
    /// Both, as the loop file names them.
    pub const ALL: [(&'static str, Self); 2] = [("position", Self::Position), ("speed", Self::Speed)];
}

/// Parameters of the servo, in any consistent set of units (force per unit of speed, and so on).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    /// What y is: position or speed.
    pub output: Output,
    /// Mass or moment of inertia, > 0.
    pub inertia: f64,
    /// Viscous friction, >= 0.
    pub viscous: f64,
    /// Force or torque per unit of u.
    pub actuator_gain: f64,
}

impl Servo {
    pub(super) fn numbers(&self) -> Vec<Number> {
        vec![
            Number::new("inertia", self.inertia, Role::Inertia),
            Number::new("viscous", self.viscous, Role::Viscous),
        ]
    }

    pub(super) fn with_numbers(mut self, values: &[f64]) -> Self {
        put(values, [&mut self.inertia, &mut self.viscous]);
        self
    }

    /// From force to output; states: position, speed.
    pub(super) fn state_space(&self) -> StateSpace {
        let c = match self.output {
            Output::Position => vec![1.0, 0.0],
            Output::Speed => vec![0.0, 1.0],
        };
        StateSpace {
            a: vec![vec![0.0, 1.0], vec![0.0, -self.viscous / self.inertia]],
            b: vec![0.0, 1.0 / self.inertia],
            c,
            d: 0.0,
        }
    }
}
