//! Diagnoses.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use drift_sim::diagnose::healthy::Healthy;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{self as library, page as pages, report};
use drift_sim::recording::{self, ColumnMap};
use drift_sim::sentences::{self, Clock};
use pyo3::prelude::*;

use crate::control_loop::Loop;
use crate::interrupt;
use crate::page::{self, Shown};
use crate::recording::Recording;

/// What was found, and all that its page shows.
struct Found {
    diagnosis: library::Diagnosis,
    train: Signals,
    holdout: Option<Signals>,
    clock: Clock,
    holdout_clock: Clock,
    name: PathBuf,
    loop_name: PathBuf,
    holdout_name: Option<PathBuf>,
    columns: ColumnMap,
}

impl Found {
    /// The time that onsets count from.
    fn start_s(&self) -> f64 {
        self.train.start_s - self.train.origin_s
    }

    fn page(&self) -> drift_sim::report::Page {
        let case = pages::Case {
            train: &self.train,
            holdout: self.holdout.as_ref(),
            recording: &self.name,
            loop_file: &self.loop_name,
            holdout_file: self.holdout_name.as_deref(),
            columns: &self.columns,
            clock: self.clock,
            holdout_clock: self.holdout_clock,
        };
        pages::page(&self.diagnosis, &case, String::new())
    }
}

/// A diagnosis.
#[pyclass(frozen, module = "drift._drift")]
pub struct Diagnosis {
    found: Arc<Found>,
    shown: OnceLock<Shown>,
}

#[pymethods]
impl Diagnosis {
    /// The document that `drift diagnose --json` writes.
    fn to_json(&self) -> PyResult<String> {
        page::text(&report::json(&self.found.diagnosis, None, &self.found.clock, self.found.start_s()))
    }

    fn answer(&self) -> String {
        page::answer(&sentences::diagnosis(&self.found.diagnosis, &self.found.clock, self.found.start_s()))
    }

    /// The loop as it was diagnosed, with its own numbers refitted, and with what was found.
    #[getter]
    fn loops(&self) -> (Loop, Loop, Loop) {
        let library::Diagnosis { nominal, refitted, improved, .. } = &self.found.diagnosis;
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
        let made = interrupt::run(py, move || Shown::of(found.page()))?;
        Ok(self.shown.get_or_init(|| made))
    }
}

/// Diagnoses a recording against a loop.
#[pyfunction]
#[pyo3(signature = (recording, model, *, loop_name, holdout, healthy))]
pub fn diagnose(
    py: Python<'_>,
    recording: &Recording,
    model: &Loop,
    loop_name: PathBuf,
    holdout: Option<&Recording>,
    healthy: Vec<PyRef<'_, Recording>>,
) -> PyResult<Diagnosis> {
    let shared = |recording: &Recording| Arc::clone(&recording.0);
    let (train, model) = (shared(recording), model.0.clone());
    let holdout = holdout.map(shared);
    let healthy: Vec<Arc<recording::Recording>> = healthy.iter().map(|recording| shared(recording)).collect();
    let found = interrupt::run(py, move || {
        let signals = |recording: &Arc<recording::Recording>| Signals::new(recording, &model);
        let (of_train, of_holdout) = (signals(&train)?, holdout.as_ref().map(signals).transpose()?);
        let healthy = healthy.iter().map(signals).collect::<drift_sim::Result<Vec<_>>>()?;
        let diagnosis = if healthy.is_empty() {
            library::diagnose(&of_train, of_holdout.as_ref(), &model)?
        } else {
            Healthy::of(&model, &healthy).diagnose(&of_train, of_holdout.as_ref())?
        };
        let clock = train.clock();
        Ok(Found {
            diagnosis,
            train: of_train,
            holdout: of_holdout,
            clock,
            holdout_clock: holdout.as_ref().map_or(clock, |holdout| holdout.clock()),
            name: Path::new(&train.name).to_owned(),
            loop_name,
            holdout_name: holdout.as_ref().map(|holdout| Path::new(&holdout.name).to_owned()),
            columns: train.columns.clone(),
        })
    })?;
    Ok(Diagnosis { found: Arc::new(found), shown: OnceLock::new() })
}
