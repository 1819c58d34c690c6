//! 95 % intervals of the fitted parameters.
//!
//! Three sources, H = J'J of the whitened residual w:
//! * the curvature of the sum of squares, `s^2 H^-1`, widened by the correlation that is left in w;
//! * the same with the scatter of the gradient itself over contiguous blocks, `H^-1 (sum g_b g_b') H^-1` with `g_b` the sum of
//!   J'w over a block (a sandwich: it holds for noise that is neither white nor of constant size). The wider one counts;
//! * the simulation's own uncertainty: by how much the parameters would move if y were sampled a quarter of a sample
//!   (one sub-step) earlier or later, and if terms that act along the way were simulated without sub-steps. Clean recordings
//!   are more exact than any choice of how to discretise, so this is added as an independent part.
//!
//! They hold for a model whose terms are the right ones.

use nalgebra::{DMatrix, DVector};

use super::fit::Fit;
use super::signals::Signals;
use super::whiten::effective_samples;

/// Blocks of the sandwich.
const BLOCKS: usize = 24;
/// Student's 97.5 % point for as many blocks less one.
const STUDENT: f64 = 2.07;
/// Timing that is uncertain, in samples.
const TIMING: f64 = 0.25;

/// The inverse curvature in units of the columns' lengths.
struct Curvature {
    /// Free parameters with an effect.
    alive: Vec<usize>,
    /// Columns of the Jacobian of length one.
    scaled: DMatrix<f64>,
    lengths: Vec<f64>,
    inverse: DMatrix<f64>,
    /// Whether the recording says nothing of a parameter.
    open: Vec<bool>,
}

impl Curvature {
    fn of(jacobian: &DMatrix<f64>) -> Self {
        let all: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
        let alive: Vec<usize> =
            all.iter().enumerate().filter(|(_, length)| **length > 0.0).map(|(i, _)| i).collect();
        let lengths: Vec<f64> = alive.iter().filter_map(|i| all.get(*i).copied()).collect();
        let mut scaled = jacobian.select_columns(&alive);
        for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        let parts = scaled.tr_mul(&scaled).symmetric_eigen();
        let largest = parts.eigenvalues.max();
        let mut inverse = DMatrix::zeros(alive.len(), alive.len());
        let mut open = vec![false; alive.len()];
        for (value, vector) in parts.eigenvalues.iter().zip(parts.eigenvectors.column_iter()) {
            if *value > 1e-13 * largest {
                inverse += vector * vector.transpose() / *value;
            } else {
                // Directions that the recording does not determine make their parameters infinite, not small.
                open.iter_mut().zip(vector.iter()).for_each(|(open, part)| *open |= part * part > 1e-6);
            }
        }
        Self { alive, scaled, lengths, inverse, open }
    }

    /// How far the parameters move for this change of the whitened residual.
    fn moved_by(&self, change: &[f64]) -> DVector<f64> {
        &self.inverse * self.scaled.tr_mul(&DVector::from_column_slice(change))
    }

    /// Covariance from the scatter of the gradient over blocks.
    fn sandwich(&self, white: &[f64]) -> DMatrix<f64> {
        let n = self.alive.len();
        let length = (white.len() / BLOCKS).max(1);
        let mut meat = DMatrix::zeros(n, n);
        for from in (0..white.len()).step_by(length) {
            let rows = length.min(white.len() - from);
            let part = DVector::from_iterator(rows, white.iter().skip(from).take(rows).copied());
            let gradient = self.scaled.rows(from, rows).tr_mul(&part);
            meat += &gradient * gradient.transpose();
        }
        &self.inverse * meat * &self.inverse
    }
}

/// Half width of a 95 % interval for each free parameter; infinite where the recording says nothing of it.
pub fn half_widths(fit: &Fit, signals: &Signals) -> Vec<f64> {
    let mut widths = vec![f64::INFINITY; fit.model.x.len()];
    let Some(jacobian) = fit.derivative(signals) else { return widths };
    let curvature = Curvature::of(&jacobian);
    let white = fit.white();
    let inflation = white.len() as f64 / effective_samples(&white);
    let sandwich = curvature.sandwich(&white);
    let numerical: Vec<DVector<f64>> =
        numerical_changes(fit, signals).iter().map(|change| curvature.moved_by(change)).collect();
    for (row, i) in curvature.alive.iter().enumerate() {
        if curvature.open.get(row).copied().unwrap_or(true) {
            continue;
        }
        let diagonal = |m: &DMatrix<f64>| m.get((row, row)).copied().unwrap_or(f64::INFINITY).max(0.0);
        let curved = 1.96 * libm::sqrt(fit.variance * inflation * diagonal(&curvature.inverse));
        let blocks = STUDENT * libm::sqrt(diagonal(&sandwich));
        let statistical = curved.max(blocks);
        let own: f64 = numerical.iter().filter_map(|moved| moved.get(row)).map(|m| m * m).sum();
        let length = curvature.lengths.get(row).copied().unwrap_or(1.0);
        if let Some(width) = widths.get_mut(*i) {
            *width = libm::sqrt(statistical * statistical + own) / length;
        }
    }
    widths
}

/// Changes of the whitened residual by what the discretisation leaves open.
fn numerical_changes(fit: &Fit, signals: &Signals) -> Vec<Vec<f64>> {
    let Some(fine) = fit.model.predict(&fit.model.x, signals) else { return Vec::new() };
    let earlier = fine.first().copied().into_iter().chain(fine.iter().copied());
    let late: Vec<f64> = fine.iter().zip(earlier).map(|(now, before)| TIMING * (now - before)).collect();
    let mut changes = vec![fit.whitener.apply(&late)];
    if let Some(coarse) = fit.model.predict_with(&fit.model.x, signals, 1) {
        let change: Vec<f64> = fine.iter().zip(&coarse).map(|(fine, coarse)| fine - coarse).collect();
        if change.iter().any(|c| *c != 0.0) {
            changes.push(fit.whitener.apply(&change));
        }
    }
    changes
}
