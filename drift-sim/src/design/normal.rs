//! The standard normal law, with both tails at full relative precision: a run length of 1e12 hangs on one of 1e-12.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// The density at `x`.
pub(crate) fn density(x: f64) -> f64 {
    libm::exp(-0.5 * x * x) / (2.0 * PI).sqrt()
}

/// P(Z <= x).
pub(crate) fn below(x: f64) -> f64 {
    0.5 * libm::erfc(-x * FRAC_1_SQRT_2)
}

/// P(Z > x).
pub(crate) fn above(x: f64) -> f64 {
    0.5 * libm::erfc(x * FRAC_1_SQRT_2)
}
