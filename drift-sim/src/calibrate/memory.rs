//! The effort channel's memory: how far back the healthy relation reaches, and its coefficients.
//!
//! The order is chosen by validation: each fifth of the windows is predicted from the relation that the other four
//! show, and an order must pay by [`LEAST_GAIN`] over the one below it. It is not asked for where windows overlap, whose
//! residuals are correlated by construction, or where there are fewer than [`WINDOWS_PER_COEFFICIENT`] windows for
//! each coefficient; and not taken if a lasting shift is then fewer of the residual's standard deviations than without.
//!
//! The value's own coefficients sum up to [`Memory::MOST_OWN`] at most, so that a fifth of a lasting shift stays visible
//! at least; where least squares asks for more, the sum is held there.

use drift_core::Memory;
use nalgebra::{DMatrix, DVector};

use super::windows::Windows;

/// An order is taken if the mean squared error of prediction falls by this part at least: below, it is noise.
const LEAST_GAIN: f64 = 0.01;
/// Windows for each of the relation's `2 + 2*order` coefficients.
///
/// A memory of three windows then needs 200. From 69 windows of the air handler an order of one was chosen with 15 a
/// coefficient, and its leak was not called drift any more.
pub const WINDOWS_PER_COEFFICIENT: usize = 25;
/// Parts of the validation.
const FOLDS: usize = 5;

/// The windows of a channel that have `order` windows before them, as rows of least squares.
struct Rows {
    /// 1, x, then x and value of the windows before.
    regressors: DMatrix<f64>,
    value: DVector<f64>,
}

impl Rows {
    fn of(windows: &Windows, position: usize, order: usize) -> Self {
        let at = |i: usize| windows.rows[i];
        let places = judged(windows, order);
        let regressors = DMatrix::from_fn(places.len(), 2 + 2 * order, |row, column| {
            let place = places[row];
            let number = match column {
                0 => 1.0,
                1 => at(place).x[position],
                c if c < 2 + order => at(place - (c - 1)).x[position],
                c => at(place - (c - 1 - order)).value[position],
            };
            f64::from(number)
        });
        let value = DVector::from_fn(places.len(), |row, _| f64::from(at(places[row]).value[position]));
        Self { regressors, value }
    }

    /// Least squares on the rows that `takes` names; the sum of the value's own coefficients is held at its bound.
    fn solve(&self, order: usize, takes: impl Fn(usize) -> bool) -> Option<DVector<f64>> {
        let rows: Vec<usize> = (0..self.value.len()).filter(|&row| takes(row)).collect();
        let (a, b) = (self.regressors.select_rows(&rows), self.value.select_rows(&rows));
        let free = least_squares(&a, &b)?;
        let bound = f64::from(Memory::MOST_OWN);
        if order == 0 || free.rows_range(2 + order..).sum() <= bound {
            return Some(free);
        }
        // The last of them is the bound minus the others.
        let last = a.ncols() - 1;
        let last_column = a.column(last).into_owned();
        let mut reduced = a.columns(0, last).into_owned();
        for c in 2 + order..last {
            let difference = reduced.column(c) - &last_column;
            reduced.set_column(c, &difference);
        }
        let others = least_squares(&reduced, &(b - &last_column * bound))?;
        let rest = bound - others.rows_range(2 + order..).sum();
        Some(others.push(rest))
    }

    /// Mean squared error of prediction, each fifth from the other four.
    fn validated(&self, order: usize) -> Option<f64> {
        let n = self.value.len();
        let fold = |row: usize| row * FOLDS / n;
        let mut sum = 0.0;
        for left_out in 0..FOLDS {
            let coefficients = self.solve(order, |row| fold(row) != left_out)?;
            let errors = &self.value - &self.regressors * coefficients;
            sum += (0..n).filter(|&row| fold(row) == left_out).map(|row| errors[row].powi(2)).sum::<f64>();
        }
        Some(sum / n as f64)
    }
}

/// By singular values of the columns brought to one size: x and its past may hardly differ.
fn least_squares(a: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    let sizes: Vec<f64> = a.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
    let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |r, c| a[(r, c)] / sizes[c]);
    let solution = scaled.svd(true, true).solve(b, 1e-9).ok()?;
    Some(DVector::from_fn(solution.len(), |c, _| solution[c] / sizes[c]))
}

/// The memory of this order, or of the order that validation chooses up to [`Memory::MOST`].
pub(super) fn choose(windows: &Windows, position: usize, overlap: usize, asked: Option<u8>) -> Memory {
    if overlap > 1 {
        return Memory::NONE;
    }
    let most = asked.map_or(Memory::MOST, usize::from).min(Memory::MOST);
    let enough = |order: usize| {
        windows.rows.len().saturating_sub(order * windows.stretches.len())
            >= WINDOWS_PER_COEFFICIENT * (2 + 2 * order)
    };
    let mut best = (0, f64::INFINITY);
    for order in (0..=most).filter(|&order| enough(order)) {
        let Some(error) = Rows::of(windows, position, order).validated(order) else { continue };
        if asked == Some(order as u8) || error < (1.0 - LEAST_GAIN) * best.1 {
            best = (order, error);
        }
    }
    let memory = learn(windows, position, best.0).unwrap_or(Memory::NONE);
    let shows = |order: usize, visible: f64| {
        Some(visible / Rows::of(windows, position, order).validated(order)?.sqrt())
    };
    // What is predicted better but hides more of a lasting shift than it gains is no gain.
    let gains = shows(best.0, f64::from(memory.visible())) > shows(0, 1.0);
    if asked.is_some() || gains { memory } else { Memory::NONE }
}

fn learn(windows: &Windows, position: usize, order: usize) -> Option<Memory> {
    if order == 0 {
        return None;
    }
    let coefficients = Rows::of(windows, position, order).solve(order, |_| true)?;
    let mut memory = Memory { order: order as u8, ..Memory::NONE };
    for (to, from) in memory.x.iter_mut().zip(coefficients.rows_range(2..2 + order).iter()) {
        *to = *from as f32;
    }
    for (to, from) in memory.value.iter_mut().zip(coefficients.rows_range(2 + order..).iter()) {
        *to = *from as f32;
    }
    // Rounded to f32 the bound may be passed by the last bit.
    let over = memory.value.iter().sum::<f32>() - Memory::MOST_OWN;
    if over > 0.0 {
        memory.value[0] -= over + f32::EPSILON;
    }
    Some(memory)
}

/// What the windows before contribute to the value of each window; windows without so many before them are not there.
pub(super) fn carried(windows: &Windows, position: usize, memory: &Memory, at: usize) -> f64 {
    let order = usize::from(memory.order);
    (1..=order)
        .map(|j| {
            let before = &windows.rows[at - j];
            f64::from(memory.x[j - 1]) * f64::from(before.x[position])
                + f64::from(memory.value[j - 1]) * f64::from(before.value[position])
        })
        .sum()
}

/// The windows that have `order` windows of their stretch before them, as places in `windows`.
pub(super) fn judged(windows: &Windows, order: usize) -> Vec<usize> {
    windows.stretches.iter().flat_map(|s| s.start + order..s.end.max(s.start + order)).collect()
}
