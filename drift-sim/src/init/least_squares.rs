//! Linear least squares with few columns, row by row.

use nalgebra::{DMatrix, DVector};

/// Columns of a regression, at most.
pub const COLUMNS_MAX: usize = 4;

/// The normal equations of a regression.
pub struct LeastSquares {
    columns: usize,
    normal: [[f64; COLUMNS_MAX]; COLUMNS_MAX],
    right: [f64; COLUMNS_MAX],
    squares: f64,
    rows: usize,
}

/// The coefficients and what is left over.
pub struct Solution {
    /// In the order of the columns.
    pub coefficients: Vec<f64>,
    /// Standard error of each, as if what is left over were white.
    pub errors: Vec<f64>,
    /// Sum of the squares of what is left over.
    pub left_over: f64,
}

impl LeastSquares {
    /// A regression on the first so many columns of each row.
    pub fn new(columns: usize) -> Self {
        let columns = columns.min(COLUMNS_MAX);
        Self { columns, normal: Default::default(), right: [0.0; COLUMNS_MAX], squares: 0.0, rows: 0 }
    }

    /// One more row: what is explained, and the columns' values.
    #[inline]
    pub fn add(&mut self, target: f64, row: &[f64; COLUMNS_MAX]) {
        for i in 0..COLUMNS_MAX {
            self.right[i] += row[i] * target;
            for j in 0..=i {
                self.normal[i][j] += row[i] * row[j];
            }
        }
        self.squares += target * target;
        self.rows += 1;
    }

    /// `None` where the columns don't determine their coefficients.
    pub fn solve(&self) -> Option<Solution> {
        let n = self.columns;
        let normal = |i: usize, j: usize| self.normal[i.max(j)][i.min(j)];
        if self.rows <= n {
            return None;
        }
        // Columns of one size first: their units differ by many powers of ten.
        let scale: Vec<f64> = (0..n).map(|i| libm::sqrt(normal(i, i))).collect();
        if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
            return None;
        }
        let scaled = DMatrix::from_fn(n, n, |i, j| normal(i, j) / (scale[i] * scale[j]));
        let right = DVector::from_fn(n, |i, _| self.right[i] / scale[i]);
        let inverse = scaled.cholesky()?.inverse();
        let x = &inverse * &right;
        let left_over = (self.squares - x.dot(&right)).max(0.0);
        let variance = left_over / (self.rows - n) as f64;
        let solution = Solution {
            coefficients: (0..n).map(|i| x[i] / scale[i]).collect(),
            errors: (0..n).map(|i| libm::sqrt((variance * inverse[(i, i)]).max(0.0)) / scale[i]).collect(),
            left_over,
        };
        solution.coefficients.iter().all(|c| c.is_finite()).then_some(solution)
    }
}
