//! Detectors designed on paper.

use drift_sim::design::{self as library, DetectorKind, Request};
use pyo3::prelude::*;

use crate::calibration::one_of;
use crate::{interrupt, page};

/// A designed detector.
#[pyclass(frozen, module = "drift._drift")]
pub struct Design(library::Design);

#[pymethods]
impl Design {
    fn to_json(&self) -> PyResult<String> {
        page::text(&self.0.to_json())
    }
}

/// Designs a detector.
#[pyfunction]
#[pyo3(signature = (
    detector, *, k, lambda_, h, arl0, shift, head_start, slope, one_sided, windows, confidence, mission, hop_s, ratio, beta
))]
#[expect(clippy::too_many_arguments, reason = "they are Python's keywords")]
pub fn design(
    py: Python<'_>,
    detector: &str,
    k: Option<f64>,
    lambda_: Option<f64>,
    h: Option<f64>,
    arl0: Option<f64>,
    shift: Option<f64>,
    head_start: Option<f64>,
    slope: Option<f64>,
    one_sided: bool,
    windows: Option<f64>,
    confidence: Option<f64>,
    mission: Option<u64>,
    hop_s: Option<f64>,
    ratio: Option<f64>,
    beta: Option<f64>,
) -> PyResult<Design> {
    let request = Request {
        detector: one_of("detector", detector, &DetectorKind::ALL)?,
        k,
        lambda: lambda_,
        h,
        arl0,
        shift,
        head_start,
        slope,
        one_sided,
        windows,
        confidence,
        mission,
        hop_s,
        ratio,
        beta,
    };
    interrupt::run(py, move || request.design()).map(Design)
}
