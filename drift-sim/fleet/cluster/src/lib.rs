//! The fleet's queries on [Ballista](https://datafusion.apache.org/ballista/), DataFusion's scheduler and executors: for a plant whose data one machine
//! can't read in time. Everything that plans, divides, sends and repeats work is Ballista's; here it is told drift's functions and the rule that keeps
//! each loop whole.
//!
//! * [`scheduler`]: plans queries with [`drift_fleet::session::physical_rules`] and gives out their parts.
//! * [`executor`]: does parts of the work, with [`drift_fleet::session::functions`] known by name.
//! * [`start`]: the command that runs a scheduler and some executors on this machine.
//! * [`client`]: the session on which the fleet's own commands run.
#![forbid(unsafe_code)]

pub mod client;
pub mod executor;
pub mod scheduler;
pub mod start;

use ballista_core::error::BallistaError;
use drift_sim::Error;

/// The only address that anything here listens on: Ballista asks nobody for a password.
pub const LOOPBACK: &str = "127.0.0.1";

/// What Ballista refused, in one line.
pub fn from_ballista(error: &BallistaError) -> Error {
    let text = error.to_string();
    Error::new(text.lines().next().unwrap_or("Ballista failed").to_owned())
}
