//! Decisions of the monitor as they fell: Python's objects are made of those that somebody looks at.

use drift_core::ChannelReport;
use drift_sim::monitor::{Hop, write_hop};
use numpy::{Element, PyArray1};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A decision as the line of JSON that the command writes.
pub fn line(hop: &Hop) -> PyResult<String> {
    let mut line = Vec::new();
    write_hop(&mut line, hop).map_err(|e| PyValueError::new_err(e.to_string()))?;
    String::from_utf8(line).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// Decisions in the order of time.
#[pyclass(frozen, module = "drift._drift")]
pub struct Decisions(pub Vec<Hop>);

#[pymethods]
impl Decisions {
    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// A decision as JSON.
    fn line(&self, index: usize) -> PyResult<String> {
        self.0.get(index).map_or_else(|| Err(PyIndexError::new_err("there is no such decision")), line)
    }

    /// Times, words and numbers of all of them, a column each; the monitor's own numbers in its single precision.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        columns.set_item("hop", self.array(py, |hop| hop.report.hop))?;
        columns.set_item("from_s", self.array(py, |hop| hop.from_s))?;
        columns.set_item("to_s", self.array(py, |hop| hop.to_s))?;
        columns.set_item("status", self.words(|hop| serde_json::json!(hop.report.status)))?;
        columns.set_item("verdict", self.words(|hop| serde_json::json!(hop.report.verdict)))?;
        columns.set_item("location", self.words(|hop| serde_json::json!(hop.report.location())))?;
        let Some(first) = self.0.first() else { return Ok(columns) };
        for (place, channel) in first.report.channels.iter().enumerate() {
            let of = |hop: &Hop| hop.report.channels.get(place).copied();
            let number = |of_channel: fn(&ChannelReport) -> f32| {
                self.array(py, move |hop| of(hop).as_ref().map_or(f32::NAN, of_channel))
            };
            let kind = channel.kind.name();
            columns.set_item(format!("{kind}_x"), number(|channel| channel.x))?;
            columns.set_item(format!("{kind}_value"), number(|channel| channel.value))?;
            columns.set_item(format!("{kind}_residual"), number(|channel| channel.residual))?;
            columns.set_item(format!("{kind}_z"), number(|channel| channel.z))?;
            let verdicts = self.words(|hop| serde_json::json!(of(hop).map(|channel| channel.verdict)));
            columns.set_item(format!("{kind}_verdict"), verdicts)?;
        }
        Ok(columns)
    }
}

impl Decisions {
    fn array<'py, T: Element>(&self, py: Python<'py>, of: impl Fn(&Hop) -> T) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_iter(py, self.0.iter().map(of))
    }

    fn words(&self, of: impl Fn(&Hop) -> serde_json::Value) -> Vec<String> {
        self.0.iter().map(|hop| of(hop).as_str().unwrap_or_default().to_owned()).collect()
    }
}
