//! Plants: what moves, in physical numbers, before any physics term is added.
//!
//! Each turns the drive `q` into its output: `q = drive_gain*u + drive_offset - load`, where the drive is a
//! force (servo), the steady value of y (first-order), u itself (state-space, transfer function) or a flow (tank).

mod first_order;
mod servo;
mod state_space;
mod tank;
mod transfer_function;
pub mod zero_order_hold;

pub use first_order::FirstOrder;
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

    /// The plant's own dead time, in seconds.
    pub fn delay_s(&self) -> f64 {
        match self {
            Self::FirstOrder(p) => p.delay_s,
            Self::TransferFunction(p) => p.delay_s,
            _ => 0.0,
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
