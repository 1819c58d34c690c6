//! numpy in and out.

use drift_sim::recording::Cells;
use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

/// A column from Python: an array of doubles or singles, or a list of text and `None`.
pub fn cells(values: &Bound<'_, PyAny>) -> PyResult<Cells> {
    if let Ok(doubles) = values.extract::<PyReadonlyArray1<'_, f64>>() {
        return Ok(Cells::Double(doubles.as_array().to_vec()));
    }
    if let Ok(singles) = values.extract::<PyReadonlyArray1<'_, f32>>() {
        return Ok(Cells::Single(singles.as_array().to_vec()));
    }
    match values.extract::<Vec<Option<String>>>() {
        Ok(text) => Ok(Cells::Text(text)),
        Err(_) => {
            Err(PyTypeError::new_err("a column is an array of float64 or float32, or a list of str and None"))
        }
    }
}

/// A view of numbers that `owner` holds, without a copy; it can't be written through.
#[allow(unsafe_code, reason = "numpy takes the memory of another object by its address alone")]
pub fn view<'py>(owner: Bound<'py, PyAny>, numbers: &[f64]) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let py = owner.py();
    // SAFETY: every caller passes numbers of an immutable value that `owner`, a frozen class, holds by an `Arc`. The array keeps
    // `owner` alive, the numbers are never moved or changed while it lives, and numpy is told not to write.
    let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from(numbers), owner) };
    let read_only: Bound<'py, PyDict> = [("write", false)].into_py_dict(py)?;
    array.call_method("setflags", (), Some(&read_only))?;
    Ok(array)
}
