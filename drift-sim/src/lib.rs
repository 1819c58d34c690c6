//! Simulates control loops, calibrates the monitor of [`drift_core`] on healthy recordings, runs it over
//! others, and reproduces the paper that the method comes from.
#![forbid(unsafe_code)]

pub mod baseline_file;
pub mod calibrate;
pub mod control_loop;
pub mod controller;
pub mod design;
pub mod diagnose;
pub mod error;
pub mod init;
pub mod loop_file;
pub mod monitor;
pub mod output;
pub mod paper;
pub mod physics;
pub mod plant;
pub mod plot;
pub mod recording;
pub mod reference;
pub mod report;
pub mod simulate;

pub use error::{Error, Result};
