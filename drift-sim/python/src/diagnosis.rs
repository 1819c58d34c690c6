//! Diagnoses.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use drift_sim::diagnosed::{Diagnosed, Question, Read};
use drift_sim::{diagnose as library, recording, sentences};
use pyo3::prelude::*;

use crate::control_loop::Loop;
use crate::interrupt;
use crate::page::{self, Shown};
use crate::recording::Recording;

/// A diagnosis.
#[pyclass(frozen, module = "drift._drift")]
pub struct Diagnosis {
    found: Arc<Diagnosed>,
    shown: OnceLock<Shown>,
}

#[pymethods]
impl Diagnosis {
    /// The document that `drift diagnose --json` writes.
    fn to_json(&self) -> PyResult<String> {
        page::text(&self.found.json(None))
    }

    fn answer(&self) -> String {
        page::answer(&sentences::diagnosis(&self.found.found, self.found.clock(), self.found.start_s()))
    }

    /// The loop as it was diagnosed, with its own numbers refitted, and with what was found.
    #[getter]
    fn loops(&self) -> (Loop, Loop, Loop) {
        let library::Diagnosis { nominal, refitted, improved, .. } = &self.found.found;
        (Loop(nominal.clone()), Loop(refitted.clone()), Loop(improved.clone()))
    }

    fn html(&self, py: Python<'_>) -> PyResult<String> {
        self.shown(py).map(|shown| shown.html().to_owned())
    }

    fn first_screen(&self, py: Python<'_>) -> PyResult<String> {
        self.shown(py).map(|shown| shown.first_screen().to_owned())
    }

    fn figure(&self, py: Python<'_>) -> PyResult<Option<String>> {
        self.shown(py)?.figure()
    }
}

impl Diagnosis {
    fn shown(&self, py: Python<'_>) -> PyResult<&Shown> {
        if let Some(shown) = self.shown.get() {
            return Ok(shown);
        }
        let found = Arc::clone(&self.found);
        let made = interrupt::run(py, move || Shown::of(found.page(String::new())))?;
        Ok(self.shown.get_or_init(|| made))
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
) -> PyResult<Diagnosis> {
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
    let found = interrupt::run(py, move || question.diagnose())?;
    Ok(Diagnosis { found: Arc::new(found), shown: OnceLock::new() })
}
