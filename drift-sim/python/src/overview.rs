//! Looks at recordings that nobody has named the columns of yet.

use std::path::PathBuf;

use drift_sim::look::screen;
use drift_sim::recording::{self as library, ReadOptions};
use drift_sim::terminal::Terminal;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::view;
use crate::recording::{Columns, columns};
use crate::{interrupt, reading};

/// Times in s, from and to, and how many rows.
type Stretch = (f64, f64, usize);

/// What is in a recording.
#[pyclass(frozen, module = "drift._drift")]
pub struct Overview(library::Overview);

#[pymethods]
impl Overview {
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn format(&self) -> &str {
        self.0.format
    }

    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.names.clone()
    }

    #[getter]
    fn columns(&self) -> (Option<&str>, &str, &str, &str) {
        let map = &self.0.columns;
        (map.t.as_deref(), &map.r, &map.y, &map.u)
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes.clone()
    }

    /// The signal that no column seems to be.
    #[getter]
    fn lacks(&self) -> Option<&str> {
        self.0.lacks.as_deref()
    }

    /// The sample time, s; or why it can't be read as it is.
    #[getter]
    fn sampling(&self) -> (Option<f64>, Option<String>) {
        match &self.0.sampling {
            Some(Ok(sample_time_s)) => (Some(*sample_time_s), None),
            Some(Err(error)) => (None, Some(error.to_string())),
            None => (None, None),
        }
    }

    /// Begin and length of each gap, s.
    #[getter]
    fn gaps(&self) -> Vec<(f64, f64)> {
        self.0.gaps.iter().map(|gap| (gap.from_s, gap.length_s)).collect()
    }

    #[getter]
    fn repeated(&self) -> u64 {
        self.0.repeated
    }

    #[getter]
    fn manual(&self) -> Vec<Stretch> {
        stretches(&self.0.manual)
    }

    /// Where u stays at its lowest, and at its highest value.
    #[getter]
    fn at_limit(&self) -> (Vec<Stretch>, Vec<Stretch>) {
        let [low, high] = &self.0.at_limit;
        (stretches(low), stretches(high))
    }

    /// t, r, y or u as they stand in the file, without a copy.
    fn column<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let seen = &slf.get().0;
        let column = match name {
            "t" => &seen.t_s,
            "r" => &seen.r,
            "y" => &seen.y,
            _ => &seen.u,
        };
        view(slf.clone().into_any(), column)
    }

    fn screen(&self) -> String {
        let text = screen(&self.0, "", &Terminal { width: 80, colour: false, ..Terminal::here() });
        // What the command suggests to type next is no use here.
        text.split("\nnext: ").next().unwrap_or_default().to_owned()
    }
}

fn stretches(spans: &[library::Span]) -> Vec<Stretch> {
    spans.iter().map(|span| (span.from_s, span.to_s, span.rows)).collect()
}

/// Looks at a file, or at named columns.
#[pyfunction]
#[pyo3(signature = (*, path, name, named, reading))]
pub fn look(
    py: Python<'_>,
    path: Option<PathBuf>,
    name: String,
    named: Option<Columns<'_>>,
    reading: Option<Bound<'_, PyDict>>,
) -> PyResult<Overview> {
    let options = ReadOptions { incomplete: true, ..reading::options(reading.as_ref(), Vec::new())? };
    let named = columns(&named.unwrap_or_default())?;
    interrupt::run(py, move || match path {
        Some(path) => library::Overview::read(&path, &options),
        None => library::Overview::from_columns(&name, named, &options),
    })
    .map(Overview)
}
