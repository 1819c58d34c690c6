//! Equation 13: the eigenvalues of the plant of equations 11 and 12 after zero-order hold at 1 ms.

use nalgebra::DMatrix;

use super::settings::SAMPLE_TIME_S;
use crate::control_loop::Loop;
use crate::plant::zero_order_hold::discretise;
use crate::{Error, Result};

/// (real, imaginary), the complex pair first, its upper half before its lower one.
///
/// # Errors
/// The plant can't be discretised, which the paper's can.
pub fn eigenvalues() -> Result<Vec<(f64, f64)>> {
    let plant = Loop::paper().plant.linear()?.ok_or_else(|| Error::new("the plant has no linear model"))?;
    let held = discretise(&plant, SAMPLE_TIME_S)?;
    let n = plant.order();
    let phi = DMatrix::from_row_slice(n, n, &held.phi);
    let mut found: Vec<_> = phi.complex_eigenvalues().iter().map(|v| (v.re, v.im)).collect();
    found.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(b.1.total_cmp(&a.1)));
    Ok(found)
}
