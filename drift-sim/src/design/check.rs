//! What a design may be asked for: each refusal says what is allowed.

use super::cusum::{LARGEST_ARL0, LARGEST_H, LARGEST_K};
use crate::sentences::typed;
use crate::{Error, Result};

/// The slowest drift whose run length is computed, in sigmas a decision.
pub const SMALLEST_SLOPE: f64 = 1e-5;
/// The fastest one.
pub const LARGEST_SLOPE: f64 = 100.0;
/// The largest shift that is computed, in sigmas.
pub const LARGEST_SHIFT: f64 = 100.0;

fn within(name: &str, value: f64, fine: bool, allowed: impl Into<String>) -> Result<()> {
    if fine {
        return Ok(());
    }
    Err(Error::new(format!("{name} is {}", typed(value))).allowed(allowed))
}

pub(crate) fn k(k: f64) -> Result<()> {
    within("k", k, (0.0..=LARGEST_K).contains(&k), format!("0 to {LARGEST_K}"))
}

pub(crate) fn h(h: f64) -> Result<()> {
    within("h", h, h > 0.0 && h <= LARGEST_H, format!("above 0, up to {LARGEST_H}"))
}

pub(crate) fn head_start(fraction: f64) -> Result<()> {
    let fine = (0.0..1.0).contains(&fraction);
    within("head start", fraction, fine, "a fraction of h: 0 to below 1")
}

pub(crate) fn arl0(arl0: f64) -> Result<()> {
    let fine = arl0 > 1.0 && arl0 <= LARGEST_ARL0;
    within("arl0", arl0, fine, format!("above 1, up to {LARGEST_ARL0:e} decisions"))
}

pub(crate) fn slope(slope: f64) -> Result<()> {
    let fine = (SMALLEST_SLOPE..=LARGEST_SLOPE).contains(&slope);
    within("slope", slope, fine, format!("{SMALLEST_SLOPE} to {LARGEST_SLOPE} sigmas a decision"))
}

pub(crate) fn probability(name: &str, value: f64) -> Result<()> {
    within(name, value, value > 0.0 && value < 1.0, "between 0 and 1")
}

/// A shift of the mean, in sigmas.
///
/// # Errors
/// It is not a number within plus or minus [`LARGEST_SHIFT`].
pub fn shift(shift: f64) -> Result<()> {
    within(
        "shift",
        shift,
        shift.abs() <= LARGEST_SHIFT,
        format!("-{LARGEST_SHIFT} to {LARGEST_SHIFT} sigmas"),
    )
}
