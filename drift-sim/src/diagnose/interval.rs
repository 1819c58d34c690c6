//! 95 % intervals of the fitted parameters.
//!
//! Three sources, H = J'J of the whitened residual w:
//! * the curvature of the sum of squares, `s^2 H^-1`, widened by the correlation that is left in w;
//! * the same with the scatter of the gradient itself over contiguous blocks, `H^-1 (sum g_b g_b') H^-1` with `g_b` the sum of
//!   J'w over a block (a sandwich: it holds for noise that is neither white nor of constant size). The wider one counts;
//! * the simulation's own uncertainty: by how much the parameters would move if y were sampled half a sample
//!   earlier or later (by which ways to discretise differ), and if terms that act along the way were simulated without sub-steps. Clean recordings
//!   are more exact than any choice of how to discretise, so this is added as an independent part, in a fit without
//!   a noise model as far as the closed loop does not rule it out. (With one, that limit took the share of intervals that hold the
//!   truth from 0.94 to 0.81 on generated loops.)
//!
//! For parameters in which the prediction jumps (gaps, bands) the likelihood itself is followed to where it has fallen by half of chi
//! squared, the farther side counting.
//!
//! They hold for a model whose terms are the right ones.

use crate::cores::AcrossCores as _;
use nalgebra::{DMatrix, DVector};

use super::closed_loop::error_at;
use super::fit::{Fit, coarse};
use super::signals::Signals;
use super::whiten::effective_samples;

/// Blocks of the sandwich.
const BLOCKS: usize = 24;
/// Student's 97.5 % point for as many blocks less one.
const STUDENT: f64 = 2.07;
/// The 95 % point of chi squared of one degree of freedom.
const CHI_SQUARED: f64 = 3.84;
/// Steps of a profile: the smallest, as a part of the parameter, and how many, each 1.4 times the one before.
const PROFILE_FROM: f64 = 1e-5;
const PROFILE_STEPS: u32 = 28;
/// Factor by which the closed loop's squared error may grow for it to have stayed where it is, and halvings tried.
const FURTHER: f64 = 1.1;
const HALVINGS: u32 = 12;
/// Timing that is uncertain, in samples.
const TIMING: f64 = 0.5;

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
    let numerical: Vec<DVector<f64>> = numerical_changes(fit, signals)
        .iter()
        .map(|change| curvature.moved_by(change))
        .map(
            |moved| {
                if fit.model.whitens() { moved } else { within_the_loop(fit, &curvature, &moved, signals) }
            },
        )
        .collect();
    for (row, i) in curvature.alive.iter().enumerate() {
        if curvature.open.get(row).copied().unwrap_or(true) {
            continue;
        }
        let diagonal = |m: &DMatrix<f64>| m.get((row, row)).copied().unwrap_or(f64::INFINITY).max(0.0);
        let curved = 1.96 * libm::sqrt(fit.variance * inflation * diagonal(&curvature.inverse));
        let blocks = STUDENT * libm::sqrt(diagonal(&sandwich));
        let statistical = curved.max(blocks);
        let profile = profile(fit, *i, &curvature, inflation, signals)
            * curvature.lengths.get(row).copied().unwrap_or(1.0);
        let statistical = statistical.max(profile);
        let own: f64 = numerical.iter().filter_map(|moved| moved.get(row)).map(|m| m * m).sum();
        let length = curvature.lengths.get(row).copied().unwrap_or(1.0);
        if let Some(width) = widths.get_mut(*i) {
            *width = libm::sqrt(statistical * statistical + own) / length;
        }
    }
    widths
}

/// As much of a move of the parameters as leaves the closed loop where it is. To a stiffly observed plant a shift in time looks like friction;
/// the loop pays for friction with u, and for a shift in time with nothing.
fn within_the_loop(
    fit: &Fit,
    curvature: &Curvature,
    moved: &DVector<f64>,
    signals: &Signals,
) -> DVector<f64> {
    let error_beside = |part: f64| {
        let mut x = fit.model.x.clone();
        for ((i, length), moved) in curvature.alive.iter().zip(&curvature.lengths).zip(moved.iter()) {
            if let Some(value) = x.get_mut(*i) {
                *value += part * moved / length;
            }
        }
        error_at(&fit.model.at(&x), signals)
    };
    let Some(here) = error_at(&fit.model, signals) else { return moved.clone() };
    let stays = |part: f64| {
        [part, -part]
            .iter()
            .any(|part| error_beside(*part).is_some_and(|there| there * there < FURTHER * here * here))
    };
    let parts = (0..HALVINGS).map(|i| libm::pow(0.5, f64::from(i)));
    moved * parts.into_iter().find(|part| stays(*part)).unwrap_or(0.0)
}

/// How far a parameter in which the prediction jumps can be moved, on the farther side, before the likelihood tells: such a
/// likelihood is rough, and its curvature at the best point says little. The others follow by their best linear step. 0 for smooth ones.
fn profile(fit: &Fit, index: usize, curvature: &Curvature, inflation: f64, signals: &Signals) -> f64 {
    let (Some(free), Some(at)) = (fit.model.free.get(index), fit.model.x.get(index)) else { return 0.0 };
    if !coarse(&free.name) || *at == 0.0 {
        return 0.0;
    }
    let others: Vec<usize> =
        (0..curvature.alive.len()).filter(|row| curvature.alive.get(*row) != Some(&index)).collect();
    let others = curvature.scaled.select_columns(&others).qr().q();
    let left = |white: Vec<f64>| {
        let white = DVector::from_vec(white);
        white.norm_squared() - others.tr_mul(&white).norm_squared()
    };
    let limit = left(fit.white()) + CHI_SQUARED * fit.variance * inflation;
    let inside = |step: f64| {
        let mut x = fit.model.x.clone();
        if let Some(value) = x.get_mut(index) {
            *value += step;
        }
        let residual = fit.model.residual(&x, signals);
        residual.is_some_and(|residual| left(fit.whitener.apply(&residual)) < limit)
    };
    let steps: Vec<f64> = (0..PROFILE_STEPS)
        .flat_map(|i| [1.0, -1.0].map(|side| side * at * PROFILE_FROM * libm::pow(2.0, f64::from(i) / 2.0)))
        .collect();
    steps.into_par_iter().map(|step| if inside(step) { step.abs() } else { 0.0 }).fold(0.0, f64::max)
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
