//! How a number spreads over repeated runs.

/// Of some values: how many, mean, standard error of the mean, and range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// How many values.
    pub n: usize,
    /// Their mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub se: f64,
    /// Middle value, the mean of two in the middle.
    pub median: f64,
    /// The least.
    pub min: f64,
    /// The greatest.
    pub max: f64,
}

impl Spread {
    /// NaN throughout for no values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len();
        let mean = values.iter().sum::<f64>() / n as f64;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n as f64 - 1.0);
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
        let median = if n % 2 == 1 { at(n / 2) } else { 0.5 * (at((n / 2).wrapping_sub(1)) + at(n / 2)) };
        let (min, max) = (at(0), at(n.wrapping_sub(1)));
        Self { n, mean, se: (variance / n as f64).sqrt(), median, min, max }
    }
}

/// A share with its binomial standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// From 0 to 1.
    pub share: f64,
    /// Standard error of the mean.
    pub se: f64,
}

impl Share {
    /// So many of so many.
    pub fn of(hits: usize, of: usize) -> Self {
        let share = hits as f64 / of as f64;
        Self { share, se: (share * (1.0 - share) / of as f64).sqrt() }
    }
}
