//! Nonlinear least squares of a model's free parameters on the whitened prediction error of y.
//!
//! A bounded Levenberg-Marquardt with finite differences: the simulator is fixed-step and deterministic, so
//! differences are clean, and a step that leaves a range or diverges is just a bad step. Differences are taken wide
//! for parameters in which the prediction is only piecewise smooth (gaps, delays, onsets).

use crate::cores::AcrossCores as _;
use nalgebra::{DMatrix, DVector};

use super::model::{Free, Model, Target};
use super::signals::Signals;
use super::whiten::Whitener;

/// Width of a difference, as a part of the parameter's scale.
const NARROW: f64 = 1e-4;
const WIDE: f64 = 1e-2;

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The model, its point being the best found.
    pub model: Model,
    /// Measured less predicted y there.
    pub residual: Vec<f64>,
    /// The noise model of that residual.
    pub whitener: Whitener,
    /// Variance of the whitened residual.
    pub variance: f64,
    /// Log-likelihood of y, up to a constant that all models of the recording share.
    pub log_likelihood: f64,
    /// Derivative of the whitened residual by each free parameter at the point; empty until asked for.
    pub jacobian: Option<DMatrix<f64>>,
}

/// How long to search.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Steps of the search.
    pub steps: usize,
    /// Relative improvement of the sum of squares at which it stops.
    pub enough: f64,
}

impl Effort {
    /// A first look.
    pub const LOOK: Self = Self { steps: 4, enough: 1e-3 };
    /// To the end.
    pub const FULL: Self = Self { steps: 20, enough: 2e-6 };
    /// One step, to compare starting points.
    pub const STEP: Self = Self { steps: 1, enough: 1e-3 };
}

impl Fit {
    /// Starts at the model's own point; `None` where that can't be predicted.
    pub fn start(model: &Model, signals: &Signals, whitener: &Whitener) -> Option<Self> {
        let residual = model.residual(&model.x, signals)?;
        Some(Self::at(model.clone(), residual, whitener.clone()))
    }

    fn at(model: Model, residual: Vec<f64>, whitener: Whitener) -> Self {
        let white = whitener.apply(&residual);
        let variance = mean_square(&white).max(1e-300);
        let log_likelihood = -0.5 * white.len() as f64 * libm::log(variance);
        Self { model, residual, whitener, variance, log_likelihood, jacobian: None }
    }

    /// The whitened residual.
    pub fn white(&self) -> Vec<f64> {
        self.whitener.apply(&self.residual)
    }

    /// The same point under another noise model.
    #[must_use]
    pub fn with_whitener(self, whitener: Whitener) -> Self {
        Self::at(self.model, self.residual, whitener)
    }

    /// The same point under the noise model of its own residual, where the model whitens.
    #[must_use]
    pub fn renoised(self) -> Self {
        let whitener = self.noise_model();
        self.with_whitener(whitener)
    }

    fn noise_model(&self) -> Whitener {
        if self.model.whitens() { Whitener::of(&self.residual) } else { Whitener::none() }
    }

    /// Searched to the end on the error as it is ([`Model::plain`]).
    #[must_use]
    pub fn plain(self, signals: &Signals) -> Self {
        self.unwhitened().search(signals, Effort::FULL)
    }

    /// The same point, judged by the error as it is.
    #[must_use]
    pub fn unwhitened(self) -> Self {
        let fit = Self { model: self.model.plain(), ..self };
        fit.with_whitener(Whitener::none())
    }

    /// Searches on from here with the noise model as it is.
    #[must_use]
    pub fn search(mut self, signals: &Signals, effort: Effort) -> Self {
        let mut damping = 1e-3;
        for _ in 0..effort.steps {
            let Some(jacobian) = jacobian(&self, signals) else { return self };
            let before = self.variance;
            let Some(next) = step(&self, &jacobian, signals, &mut damping) else { return self };
            self = next;
            if before - self.variance < effort.enough * before {
                return self;
            }
        }
        self
    }

    /// Alternates between noise model and parameters until the likelihood stands.
    #[must_use]
    pub fn settle(mut self, signals: &Signals, effort: Effort) -> Self {
        for _ in 0..3 {
            let whitener = self.noise_model();
            let again = Self::at(self.model.clone(), self.residual.clone(), whitener).search(signals, effort);
            let gained = again.log_likelihood - self.log_likelihood;
            let better = again.log_likelihood > self.log_likelihood || again.whitener != self.whitener;
            if better {
                self = again;
            }
            if gained.abs() < 0.5 {
                break;
            }
        }
        // The noise model belongs to the final residual.
        self.renoised()
    }

    /// The same without its term of this place among the loop's, refitted.
    pub fn without_term(&self, term: usize, signals: &Signals) -> Option<Self> {
        let started = Self::start(&self.model.without_term(term), signals, &self.whitener)?;
        Some(started.search(signals, Effort::FULL).settle(signals, Effort::FULL))
    }

    /// Derivative of the whitened residual at the point.
    pub fn derivative(&self, signals: &Signals) -> Option<DMatrix<f64>> {
        jacobian(self, signals)
    }

    /// Value of the free parameter of this target.
    pub fn value(&self, target: Target) -> Option<f64> {
        self.model.free.iter().zip(&self.model.x).find(|(f, _)| f.target == target).map(|(_, x)| *x)
    }
}

/// Mean of squares.
pub fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64
}

/// The step of a difference for a parameter at `value`.
fn difference(free: &Free, value: f64, sample_time_s: f64) -> f64 {
    let size = free.scale.abs().max(value.abs()).max(1e-12);
    match free.target {
        // An onset acts from a sample on: closer than some samples nothing changes.
        Target::Onset(_) => (2e-3 * free.scale).max(4.0 * sample_time_s),
        _ if free.name.ends_with("delay_s") => (0.2 * sample_time_s).max(NARROW * size),
        Target::Term { .. } if coarse(&free.name) => WIDE * size,
        _ => NARROW * size,
    }
}

/// Parameters in which the prediction jumps.
pub(super) fn coarse(name: &str) -> bool {
    ["width", "stick_band", "slip_jump", "half_width", "step"].iter().any(|end| name.ends_with(end))
}

fn jacobian(fit: &Fit, signals: &Signals) -> Option<DMatrix<f64>> {
    let rows = fit.residual.len() - fit.whitener.order();
    let column = |(i, free): (usize, &Free)| {
        let at = fit.model.x.get(i).copied().unwrap_or(0.0);
        let h = difference(free, at, signals.sample_time_s);
        let moved = [h, -h].into_iter().find_map(|h| {
            let mut x = fit.model.x.clone();
            *x.get_mut(i)? += h;
            fit.model.residual(&x, signals).map(|residual| (h, residual))
        });
        match moved {
            Some((h, residual)) => {
                let change: Vec<f64> = residual.iter().zip(&fit.residual).map(|(a, b)| (a - b) / h).collect();
                DVector::from_vec(fit.whitener.apply(&change))
            }
            None => DVector::zeros(rows),
        }
    };
    let columns: Vec<DVector<f64>> = fit.model.free.par_iter().enumerate().map(column).collect();
    if columns.is_empty() { None } else { Some(DMatrix::from_columns(&columns)) }
}

/// One damped step that lowers the sum of squares; `None` when none is found.
fn step(fit: &Fit, jacobian: &DMatrix<f64>, signals: &Signals, damping: &mut f64) -> Option<Fit> {
    let white = DVector::from_vec(fit.white());
    // Columns of length one: parameters differ by many orders of magnitude. One without effect stays where it is.
    let lengths: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    let inverse = |i: usize| if lengths[i] > 0.0 { 1.0 / lengths[i] } else { 0.0 };
    let mut scaled = jacobian.clone();
    for (i, mut column) in scaled.column_iter_mut().enumerate() {
        column *= inverse(i);
    }
    let normal = scaled.tr_mul(&scaled);
    let gradient = scaled.tr_mul(&white);
    for _ in 0..8 {
        let mut damped = normal.clone();
        for i in 0..damped.nrows() {
            damped[(i, i)] += *damping + 1e-12;
        }
        if let Some(cholesky) = damped.cholesky() {
            let mut change = cholesky.solve(&gradient);
            for (i, c) in change.iter_mut().enumerate() {
                *c *= inverse(i);
            }
            let x: Vec<f64> = (fit.model.x.iter().zip(&fit.model.free).zip(change.iter()))
                .map(|((x, free), change)| clamp(free, x - change))
                .collect();
            if let Some(residual) = fit.model.residual(&x, signals) {
                let next = Fit::at(fit.model.at(&x), residual, fit.whitener.clone());
                if next.variance < fit.variance {
                    *damping = (*damping * 0.2).max(1e-9);
                    return Some(next);
                }
            }
        }
        *damping *= 6.0;
    }
    None
}

/// Into the range, a little inside an open end.
fn clamp(free: &Free, x: f64) -> f64 {
    use crate::physics::Range;
    match free.range {
        Range::Any => x,
        Range::Positive => x.max(1e-6 * free.scale.abs()),
        Range::NotNegative => x.max(0.0),
        Range::Between(lowest, highest) => x.clamp(lowest, highest),
    }
}
