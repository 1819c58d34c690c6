//! The effort channel's relation: how far back it reaches, what measured columns add to it, and its coefficients.
//!
//! `value = b0 + b1*x + sum_k c_k*column_k + sum_j (x_j*x[t-j] + value_j*value[t-j])`, least squares of all at once.
//!
//! The order of the memory is the one behind which a lasting shift would be seen soonest: each fifth of the windows is predicted from
//! the relation that the other four show, which gives the residual's size; what of a shift stays visible window after window follows from the
//! coefficients, the threshold from the residual's correlation ([`super::delay`]). An order must be [`LEAST_GAIN`] sooner than those below it.
//! It is not asked for where windows overlap, whose residuals are correlated by construction, or where there are fewer than
//! [`WINDOWS_PER_COEFFICIENT`] windows for each coefficient.
//!
//! Before, the order was the one that predicts best, dropped where a lasting shift was then fewer of the residual's standard deviations than
//! without: on two lags that took none in 9 of 24 calibrations from 200 to 500 windows, and a load of 1.5 sigma was found after 8.2 windows in the
//! mean in place of 4.5. Weighing by the residual's long-run variance was tried as well and took one on the paper's plant that is slower on a ramp.
//!
//! The value's own coefficients sum up to [`Memory::MOST_OWN`] at most, so that a fifth of a lasting shift stays visible
//! at least; where least squares asks for more, the sum is held there.

use drift_core::Memory;
use nalgebra::{DMatrix, DVector};

use super::delay;
use super::windows::Windows;

/// An order is taken if it finds shifts sooner by this part at least: below, it is the simulation's noise.
const LEAST_GAIN: f64 = 0.03;
/// Lasting shifts that are to be found soon, in standard deviations of the residual without memory.
const SHIFTS: [f64; 2] = [0.5, 1.5];
/// Windows for each of the relation's `2 + columns + 2*order` coefficients.
///
/// A memory of three windows then needs 200. From 69 windows of the air handler an order of one was chosen with 15 a
/// coefficient, and its leak was not called drift any more.
pub const WINDOWS_PER_COEFFICIENT: usize = 25;
/// Parts of the validation.
const FOLDS: usize = 5;

/// What the relation of a channel is made of besides its line.
#[derive(Debug, Clone, Copy)]
struct Shape {
    /// The channel's place.
    position: usize,
    /// Measured columns.
    columns: usize,
    /// Windows that are remembered.
    order: usize,
}

impl Shape {
    /// Where the memory begins among the coefficients: after 1, x and the columns.
    fn memory_at(self) -> usize {
        2 + self.columns
    }

    /// Where the value's own coefficients begin.
    fn own_at(self) -> usize {
        self.memory_at() + self.order
    }

    fn coefficients(self) -> usize {
        self.memory_at() + 2 * self.order
    }
}

/// The windows of a channel that have `order` windows before them, as rows of least squares.
struct Rows {
    shape: Shape,
    /// 1, x, the columns, then x and value of the windows before.
    regressors: DMatrix<f64>,
    value: DVector<f64>,
}

impl Rows {
    fn of(windows: &Windows, shape: Shape) -> Self {
        let at = |i: usize| windows.rows[i];
        let places = judged(windows, shape.order);
        let position = shape.position;
        let regressors = DMatrix::from_fn(places.len(), shape.coefficients(), |row, column| {
            let place = places[row];
            let number = match column {
                0 => 1.0,
                1 => at(place).x[position],
                c if c < shape.memory_at() => at(place).columns[c - 2],
                c if c < shape.own_at() => at(place - (c - shape.memory_at() + 1)).x[position],
                c => at(place - (c - shape.own_at() + 1)).value[position],
            };
            f64::from(number)
        });
        let value = DVector::from_fn(places.len(), |row, _| f64::from(at(places[row]).value[position]));
        Self { shape, regressors, value }
    }

    /// Least squares on the rows that `takes` names; the sum of the value's own coefficients is held at its bound.
    fn solve(&self, takes: impl Fn(usize) -> bool) -> Option<DVector<f64>> {
        let own_at = self.shape.own_at();
        let rows: Vec<usize> = (0..self.value.len()).filter(|&row| takes(row)).collect();
        let (a, b) = (self.regressors.select_rows(&rows), self.value.select_rows(&rows));
        let free = least_squares(&a, &b)?;
        let bound = f64::from(Memory::MOST_OWN);
        if self.shape.order == 0 || free.rows_range(own_at..).sum() <= bound {
            return Some(free);
        }
        // The last of them is the bound minus the others.
        let last = a.ncols() - 1;
        let last_column = a.column(last).into_owned();
        let mut reduced = a.columns(0, last).into_owned();
        for c in own_at..last {
            let difference = reduced.column(c) - &last_column;
            reduced.set_column(c, &difference);
        }
        let others = least_squares(&reduced, &(b - &last_column * bound))?;
        let rest = bound - others.rows_range(own_at..).sum();
        Some(others.push(rest))
    }

    /// What is left of each value.
    fn residuals(&self) -> Option<DVector<f64>> {
        Some(&self.value - &self.regressors * self.solve(|_| true)?)
    }

    /// The part of a lasting shift that the residual shows window after window, the last for good.
    fn visible(&self) -> Option<Vec<f64>> {
        let coefficients = self.solve(|_| true)?;
        let mut left = 1.0;
        let after = coefficients.rows_range(self.shape.own_at()..);
        let after = after.iter().map(|own| {
            left -= own;
            left
        });
        Some(std::iter::once(1.0).chain(after).collect())
    }

    /// Mean squared error of prediction, each fifth from the other four.
    fn validated(&self) -> Option<f64> {
        let n = self.value.len();
        let fold = |row: usize| row * FOLDS / n;
        let mut sum = 0.0;
        for left_out in 0..FOLDS {
            let coefficients = self.solve(|row| fold(row) != left_out)?;
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

/// What is added to a channel's line.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Relation {
    /// What the windows before add.
    pub memory: Memory,
    /// Value units per unit of each measured column.
    pub weights: Vec<f64>,
}

impl Relation {
    /// Coefficients besides the line's two.
    pub(super) fn coefficients(&self) -> usize {
        2 * usize::from(self.memory.order) + self.weights.len()
    }

    /// What is added to the line at a window.
    pub(super) fn added(&self, windows: &Windows, position: usize, at: usize) -> f64 {
        let columns = windows.rows[at].columns;
        let measured: f64 = self.weights.iter().zip(columns).map(|(c, x)| c * f64::from(x)).sum();
        carried(windows, position, &self.memory, at) + measured
    }
}

/// The relation with `columns` measured columns and a memory of the order asked for, or of the order that sees a lasting shift
/// soonest, up to [`Memory::MOST`].
pub(super) fn choose(
    windows: &Windows,
    position: usize,
    columns: usize,
    overlap: usize,
    asked: Option<u8>,
) -> Relation {
    let shape = |order: usize| Shape { position, columns, order };
    let without = || learn(windows, shape(0)).unwrap_or_default();
    if overlap > 1 {
        return without();
    }
    let most = asked.map_or(Memory::MOST, usize::from).min(Memory::MOST);
    let enough = |order: usize| {
        windows.rows.len().saturating_sub(order * windows.stretches.len())
            >= WINDOWS_PER_COEFFICIENT * shape(order).coefficients()
    };
    if let Some(order) = asked.map(usize::from).filter(|&order| order <= most && enough(order)) {
        return learn(windows, shape(order)).unwrap_or_default();
    }
    let (mut best, mut alone) = ((0, f64::INFINITY), f64::NAN);
    for order in (0..=most).filter(|&order| enough(order)) {
        let rows = Rows::of(windows, shape(order));
        let Some((sigma, visible)) = rows.validated().map(f64::sqrt).zip(rows.visible()) else { continue };
        if order == 0 {
            alone = sigma;
        }
        let Some(residuals) = rows.residuals() else { continue };
        let response: Vec<f64> = visible.iter().map(|part| part * alone / sigma).collect();
        let delay = delay::of_shifts(residuals.as_slice(), &response, &SHIFTS);
        if delay < (1.0 - LEAST_GAIN) * best.1 {
            best = (order, delay);
        }
    }
    learn(windows, shape(best.0)).unwrap_or_else(without)
}

fn learn(windows: &Windows, shape: Shape) -> Option<Relation> {
    if shape.coefficients() == 2 {
        return Some(Relation::default());
    }
    let coefficients = Rows::of(windows, shape).solve(|_| true)?;
    let mut memory = Memory { order: shape.order as u8, ..Memory::NONE };
    let (memory_at, own_at) = (shape.memory_at(), shape.own_at());
    for (to, from) in memory.x.iter_mut().zip(coefficients.rows_range(memory_at..own_at).iter()) {
        *to = *from as f32;
    }
    for (to, from) in memory.value.iter_mut().zip(coefficients.rows_range(own_at..).iter()) {
        *to = *from as f32;
    }
    // Rounded to f32 the bound may be passed by the last bit.
    let over = memory.value.iter().sum::<f32>() - Memory::MOST_OWN;
    if over > 0.0 {
        memory.value[0] -= over + f32::EPSILON;
    }
    Some(Relation { memory, weights: coefficients.rows_range(2..memory_at).iter().copied().collect() })
}

/// Recordings from which on each is predicted from the others.
const RECORDINGS: usize = 3;

/// Each recording's residuals from the relation that the others show; `None` for a relation without measured columns, or from
/// fewer than [`RECORDINGS`] recordings.
///
/// Weather and load differ from day to day more than within a day. Weights that were learnt on a few days fit these days
/// better than they will fit the next one, and thresholds made from the days' own residuals would call it a drift.
pub(super) fn between_recordings(
    windows: &Windows,
    position: usize,
    relation: &Relation,
) -> Option<Vec<f64>> {
    if relation.weights.is_empty() {
        return None;
    }
    let order = usize::from(relation.memory.order);
    let rows = Rows::of(windows, Shape { position, columns: relation.weights.len(), order });
    let recording: Vec<usize> = judged(windows, order).iter().map(|&at| windows.rows[at].recording).collect();
    let mut kinds = recording.clone();
    kinds.sort_unstable();
    kinds.dedup();
    if kinds.len() < RECORDINGS {
        return None;
    }
    let mut residuals = vec![0.0; recording.len()];
    for left_out in kinds {
        let learnt_from = recording.iter().filter(|&&r| r != left_out).count();
        if learnt_from <= rows.shape.coefficients() {
            return None;
        }
        let coefficients = rows.solve(|row| recording[row] != left_out)?;
        let errors = &rows.value - &rows.regressors * coefficients;
        for (row, residual) in residuals.iter_mut().enumerate().filter(|(row, _)| recording[*row] == left_out)
        {
            *residual = errors[row];
        }
    }
    Some(residuals)
}

/// What the windows before contribute to the value of each window; windows without so many before them are not there.
fn carried(windows: &Windows, position: usize, memory: &Memory, at: usize) -> f64 {
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
