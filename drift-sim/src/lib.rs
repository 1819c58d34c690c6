//! Simulates control loops with hidden faults, calibrates the monitor of [`drift_core`] on healthy recordings, runs it over
//! others, finds the physics that a model left out, and reproduces the paper that the method comes from.
//!
//! One idea carries all of it: **a loop is a controller, a plant, a sensor and a list of physics terms** ([`control_loop`]). A
//! term ([`physics`]) is a fault that the simulator injects, a candidate that a diagnosis tries and a line of the improved
//! model. From the ground up; each module uses only those above it:
//!
//! * [`error`], [`output`]: errors of one line, files written whole or not at all. [`recording`]: r, y and u from files.
//! * [`look`]: what is in a file, on one screen.
//! * [`controller`], [`plant`], [`physics`], [`control_loop`], [`loop_file`]: what a loop is, and its TOML.
//! * [`mod@reference`], [`mod@simulate`]: what a loop is asked to do, and the sampled loop doing it.
//! * [`design`]: exact run lengths of the detectors. [`calibrate`], [`baseline_file`]: the healthy relation and thresholds
//!   that keep a promise. [`monitor`]: drift-core over a recording.
//! * [`diagnose`]: locate, name, fit and prove missing physics; [`diagnosed`]: from recordings to what is written of it. [`plan`]: the experiment
//!   that tells apart what a diagnosis left. [`paper`]: the paper's tables and figures.
//! * [`plot`]: charts as SVG and as rows of text. [`sentences`]: what results say to people, the same on page, terminal and in
//!   JSON. [`report`]: pages;
//!   [`terminal`]: screens.
//!
//! ```
//! use drift_sim::control_loop::Loop;
//! use drift_sim::physics::Term;
//! use drift_sim::reference::Reference;
//! use drift_sim::simulate::simulate;
//!
//! // The paper's loop, whose sensor drifts by 0.01 per second from 5 s on: y follows r all the same.
//! let drift = Term::new("sensor_drift", &[("rate_per_s", 0.01), ("noise_growth_per_s", 0.0)])?.from_s(5.0);
//! let r = Reference::Constant(1.0).take_samples(10_000);
//! let run = simulate(&Loop::paper().with(drift), &r, &[], 1, None)?;
//! let (shown, real) = (run.y[9_999], run.true_y[9_999]);
//! assert!((shown - 1.0).abs() < 0.01 && (real - 0.95).abs() < 0.01);
//! # Ok::<(), drift_sim::Error>(())
//! ```
#![forbid(unsafe_code)]

pub mod baseline_file;
pub mod calibrate;
pub mod control_loop;
pub mod controller;
mod cores;
pub mod design;
pub mod diagnose;
pub mod diagnosed;
pub mod error;
pub mod estimate;
pub mod init;
pub mod likelihood_search;
pub mod look;
pub mod loop_file;
pub mod measured_input;
pub mod monitor;
pub mod output;
pub mod paper;
pub mod physics;
pub mod plan;
pub mod plant;
pub mod plot;
pub mod recording;
pub mod reference;
pub mod report;
pub mod sentences;
pub mod shortest;
pub mod simulate;
pub mod stage;
pub mod terminal;
mod text_file;

pub use error::{Error, Result};

/// The version of this library and of the command.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
