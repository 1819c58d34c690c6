//! The library's errors as Python's.

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;

create_exception!(
    drift,
    DriftError,
    PyValueError,
    "Input that was refused. Its text is the one line that the command `drift` prints: where, what is wrong; what is allowed."
);

/// The same line.
pub fn raised(error: drift_sim::Error) -> PyErr {
    DriftError::new_err(error.to_string())
}
