//! Loops proposed from recordings.

use drift_sim::init;
use drift_sim::terminal::Terminal;
use pyo3::prelude::*;

use crate::control_loop::Loop;
use crate::interrupt;
use crate::recording::Recording;

/// A proposed loop and why it is as it is.
#[pyclass(frozen, module = "drift._drift")]
pub struct Proposal {
    found: init::Proposal,
    /// Time of the first and the last sample that were used, where the loop was not closed all the time.
    used_s: Option<(f64, f64)>,
}

#[pymethods]
impl Proposal {
    #[getter]
    fn model(&self) -> Loop {
        Loop(self.found.model.clone())
    }

    #[getter]
    fn reasons(&self) -> (Vec<String>, Vec<String>, Vec<String>) {
        let init::Proposal { about_loop, about_controller, about_plant, .. } = &self.found;
        (about_loop.clone(), about_controller.clone(), about_plant.clone())
    }

    #[getter]
    fn window_s(&self) -> Option<f64> {
        self.found.window_s
    }

    #[getter]
    fn used_s(&self) -> Option<(f64, f64)> {
        self.used_s
    }

    fn to_toml(&self) -> String {
        self.found.to_toml()
    }

    fn screen(&self) -> String {
        self.found.screen(&Terminal::plain())
    }
}

/// Proposes a loop for a recording, from its longest stretch with the loop closed.
#[pyfunction]
pub fn propose(py: Python<'_>, recording: &Recording) -> PyResult<Proposal> {
    let mut recording = recording.0.as_ref().clone();
    interrupt::run(py, move || {
        let used_s = recording.keep_longest_closed();
        init::propose(&recording).map(|found| Proposal { found, used_s })
    })
}
