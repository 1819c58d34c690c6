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

/// Columns, a bit each.
pub(crate) type Columns = u32;

/// Numbers of a triangle of so many columns.
pub(crate) const fn cells(columns: usize) -> usize {
    columns.saturating_mul(columns.saturating_add(3)) / 2
}

/// The first columns.
pub(crate) const fn first(columns: usize) -> Columns {
    1u32.wrapping_shl(columns as u32).wrapping_sub(1)
}

/// Whether column `i` is among them.
#[inline(always)]
pub(crate) const fn has(columns: Columns, i: usize) -> bool {
    columns.wrapping_shr(i as u32) & 1 == 1
}

/// A triangle of `columns` columns and the value behind them, row by row: what a column has left of its own, its shares of the columns
/// behind it, its share of the value.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle<'a> {
    cells: &'a [f32],
    columns: usize,
}

/// A relation of some of a triangle's columns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solution {
    pub(crate) coefficients: Coefficients,
    /// What it leaves besides the triangle's own rest.
    pub(crate) residual_ss: f32,
}

// All of it is inlined where it is used: a program without it has not even functions to throw away.

/// Turns a row (the regressors, then the value) into the triangle; the row is used up. Returns what it adds to the residual sum of
/// squares.
#[inline]
pub(crate) fn include(cells: &mut [f32], row: &mut [f32]) -> f32 {
    let (mut cells, mut row, mut weight) = (cells, row, 1.0f32);
    while let Some((x, others)) = row.split_first_mut() {
        if others.is_empty() {
            return weight * *x * *x;
        }
        let Some((here, below)) = cells.split_at_mut_checked(others.len().wrapping_add(1)) else { break };
        let Some((own, shares)) = here.split_first_mut() else { break };
        let weighted = weight * *x;
        let sum = *own + weighted * *x;
        // One rotation. What has nothing of this column leaves it alone.
        if sum > 0.0 {
            let sine = weighted / sum;
            weight *= *own / sum;
            *own = sum;
            for (other, share) in others.iter_mut().zip(shares) {
                *other -= *x * *share;
                *share += sine * *other;
            }
        }
        (cells, row) = (below, others);
    }
    0.0
}

/// Rows from the first to the last: own, shares, the value's share.
struct Down<'a> {
    cells: &'a [f32],
    length: usize,
}

impl<'a> Iterator for Down<'a> {
    type Item = &'a [f32];
    #[inline]
    fn next(&mut self) -> Option<&'a [f32]> {
        let (row, below) = self.cells.split_at_checked(self.length)?;
        (self.cells, self.length) = (below, self.length.wrapping_sub(1));
        Some(row).filter(|row| row.len() > 1)
    }
}

impl<'a> Triangle<'a> {
    pub(crate) const fn new(cells: &'a [f32], columns: usize) -> Self {
        Self { cells, columns }
    }

    fn down(&self) -> Down<'a> {
        Down { cells: self.cells, length: self.columns.wrapping_add(1) }
    }

    /// Row `i`.
    #[inline]
    fn row(&self, i: usize) -> &'a [f32] {
        self.down().nth(i).unwrap_or(&[])
    }

    /// What the columns before leave of column `i`'s sum of squares; of column 0, which is 1 throughout, the windows.
    #[inline]
    pub(crate) fn own(&self, i: usize) -> f32 {
        self.row(i).first().copied().unwrap_or(0.0)
    }

    /// How column `j` goes with column `i`, before it: for i = 0 its mean.
    #[inline]
    pub(crate) fn share(&self, i: usize, j: usize) -> f32 {
        self.row(i).get(j.wrapping_sub(i)).copied().unwrap_or(0.0)
    }

    /// The columns that vary beyond their own rounding, apart from those before them; `levels` are the magnitudes about which
    /// their numbers lie. Column 0 is among them.
    #[inline]
    pub(crate) fn varying(&self, levels: &Coefficients) -> Columns {
        let (mut before, mut varying, mut windows) = ([0.0f32; MOST_COLUMNS], 0, 0.0);
        for (i, row) in (0..MOST_COLUMNS).zip(self.down()) {
            let Some((&own, shares)) = row.split_first() else { break };
            windows = if i == 0 { own } else { windows };
            let (known, level) = before.get(i).zip(levels.get(i)).unwrap_or((&0.0, &0.0));
            let rounding = 1e-6 * level;
            if i == 0 || own > ROUNDING * (own + known) && own > windows * rounding * rounding {
                varying |= 1u32.wrapping_shl(i as u32);
            }
            if i > 0 {
                for (before, share) in before.iter_mut().skip(i.wrapping_add(1)).zip(shares) {
                    *before += own * share * share;
                }
            }
        }
        varying
    }

    /// Least squares on these columns.
    #[inline]
    pub(crate) fn solve(&self, columns: Columns) -> Solution {
        let mut residual_ss = 0.0;
        for (i, row) in (0..MOST_COLUMNS).zip(self.down()) {
            if let (false, Some(own), Some(share)) = (has(columns, i), row.first(), row.last()) {
                residual_ss += own * share * share;
            }
        }
        Solution { coefficients: self.substitute(columns, None), residual_ss }
    }

    /// Solves the triangle, the last column first, for these right-hand sides or for the value.
    #[inline(never)]
    fn substitute(&self, columns: Columns, right: Option<&Coefficients>) -> Coefficients {
        let mut solution = [0.0; MOST_COLUMNS];
        let (mut above, mut length) = (self.cells, 2usize);
        for i in (0..self.columns).rev() {
            let Some((rest, row)) = above.split_at_checked(above.len().wrapping_sub(length)) else { break };
            (above, length) = (rest, length.wrapping_add(1));
            if has(columns, i) {
                let value = right.map_or(row.last(), |right| right.get(i));
                let mut sum = value.copied().unwrap_or(0.0);
                for (share, c) in
                    row.iter().skip(1).zip(solution.iter().take(self.columns).skip(i.wrapping_add(1)))
                {
                    sum -= share * c;
                }
                if let Some(place) = solution.get_mut(i) {
                    *place = sum;
                }
            }
        }
        solution
    }

    /// Changes a solution on these columns so that the coefficients of `named`, some of them, add up to less by `excess`.
    #[inline]
    pub(crate) fn hold(&self, solution: &mut Solution, columns: Columns, named: Columns, excess: f32) {
        // How uncertain that sum is, in units of sigma squared, and which way the coefficients go with it.
        let (mut forward, mut variance) = ([0.0f32; MOST_COLUMNS], 0.0);
        for (i, place) in (0..MOST_COLUMNS).zip(&mut forward) {
            *place = if has(columns & named, i) { 1.0 } else { 0.0 };
        }
        for (i, row) in (0..MOST_COLUMNS).zip(self.down()).filter(|(i, _)| has(columns, *i)) {
            let Some((&own, shares)) = row.split_first() else { break };
            let w = forward.get(i).copied().unwrap_or(0.0);
            let below = (0..MOST_COLUMNS).zip(&mut forward).skip(i.wrapping_add(1));
            for ((_, below), share) in below.zip(shares).filter(|((j, _), _)| has(columns, *j)) {
                *below -= share * w;
            }
            variance += w * (w / own);
            if let Some(place) = forward.get_mut(i) {
                *place = w / own;
            }
        }
        let step = excess / variance;
        let direction = self.substitute(columns, Some(&forward));
        for (c, d) in solution.coefficients.iter_mut().zip(&direction) {
            *c -= step * d;
        }
        solution.residual_ss += excess * step;
    }
}

/// A triangle's numbers could have been learnt.
#[inline]
pub(crate) fn possible(cells: &[f32], columns: usize) -> bool {
    let mut rows = Triangle::new(cells, columns).down();
    cells.iter().all(|cell| cell.is_finite()) && rows.all(|row| row.first().is_some_and(|own| *own >= 0.0))
}

#[inline]
pub(crate) fn write(cells: &[f32], to: &mut Writer<'_>) {
    cells.iter().for_each(|&cell| to.f32(cell));
}

#[inline]
pub(crate) fn read(cells: &mut [f32], from: &mut Reader<'_>) -> Option<()> {
    for cell in cells {
        *cell = from.f32()?;
    }
    Some(())
}
