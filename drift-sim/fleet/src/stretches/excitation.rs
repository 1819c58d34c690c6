//! Stretches that a model can be learnt from: r moves (by hand: u moves), and what y does next follows from it beyond what y's own past
//! says. Bittencourt et al. ask the same three things: does the input vary, are the normal equations well conditioned, and is the input a cause of
//! the output (Granger), in a model of Laguerre filters that needs no time constant or dead time to be known.
//!
//! `y(t) = a1 y(t-1) + a2 y(t-2) + b1 L1(t) + ... + b4 L4(t) + c`, by least squares with a memory of a thousand samples, for three poles of
//! the filters side by side; Wald's statistic of `b = 0` is compared with chi squared.

use nalgebra::{SMatrix, SVector};

use super::{Kind, LEAST_SAMPLES, Stretch};

/// Samples that the estimate remembers.
const MEMORY: f64 = 1000.0;
/// The input counts as moving for so long after it has moved.
const MOVING: u64 = 500;
/// Samples from one test to the next.
const EVERY: u64 = 50;
/// Filters of a bank.
const ORDER: usize = 4;
/// Of the model.
const TERMS: usize = ORDER + 3;
/// Poles of the banks: time constants of 5, 20 and 100 samples.
const POLES: [f64; 3] = [0.8, 0.95, 0.99];
/// Wald's statistic from which on the input is a cause: chi squared of four degrees of freedom at 1e-6 is 33; tests follow each other and
/// overlap.
const CLEAR: f64 = 40.0;
/// The least ratio of the scaled normal matrix' smallest pivot to its largest that counts as well conditioned.
const CONDITION: f64 = 1e-9;

/// One bank of filters and the least squares on it.
#[derive(Debug, Clone)]
struct Model {
    pole: f64,
    filters: [f64; ORDER],
    normal: SMatrix<f64, TERMS, TERMS>,
    right: SVector<f64, TERMS>,
    power: f64,
    weight: f64,
}

impl Model {
    fn new(pole: f64) -> Self {
        Self {
            pole,
            filters: [0.0; ORDER],
            normal: SMatrix::zeros(),
            right: SVector::zeros(),
            power: 0.0,
            weight: 0.0,
        }
    }

    /// The input that was applied before this y, and the two y before.
    fn sample(&mut self, input: f64, past: [f64; 2], y: f64) {
        let a = self.pole;
        let mut enters = (1.0 - a * a).sqrt() * input;
        let mut before = 0.0;
        for (k, filter) in self.filters.iter_mut().enumerate() {
            let old = *filter;
            // The first is a low pass; each further one is the one before through an all-pass (z^-1 - a)/(1 - a z^-1).
            let new = if k == 0 { a * old + enters } else { a * old + before - a * enters };
            (before, enters) = (old, new);
            *filter = new;
        }
        let [l1, l2, l3, l4] = self.filters;
        let row = SVector::<f64, TERMS>::from([past[0], past[1], l1, l2, l3, l4, 1.0]);
        let keep = 1.0 - 1.0 / MEMORY;
        self.normal = self.normal * keep + row * row.transpose();
        self.right = self.right * keep + row * y;
        self.power = self.power * keep + y * y;
        self.weight = self.weight * keep + 1.0;
    }

    /// Wald's statistic of the filters' coefficients being all zero; `None` where the equations are badly conditioned.
    fn wald(&self) -> Option<f64> {
        // Scaled to ones on the diagonal, so that units don't count.
        let scale = self.normal.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 });
        let scaled = SMatrix::<f64, TERMS, TERMS>::from_fn(|i, j| self.normal[(i, j)] * scale[i] * scale[j]);
        let factor = scaled.cholesky()?;
        let pivots = factor.l().diagonal().map(|p| p * p);
        if pivots.min() < CONDITION * pivots.max() {
            return None;
        }
        let right = self.right.component_mul(&scale);
        let found = factor.solve(&right);
        let left = (self.power - found.dot(&right)).max(0.0);
        let variance = left / (self.weight - TERMS as f64).max(1.0);
        let covariance = factor.inverse();
        let b = found.fixed_rows::<ORDER>(2).into_owned();
        let of_b = covariance.fixed_view::<ORDER, ORDER>(2, 2).into_owned();
        let wald = b.dot(&of_b.cholesky()?.solve(&b)) / variance;
        wald.is_finite().then_some(wald)
    }
}

/// Looks for it.
#[derive(Debug, Clone)]
pub(super) struct Excitation {
    models: [Model; POLES.len()],
    input: Option<f64>,
    by_hand: bool,
    /// About these levels, so that a large offset costs no digits.
    levels: [f64; 2],
    past: [f64; 2],
    since_move: u64,
    seen: u64,
    open: Option<(Stretch, u64)>,
}

impl Excitation {
    pub fn new() -> Self {
        Self {
            models: POLES.map(Model::new),
            input: None,
            by_hand: false,
            levels: [0.0; 2],
            past: [0.0; 2],
            since_move: u64::MAX,
            seen: 0,
            open: None,
        }
    }

    /// `input` is r, or u by hand.
    #[expect(clippy::float_cmp, reason = "an input that stands still is the same number")]
    pub fn sample(&mut self, t_s: f64, input: f64, y: f64, by_hand: bool) -> Option<Stretch> {
        let mut found = None;
        if self.input.is_none() || by_hand != self.by_hand {
            found = self.end();
            *self = Self { levels: [input, y], by_hand, input: Some(input), ..Self::new() };
        }
        let before = self.input.replace(input).unwrap_or(input);
        self.since_move = if before == input { self.since_move.saturating_add(1) } else { 0 };
        self.seen += 1;
        let (v, y) = (before - self.levels[0], y - self.levels[1]);
        if self.seen > 2 {
            let past = self.past;
            self.models.iter_mut().for_each(|model| model.sample(v, past, y));
        }
        self.past = [y, self.past[0]];
        if self.since_move > MOVING {
            return found.or_else(|| self.end());
        }
        let fresh = Stretch { kind: Kind::Excitation, from_s: t_s, to_s: t_s, score: 0.0 };
        let (stretch, samples) = self.open.get_or_insert((fresh, 0));
        stretch.to_s = t_s;
        *samples += 1;
        if samples.is_multiple_of(EVERY) {
            let clear = self.models.iter().filter_map(Model::wald).fold(stretch.score, f64::max);
            stretch.score = clear;
        }
        found
    }

    pub fn end(&mut self) -> Option<Stretch> {
        let (stretch, samples) = self.open.take()?;
        (samples >= LEAST_SAMPLES && stretch.score >= CLEAR).then_some(stretch)
    }
}
