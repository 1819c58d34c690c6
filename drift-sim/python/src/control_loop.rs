//! Loops.

use std::path::PathBuf;

use drift_sim::control_loop;
use pyo3::prelude::*;

use crate::error::raised;

/// A control loop.
#[pyclass(frozen, module = "drift._drift")]
pub struct Loop(pub control_loop::Loop);

#[pymethods]
impl Loop {
    /// From the text of a loop file.
    #[staticmethod]
    fn parse(text: &str, name: &str) -> PyResult<Self> {
        control_loop::Loop::parse(text, name).map(Self).map_err(raised)
    }

    /// From a loop file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        control_loop::Loop::read(&path).map(Self).map_err(raised)
    }

    fn to_toml(&self) -> String {
        self.0.to_toml()
    }

    #[getter]
    fn sample_time_s(&self) -> f64 {
        self.0.sample_time_s
    }

    #[getter]
    fn inputs(&self) -> Vec<String> {
        self.0.input_columns()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}
