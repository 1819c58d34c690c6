//! Recordings in memory.

use std::path::PathBuf;
use std::sync::Arc;

use drift_sim::recording::{self, RowState};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{cells, view};
use crate::error::raised;
use crate::{interrupt, reading};

/// r, y and u at uniform times.
#[pyclass(frozen, module = "drift._drift")]
pub struct Recording(pub Arc<recording::Recording>);

/// Named columns from Python.
pub type Columns<'py> = Vec<(String, Bound<'py, PyAny>)>;

/// The same as the library takes them.
pub fn columns(columns: &Columns<'_>) -> PyResult<Vec<(String, recording::Cells)>> {
    columns.iter().map(|(name, values)| Ok((name.clone(), cells(values)?))).collect()
}

#[pymethods]
impl Recording {
    /// Reads a file with these further columns, or with all that hold numbers.
    #[staticmethod]
    #[pyo3(signature = (path, further, all_further, reading))]
    fn read(
        py: Python<'_>,
        path: PathBuf,
        further: Vec<String>,
        all_further: bool,
        reading: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut options = reading::options(reading.as_ref(), further)?;
        options.keep_extra = all_further;
        interrupt::run(py, move || recording::Recording::read(&path, &options))
            .map(|read| Self(Arc::new(read)))
    }

    /// Takes named columns.
    #[staticmethod]
    #[pyo3(signature = (name, named, further, all_further, reading))]
    fn from_columns(
        py: Python<'_>,
        name: String,
        named: Columns<'_>,
        further: Vec<String>,
        all_further: bool,
        reading: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut options = reading::options(reading.as_ref(), further)?;
        options.keep_extra = all_further;
        let columns = columns(&named)?;
        interrupt::run(py, move || recording::Recording::from_columns(&name, columns, &options))
            .map(|read| Self(Arc::new(read)))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn sample_time_s(&self) -> f64 {
        self.0.sample_time_s
    }

    #[getter]
    fn start_s(&self) -> f64 {
        self.0.start_s
    }

    #[getter]
    fn zero_s(&self) -> Option<f64> {
        self.0.zero_s
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.quality.notes.clone()
    }

    #[getter]
    fn quality(&self) -> String {
        self.0.quality.to_string()
    }

    #[getter]
    fn columns(&self) -> (Option<&str>, &str, &str, &str) {
        let map = &self.0.columns;
        (map.t.as_deref(), &map.r, &map.y, &map.u)
    }

    #[getter]
    fn further(&self) -> Vec<String> {
        self.0.extra.iter().map(|(name, _)| name.clone()).collect()
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        (0..self.0.len()).map(|n| self.0.time_s(n)).collect::<Vec<_>>().into_pyarray(py)
    }

    /// r, y, u or a further column, without a copy.
    fn column<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        view(slf.clone().into_any(), slf.get().0.column(name).map_err(raised)?)
    }

    /// 0 where a sample counts, 1 where it is missing, 2 where the loop is in manual.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u8>> {
        let code = |state: &RowState| match state {
            RowState::Valid => 0,
            RowState::Missing => 1,
            RowState::Manual => 2,
        };
        self.0.state.iter().map(code).collect::<Vec<_>>().into_pyarray(py)
    }
}
