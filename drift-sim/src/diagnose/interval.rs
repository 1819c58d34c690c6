//! 95 % intervals of the fitted parameters.
//!
//! From the curvature of the sum of squares of the whitened residual, widened by what correlation is left in it: they
//! hold for a noise that an autoregression describes, and for a model whose other terms are right.

use super::fit::Fit;
use super::signals::Signals;
use super::whiten::effective_samples;

/// Half width of a 95 % interval for each free parameter; infinite where the recording says nothing of it.
pub fn half_widths(fit: &Fit, signals: &Signals) -> Vec<f64> {
    let nothing = || vec![f64::INFINITY; fit.model.x.len()];
    let Some(jacobian) = fit.derivative(signals) else { return nothing() };
    let lengths: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    let alive: Vec<usize> =
        (0..lengths.len()).filter(|i| lengths.get(*i).is_some_and(|l| *l > 0.0)).collect();
    let mut scaled = jacobian.select_columns(&alive);
    for (mut column, i) in scaled.column_iter_mut().zip(&alive) {
        column /= lengths.get(*i).copied().unwrap_or(1.0);
    }
    let decomposition = scaled.tr_mul(&scaled).symmetric_eigen();
    let largest = decomposition.eigenvalues.max();
    let white = fit.white();
    let inflation = white.len() as f64 / effective_samples(&white);
    let mut widths = nothing();
    for (row, i) in alive.iter().enumerate() {
        // Directions that the recording does not determine make their parameters infinite, not small.
        let variance: f64 = decomposition
            .eigenvalues
            .iter()
            .zip(decomposition.eigenvectors.column_iter())
            .map(|(value, vector)| {
                let part = vector[row] * vector[row];
                if *value > 1e-13 * largest {
                    part / value
                } else if part > 1e-6 {
                    f64::INFINITY
                } else {
                    0.0
                }
            })
            .sum();
        let length = lengths.get(*i).copied().unwrap_or(1.0);
        if let Some(width) = widths.get_mut(*i) {
            *width = 1.96 * libm::sqrt(fit.variance * inflation * variance) / length;
        }
    }
    widths
}
