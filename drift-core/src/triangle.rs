//! Running least squares of several regressors in constant memory: a window at a time is turned into a triangle by planar rotations
//! without square roots (Gentleman 1973, algorithm AS 75).
//!
//! The normal equations would square what the regressors share, and lose in `f32` what tells x from its own past. A triangle
//! holds every relation of its first columns as well, on the same windows: orders are compared without a second pass.

use crate::store::{Reader, Writer};

/// Columns of the widest relation: 1, x, a point, and three windows of x and value.
pub(crate) const MOST_COLUMNS: usize = 9;
/// Of a column's sum of squares this part is rounding: what is left of it by the columns before can't be told from zero.
const ROUNDING: f32 = 1e-10;

/// Coefficients of the first columns, those behind them zero.
pub(crate) type Coefficients = [f32; MOST_COLUMNS];

/// Numbers of a triangle of so many columns.
pub(crate) const fn cells(columns: usize) -> usize {
    columns.saturating_mul(columns.saturating_add(3)) / 2
}

/// A triangle of `columns` columns and the value behind them, row by row: what a column has left of its own, its shares of the columns
/// behind it, its share of the value.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle<'a> {
    cells: &'a [f32],
    columns: usize,
    residual_ss: f32,
}

/// A relation of a triangle's first columns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solution {
    pub(crate) coefficients: Coefficients,
    pub(crate) residual_ss: f32,
}

/// Turns a row (the regressors, then the value) into the triangle; the row is used up. Returns what it adds to the residual sum of
/// squares.
pub(crate) fn include(cells: &mut [f32], row: &mut [f32]) -> f32 {
    let (mut cells, mut row, mut weight) = (cells, row, 1.0f32);
    while let Some((x, others)) = row.split_first_mut() {
        if others.is_empty() {
            return weight * *x * *x;
        }
        let Some((here, below)) = cells.split_at_mut_checked(others.len().saturating_add(1)) else { break };
        if let Some((own, shares)) = here.split_first_mut() {
            turn(own, shares, *x, others, &mut weight);
        }
        (cells, row) = (below, others);
    }
    0.0
}

/// One rotation: column `own` takes `x`.
fn turn(own: &mut f32, shares: &mut [f32], x: f32, others: &mut [f32], weight: &mut f32) {
    let weighted = *weight * x;
    let sum = *own + weighted * x;
    if sum <= 0.0 {
        return;
    }
    let sine = weighted / sum;
    *weight *= *own / sum;
    *own = sum;
    for (other, share) in others.iter_mut().zip(shares) {
        *other -= x * *share;
        *share += sine * *other;
    }
}

impl<'a> Triangle<'a> {
    pub(crate) const fn new(cells: &'a [f32], columns: usize, residual_ss: f32) -> Self {
        Self { cells, columns, residual_ss }
    }

    /// Row `i`, of which the first number is its own sum of squares and the last its share of the value.
    fn row(&self, i: usize) -> &'a [f32] {
        let from =
            i.wrapping_mul(self.columns.wrapping_add(1)).wrapping_sub(i.wrapping_mul(i.wrapping_sub(1)) / 2);
        let length = self.columns.wrapping_add(1).wrapping_sub(i);
        self.cells.get(from..).and_then(|rest| rest.get(..length)).unwrap_or(&[])
    }

    /// What the columns before leave of column `i`'s sum of squares; of column 0, which is 1 throughout, the windows.
    pub(crate) fn own(&self, i: usize) -> f32 {
        self.row(i).first().copied().unwrap_or(0.0)
    }

    /// How column `j` goes with column `i`, before it: for i = 0 its mean.
    pub(crate) fn share(&self, i: usize, j: usize) -> f32 {
        self.row(i).get(j.wrapping_sub(i)).copied().unwrap_or(0.0)
    }

    fn value_share(&self, i: usize) -> f32 {
        self.row(i).last().copied().unwrap_or(0.0)
    }

    /// Column `i` varies beyond its own rounding, apart from the columns before it; `level` is the magnitude about which its numbers
    /// lie.
    pub(crate) fn varies(&self, i: usize, level: f32) -> bool {
        let own = self.own(i);
        let mut all = own;
        for before in 1..i {
            let share = self.share(before, i);
            all += self.own(before) * share * share;
        }
        let rounding = 1e-6 * level;
        own > ROUNDING * all && own > self.own(0) * rounding * rounding
    }

    /// Least squares on the first `columns` columns; those that `counts` leaves out have no part in it.
    pub(crate) fn solve(&self, columns: usize, counts: impl Fn(usize) -> bool) -> Solution {
        let mut residual_ss = self.residual_ss;
        for i in columns..self.columns {
            residual_ss += self.explained(i);
        }
        let mut coefficients = [0.0; MOST_COLUMNS];
        self.substitute(
            columns,
            &mut coefficients,
            |i| if counts(i) { Some(self.value_share(i)) } else { None },
        );
        for i in (0..columns).filter(|&i| !counts(i)) {
            residual_ss += self.explained(i);
        }
        Solution { coefficients, residual_ss }
    }

    /// What column `i` takes off the residual sum of squares.
    fn explained(&self, i: usize) -> f32 {
        let share = self.value_share(i);
        self.own(i) * share * share
    }

    /// Solves the triangle for these right-hand sides; a column without one stays at zero.
    fn substitute(&self, columns: usize, into: &mut Coefficients, right: impl Fn(usize) -> Option<f32>) {
        for i in (0..columns).rev() {
            let Some(mut sum) = right(i) else { continue };
            for (j, c) in (0..columns).zip(into.iter()).skip(i.wrapping_add(1)) {
                sum -= self.share(i, j) * c;
            }
            if let Some(into) = into.get_mut(i) {
                *into = sum;
            }
        }
    }

    /// Least squares under the condition that the coefficients that `bound` names add up to `sum`.
    pub(crate) fn hold(
        &self,
        columns: usize,
        counts: impl Fn(usize) -> bool,
        bound: impl Fn(usize) -> bool,
        sum: f32,
    ) -> Solution {
        let mut solution = self.solve(columns, &counts);
        let named = |i: usize| bound(i) && counts(i);
        let mut excess = -sum;
        for (i, c) in (0..columns).zip(&solution.coefficients) {
            excess += if named(i) { *c } else { 0.0 };
        }
        // How much the sum itself is uncertain, in units of sigma squared, and which way the coefficients go with it.
        let (mut forward, mut variance) = ([0.0f32; MOST_COLUMNS], 0.0);
        for i in (0..columns).filter(|&i| counts(i)) {
            let mut w = if named(i) { 1.0 } else { 0.0 };
            for (k, before) in (0..i).zip(&forward) {
                w -= self.share(k, i) * self.own(k) * before;
            }
            let scaled = w / self.own(i);
            variance += w * scaled;
            if let Some(into) = forward.get_mut(i) {
                *into = scaled;
            }
        }
        let mut direction = [0.0; MOST_COLUMNS];
        self.substitute(columns, &mut direction, |i| forward.get(i).copied().filter(|_| counts(i)));
        let step = excess / variance;
        for (c, d) in solution.coefficients.iter_mut().zip(&direction) {
            *c -= step * d;
        }
        solution.residual_ss += excess * step;
        solution
    }
}

/// A triangle's numbers could have been learnt.
pub(crate) fn possible(cells: &[f32], columns: usize) -> bool {
    let triangle = Triangle::new(cells, columns, 0.0);
    cells.iter().all(|cell| cell.is_finite()) && (0..columns).all(|i| triangle.own(i) >= 0.0)
}

pub(crate) fn write(cells: &[f32], to: &mut Writer<'_>) {
    cells.iter().for_each(|&cell| to.f32(cell));
}

pub(crate) fn read(cells: &mut [f32], from: &mut Reader<'_>) -> Option<()> {
    for cell in cells {
        *cell = from.f32()?;
    }
    Some(())
}
