//! The extension module behind the Python package `drift`: it takes arrays and text, calls drift-sim, and hands back arrays,
//! JSON and pages. What a person meets (names, docs, plots) is in `python/drift`.
//!
//! * [`interrupt`]: long work without the interpreter's lock, that Ctrl-C ends.
//! * [`arrays`]: numpy in and out. [`error`]: `DriftError`. [`reading`]: how recordings are read.
//! * One module for each thing: [`recording`], [`control_loop`], [`simulation`], [`calibration`], [`monitoring`], [`diagnosis`],
//!   [`design`], [`proposal`], [`overview`].

mod arrays;
mod calibration;
mod control_loop;
mod decisions;
mod design;
mod diagnosis;
mod error;
mod interrupt;
mod monitoring;
mod overview;
mod page;
mod proposal;
mod reading;
mod recording;
mod simulation;

/// The door's own half in Rust; see the package `drift`.
#[pyo3::pymodule(gil_used = true)]
mod _drift {
    #[pymodule_export]
    use crate::calibration::{Baseline, Calibration, calibrate};
    #[pymodule_export]
    use crate::control_loop::Loop;
    #[pymodule_export]
    use crate::decisions::Decisions;
    #[pymodule_export]
    use crate::design::{Design, design};
    #[pymodule_export]
    use crate::diagnosis::{Diagnosis, diagnose};
    #[pymodule_export]
    use crate::error::DriftError;
    #[pymodule_export]
    use crate::monitoring::{Monitor, Monitoring, watch};
    #[pymodule_export]
    use crate::overview::{Overview, look};
    #[pymodule_export]
    use crate::page::Shown;
    #[pymodule_export]
    use crate::proposal::{Proposal, propose};
    #[pymodule_export]
    use crate::recording::Recording;
    #[pymodule_export]
    use crate::simulation::{Simulation, simulate};
}
