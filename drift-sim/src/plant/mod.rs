//! Plants: what moves, in physical numbers, before any physics term is added.
//!
//! Each turns the drive `q` into its output: `q = drive_gain*u + drive_offset - load`, where the drive is a
//! force (servo), the steady value of y (first-order), u itself (state-space, transfer function) or a flow (tank).

mod first_order;
mod number;
mod servo;
mod state_space;
mod tank;
mod transfer_function;
pub mod zero_order_hold;

pub use first_order::FirstOrder;
pub use number::{Number, Role};
pub use servo::{Output, Servo};
pub use state_space::StateSpace;
pub use tank::Tank;
pub use transfer_function::TransferFunction;

use crate::{Error, Result};

/// A plant with its parameters, as the loop file states it.
#[derive(Debug, Clone, PartialEq)]
pub enum Plant {
    /// `kind = "servo"`.
    Servo(Servo),
    /// `kind = "first-order"`.
    FirstOrder(FirstOrder),
    /// `kind = "state-space"`.
    StateSpace(StateSpace),
    /// `kind = "transfer-function"`.
    TransferFunction(TransferFunction),
    /// `kind = "tank"`.
    Tank(Tank),
    /// `kind = "identify"`: a linear model is to be fitted to a recording first; can't be simulated.
    Identify,
}

impl Plant {
    /// The names of all kinds, as in the loop file.
    pub const KINDS: [&'static str; 6] =
        ["servo", "first-order", "state-space", "transfer-function", "tank", "identify"];

    /// The name of this kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Servo(_) => "servo",
            Self::FirstOrder(_) => "first-order",
            Self::StateSpace(_) => "state-space",
            Self::TransferFunction(_) => "transfer-function",
            Self::Tank(_) => "tank",
            Self::Identify => "identify",
        }
    }

    /// Drive per unit of u.
    pub fn drive_gain(&self) -> f64 {
        match self {
            Self::Servo(p) => p.actuator_gain,
            Self::FirstOrder(p) => p.gain,
            Self::Tank(p) => p.inflow_gain,
            Self::StateSpace(_) | Self::TransferFunction(_) | Self::Identify => 1.0,
        }
    }

    /// Drive at u = 0.
    pub fn drive_offset(&self) -> f64 {
        match self {
            Self::FirstOrder(p) => p.offset,
            Self::TransferFunction(p) => p.offset,
            _ => 0.0,
        }
    }

    /// The u under which a plant with a dead time rests at this y; none where it has no dead time, or rests at any.
    pub fn u_at_rest(&self, y: f64) -> Option<f64> {
        let u = match self {
            Self::FirstOrder(p) => (y - p.offset) / p.gain,
            Self::TransferFunction(p) => y * p.den.last()? / p.num.last()? - p.offset,
            _ => return None,
        };
        u.is_finite().then_some(u)
    }

    /// Whether y is nothing but the drive's integral.
    fn is_integrator(&self) -> bool {
        matches!(self, Self::TransferFunction(p) if p.den.len() == 2 && p.den.last() == Some(&0.0))
    }

    /// Whether a constant drive leads y to a level: a position and an integral go on.
    pub fn keeps_its_level(&self) -> bool {
        match self {
            Self::Servo(servo) => servo.output == Output::Speed,
            plant => !plant.is_integrator(),
        }
    }

    /// The same within so long: a lag that is longer integrates.
    pub fn keeps_its_level_over(&self, duration_s: f64) -> bool {
        match self {
            Self::FirstOrder(p) => p.time_constant_s < duration_s,
            plant => plant.keeps_its_level(),
        }
    }

    /// The plant's own dead time, in seconds.
    pub fn delay_s(&self) -> f64 {
        match self {
            Self::FirstOrder(p) => p.delay_s,
            Self::TransferFunction(p) => p.delay_s,
            _ => 0.0,
        }
    }

    /// Its own numbers, which a fit may move, in the order of [`Plant::with_numbers`]. What only scales all the others (a servo's
    /// actuator gain against inertia and viscous friction) is not among them.
    pub fn numbers(&self) -> Vec<Number> {
        match self {
            Self::Servo(p) => p.numbers(),
            Self::FirstOrder(p) => p.numbers(),
            Self::StateSpace(p) => p.numbers(),
            Self::TransferFunction(p) => p.numbers(),
            Self::Tank(p) => p.numbers(),
            Self::Identify => Vec::new(),
        }
    }

    /// The same plant with its numbers replaced, in the order of [`Plant::numbers`].
    #[must_use]
    pub fn with_numbers(&self, values: &[f64]) -> Self {
        match self {
            Self::Servo(p) => Self::Servo(p.with_numbers(values)),
            Self::FirstOrder(p) => Self::FirstOrder(p.with_numbers(values)),
            Self::StateSpace(p) => Self::StateSpace(p.with_numbers(values)),
            Self::TransferFunction(p) => Self::TransferFunction(p.with_numbers(values)),
            Self::Tank(p) => Self::Tank(p.with_numbers(values)),
            Self::Identify => Self::Identify,
        }
    }

    /// The linear dynamics from drive to output in continuous time; none for a tank.
    ///
    /// # Errors
    /// The plant is still to be identified.
    pub fn linear(&self) -> Result<Option<StateSpace>> {
        Ok(match self {
            Self::Servo(p) => Some(p.state_space()),
            Self::FirstOrder(p) => Some(p.state_space()),
            Self::StateSpace(p) => Some(p.clone()),
            Self::TransferFunction(p) => Some(p.state_space()),
            Self::Tank(_) => None,
            Self::Identify => {
                return Err(Error::new(
                    "plant kind 'identify' can't be simulated before a model is fitted to a recording",
                )
                .allowed("servo, first-order, state-space, transfer-function, tank"));
            }
        })
    }
}
