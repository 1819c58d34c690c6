//! Shapes of linear plants and their first fit: gain, offset and start by least squares once the lags and the dead time are
//! given, for y is linear in all of them (separable least squares; Golub & Pereyra 1973).

use nalgebra::{DMatrix, DVector};

use crate::estimate::inner_product::dot;
use crate::plant::{FirstOrder, Plant, TransferFunction};

use super::fit::mean_square;
use super::signals::Signals;
use super::whiten::Whitener;

/// The least dead time of a plant with more than one lag, in samples: from there a search can move it either way.
const LEAST_DELAY: f64 = 0.25;

/// Lags in series, an integrator if wanted, and a dead time.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearShape {
    /// Time constants in seconds, each > 0.
    pub lags_s: Vec<f64>,
    /// Whether the plant integrates.
    pub integrates: bool,
    /// Dead time in samples.
    pub delay: usize,
}

/// Order of the noise model.
const NOISE_ORDER: usize = 8;
/// Rounds in which noise model and coefficients take turns.
const ROUNDS: usize = 4;

/// A shape with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeFit {
    /// The plant.
    pub plant: Plant,
    /// Mean square of what it leaves of y.
    pub variance: f64,
}

impl LinearShape {
    /// The best gain, offset and start on y under the drive `v` (u, or what reaches the plant of it); `None` where v does not
    /// move y.
    pub fn fit(&self, signals: &Signals, v: &[f64]) -> Option<ShapeFit> {
        let y0 = *signals.y.iter().find(|y| y.is_finite())?;
        let columns = self.columns(signals.sample_time_s, v)?;
        let error: Vec<f64> = signals.y.iter().map(|y| y - y0).collect();
        let (solved, variance) = least_squares(&columns, &error)?;
        Some(ShapeFit { plant: self.plant(&solved, y0, *v.first()?, signals.sample_time_s)?, variance })
    }

    /// The same in coloured noise, its autoregression found beside: the plant and the log-likelihood of y, up to a constant that
    /// all shapes share. y must be whole.
    pub fn likelihood(&self, signals: &Signals, v: &[f64]) -> Option<(f64, Plant)> {
        let y0 = *signals.y.first()?;
        let columns = self.columns(signals.sample_time_s, v)?;
        let error: Vec<f64> = signals.y.iter().map(|y| y - y0).collect();
        let mut whitener = Whitener::none();
        let mut solved = Vec::new();
        for _ in 0..ROUNDS {
            let white: Vec<Vec<f64>> = columns.iter().map(|column| whitener.apply(column)).collect();
            solved = least_squares(&white, &whitener.apply(&error))?.0;
            whitener = Whitener::least_squares(&left(&columns, &solved, &error), NOISE_ORDER);
        }
        let white = whitener.apply(&left(&columns, &solved, &error));
        let likelihood = -0.5 * error.len() as f64 * libm::log(mean_square(&white).max(1e-300));
        Some((likelihood, self.plant(&solved, y0, *v.first()?, signals.sample_time_s)?))
    }

    /// What y is a sum of: the driven part, the part of a constant drive, and a free response for each state.
    fn columns(&self, ts: f64, v: &[f64]) -> Option<Vec<Vec<f64>>> {
        let v0 = *v.first()?;
        let driven = self.response(v.iter().map(|v| v - v0), ts);
        let constant = self.response(v.iter().map(|_| 1.0), ts);
        let mut columns = vec![driven, constant];
        for lag in &self.lags_s {
            let keep = libm::exp(-ts / lag);
            columns.push(std::iter::successors(Some(1.0), |x| Some(x * keep)).take(v.len()).collect());
        }
        if self.integrates {
            columns.push(vec![1.0; v.len()]);
        }
        Some(columns)
    }

    /// What the shape makes of a drive held over each sample, from rest, its first sample before the drive has acted.
    fn response(&self, drive: impl Iterator<Item = f64>, ts: f64) -> Vec<f64> {
        let late = std::iter::repeat_n(None, self.delay).chain(drive.map(Some));
        let keeps: Vec<f64> = self.lags_s.iter().map(|lag| libm::exp(-ts / lag)).collect();
        let mut states = vec![0.0; keeps.len()];
        let mut sum = 0.0;
        let mut out: Vec<f64> = late
            .map(|drive| {
                let now = if self.integrates { sum } else { states.last().copied().unwrap_or(0.0) };
                // In the dead time is what was held before: the first value, from which drives count.
                let mut q = drive.unwrap_or(0.0);
                for (state, keep) in states.iter_mut().zip(&keeps) {
                    *state = keep * *state + (1.0 - keep) * q;
                    q = *state;
                }
                sum += ts * q;
                now
            })
            .collect();
        out.truncate(out.len().saturating_sub(self.delay));
        out
    }

    /// The plant of this shape with the coefficients of its columns; `None` where v does not move y.
    fn plant(&self, solved: &[f64], y0: f64, v0: f64, ts: f64) -> Option<Plant> {
        let (gain, offset) = (*solved.first()?, *solved.get(1)?);
        if gain == 0.0 || !gain.is_finite() {
            return None;
        }
        // What the constant part of the drive makes: of y less y0, or of dy/dt.
        let steady = offset - gain * v0;
        let delay = self.delay as f64;
        Some(match (self.lags_s.as_slice(), self.integrates) {
            ([lag], false) => Plant::FirstOrder(FirstOrder {
                gain,
                time_constant_s: *lag,
                delay_s: delay * ts,
                offset: y0 + steady,
            }),
            (lags, integrates) => {
                let mut den = lags.iter().fold(vec![1.0], |den, lag| times(&den, *lag));
                if integrates {
                    den.push(0.0);
                }
                let level = if integrates { steady } else { y0 + steady };
                let delay_s = delay.max(LEAST_DELAY) * ts;
                Plant::TransferFunction(TransferFunction {
                    num: vec![gain],
                    den,
                    delay_s,
                    offset: level / gain,
                })
            }
        })
    }
}

/// y less the sum of the columns.
fn left(columns: &[Vec<f64>], coefficients: &[f64], y: &[f64]) -> Vec<f64> {
    let mut rest = y.to_vec();
    for (column, c) in columns.iter().zip(coefficients) {
        rest.iter_mut().zip(column).for_each(|(rest, x)| *rest -= c * x);
    }
    rest
}

/// A polynomial, highest power first, times `lag*s + 1`.
fn times(polynomial: &[f64], lag: f64) -> Vec<f64> {
    let mut product = vec![0.0; polynomial.len() + 1];
    for (i, c) in polynomial.iter().enumerate() {
        if let Some(slot) = product.get_mut(i) {
            *slot += lag * c;
        }
        if let Some(slot) = product.get_mut(i + 1) {
            *slot += c;
        }
    }
    product
}

/// (coefficients, mean square of what is left) of the columns on y, samples without y left out.
fn least_squares(columns: &[Vec<f64>], y: &[f64]) -> Option<(Vec<f64>, f64)> {
    let count = y.iter().filter(|y| y.is_finite()).count();
    if count == y.len() {
        return of_whole(columns, y);
    }
    let known = |x: &[f64]| x.iter().zip(y).filter(|(_, y)| y.is_finite()).map(|(x, _)| *x).collect();
    let columns: Vec<Vec<f64>> = columns.iter().map(|column| known(column)).collect();
    let y: Vec<f64> = known(y);
    of_whole(&columns, &y)
}

/// The same where y is there in every sample.
fn of_whole(columns: &[Vec<f64>], y: &[f64]) -> Option<(Vec<f64>, f64)> {
    let (n, count) = (columns.len(), y.len().max(1) as f64);
    let most = |column: &Vec<f64>| column.iter().fold(0.0, |most: f64, x| most.max(x.abs())).max(1e-300);
    let scales: Vec<f64> = columns.iter().map(most).collect();
    let (mut normal, mut right) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
    for (i, column) in columns.iter().enumerate() {
        for (j, other) in columns.iter().enumerate().take(i + 1) {
            normal[(i, j)] = dot(column, other) / (scales[i] * scales[j]);
            normal[(j, i)] = normal[(i, j)];
        }
        right[i] = dot(column, y) / scales[i];
        // Two equal lags have one free response between them.
        normal[(i, i)] += 1e-10 * count;
    }
    let solved = normal.clone().cholesky()?.solve(&right);
    let left = dot(y, y) - 2.0 * solved.dot(&right) + (&normal * &solved).dot(&solved);
    let coefficients = solved.iter().zip(&scales).map(|(x, scale)| x / scale).collect();
    Some((coefficients, (left / count).max(0.0)))
}
