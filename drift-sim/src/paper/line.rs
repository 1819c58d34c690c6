//! The line `J_e = b0 + b1 E_u` (equations 4 and 6) by [`crate::calibrate::regression`], with its plain intervals and
//! bands as the paper has them: they take the windows as independent, which overlapping ones are not.

use drift_core::Baseline;

use super::settings::HOPS_PER_WINDOW;
use crate::Result;
use crate::calibrate::regression::{self, Fit};

/// Fits (x, value), window by window in their order.
///
/// # Errors
/// Fewer than three windows.
pub(super) fn fit(points: &[(f64, f64)]) -> Result<Fit> {
    let (x, value): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    regression::fit(&x, &value, HOPS_PER_WINDOW)
}

/// For the monitor, with the line's own uncertainty.
pub(super) fn baseline(line: &Fit) -> Baseline {
    Baseline {
        windows: line.n as f32,
        x_mean: line.x_mean as f32,
        x_ss: line.x_ss as f32,
        ..known_baseline(line)
    }
}

/// For the monitor, taken as exactly known.
pub(super) fn known_baseline(line: &Fit) -> Baseline {
    Baseline::known(line.b0 as f32, line.b1 as f32, line.rmse as f32)
}

/// Correlation of a series with itself one step later.
pub(super) fn lag1(series: &[f64]) -> f64 {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    let centred = || series.iter().map(|v| v - mean);
    let products: f64 = centred().zip(centred().skip(1)).map(|(a, b)| a * b).sum();
    products / centred().map(|v| v * v).sum::<f64>()
}
