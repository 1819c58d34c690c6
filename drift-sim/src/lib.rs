//! Simulates control loops, calibrates the monitor of [`drift_core`] on healthy recordings, runs it over
//! others, and reproduces the paper that the method comes from.
#![forbid(unsafe_code)]

pub mod design;
pub mod error;
pub mod output;
pub mod plot;
pub mod recording;

pub use error::{Error, Result};
