//! Diagnoses.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use drift_sim::diagnosed::{Diagnosed, Question, Read};
use drift_sim::{diagnose as library, recording, sentences};
use pyo3::prelude::*;

use crate::control_loop::Loop;
use crate::interrupt;
use crate::page::{self, Shown};
use crate::recording::Recording;

/// A diagnosis.
#[pyclass(frozen, extends = Shown, module = "drift._drift")]
pub struct Diagnosis(Arc<Diagnosed>);

#[pymethods]
impl Diagnosis {
    /// The document that `drift diagnose --json` writes.
    fn to_json(&self) -> PyResult<String> {
        page::text(&self.0.json(None))
    }

    fn answer(&self) -> String {
        page::answer(&sentences::diagnosis(&self.0.found, self.0.clock(), self.0.start_s()))
    }

    /// The loop as it was diagnosed, with its own numbers refitted, and with what was found.
    #[getter]
    fn loops(&self) -> (Loop, Loop, Loop) {
        let library::Diagnosis { nominal, refitted, improved, .. } = &self.0.found;
        (Loop(nominal.clone()), Loop(refitted.clone()), Loop(improved.clone()))
    }
}

/// Diagnoses recordings against a loop, or, without one, against the law alone that a recording shows.
#[pyfunction]
#[pyo3(signature = (recordings, model, *, holdout, healthy, guarantee))]
pub fn diagnose(
    py: Python<'_>,
    recordings: Vec<PyRef<'_, Recording>>,
    model: Option<(PathBuf, PyRef<'_, Loop>)>,
    holdout: Option<&Recording>,
    healthy: Vec<PyRef<'_, Recording>>,
    guarantee: Option<f64>,
) -> PyResult<Py<Diagnosis>> {
    let read = |recording: &Recording| Read {
        file: Path::new(&recording.0.name).to_owned(),
        recording: recording::Recording::clone(&recording.0),
    };
    let question = Question {
        recordings: recordings.iter().map(|recording| read(recording)).collect(),
        holdout: holdout.map(read),
        healthy: healthy.iter().map(|healthy| read(healthy)).collect(),
        stated: model.map(|(name, model)| (name, model.0.clone())),
        guarantee,
    };
    let found = Arc::new(interrupt::run(py, move || question.diagnose())?);
    let of_page = Arc::clone(&found);
    Shown::by(py, Diagnosis(found), move || of_page.page(String::new()))
}
