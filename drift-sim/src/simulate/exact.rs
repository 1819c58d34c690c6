//! A linear plant, exactly: one matrix step a sample, for an input that is held and changes at most once within the
//! sample (dead time that is not a multiple of it).

use crate::Result;
use crate::plant::StateSpace;
use crate::plant::zero_order_hold::discretise;

/// A plant of at most N states; those that it does not have stay at zero.
#[derive(Debug, Clone)]
pub(super) struct Exact<const N: usize> {
    /// The state matrix, column by column.
    pub(super) phi: [[f64; N]; N],
    pub(super) older: [f64; N],
    pub(super) newer: [f64; N],
    pub(super) c: [f64; N],
    pub(super) d: f64,
    /// dy/dt from the state and from the drive.
    pub(super) rate_state: [f64; N],
    pub(super) rate_drive: f64,
    pub x: [f64; N],
}

/// The first N numbers, filled up with zeros.
fn padded<const N: usize>(values: &[f64]) -> [f64; N] {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
}

/// A matrix, given column by column, times a vector. Each row is added up from its first column on, from a negative zero, which changes no
/// number. By columns each number of x is read by itself: a pair that straddles two stores of the sample before would wait for both.
#[inline(always)]
fn times<const N: usize>(columns: &[[f64; N]; N], x: &[f64; N]) -> [f64; N] {
    let mut sums = [-0.0; N];
    for (column, x) in columns.iter().zip(x) {
        for (sum, m) in sums.iter_mut().zip(column) {
            *sum += m * x;
        }
    }
    sums
}

impl<const N: usize> Exact<N> {
    /// The steps for an input that changes after `part` of the sample.
    pub fn new(plant: &StateSpace, sample_time_s: f64, part: f64) -> Result<Self> {
        let n = plant.order();
        let entry = |phi: &[f64], row: usize, column: usize| {
            phi.get(row * n + column).filter(|_| column < n).copied().unwrap_or(0.0)
        };
        let columns =
            |phi: &[f64]| std::array::from_fn(|column| std::array::from_fn(|row| entry(phi, row, column)));
        let whole = discretise(plant, sample_time_s)?;
        let first = discretise(plant, part * sample_time_s)?;
        let rest = discretise(plant, (1.0 - part) * sample_time_s)?;
        let older = times(&columns(&rest.phi), &padded(&first.gamma));
        Ok(Self {
            phi: columns(&whole.phi),
            older,
            newer: padded(&rest.gamma),
            c: padded(&plant.c),
            d: plant.d,
            rate_state: padded(&plant.rate_of_output().0),
            rate_drive: plant.rate_of_output().1,
            x: [0.0; N],
        })
    }

    #[inline]
    pub fn output(&self, held: f64) -> f64 {
        self.c.iter().zip(&self.x).map(|(c, x)| c * x).sum::<f64>() + self.d * held
    }

    /// dy/dt under the drive held until now.
    #[inline]
    pub fn rate(&self, held: f64) -> f64 {
        self.rate_state.iter().zip(&self.x).map(|(c, x)| c * x).sum::<f64>() + self.rate_drive * held
    }

    /// Whether y is the first state alone, which follows the drive of its own sample.
    pub fn shows_its_first_state(&self) -> bool {
        let unit = |i: usize| if i == 0 { 1.0 } else { 0.0 };
        #[expect(clippy::float_cmp, reason = "only these very numbers change nothing")]
        let is_unit = self.c.iter().enumerate().all(|(i, c)| *c == unit(i));
        is_unit && self.d == 0.0 && self.older.first() == Some(&0.0)
    }

    /// The state one sample after `x` under a drive that is not zero, where the plant shows its first state; `None` where it takes
    /// [`Self::output`] and [`Self::advance`] to tell zeros and infinities apart.
    #[inline(always)]
    pub fn after(&self, x: &[f64; N], drive: f64) -> Option<[f64; N]> {
        let free = times(&self.phi, x);
        let is_usual = free.first().is_some_and(|free| *free != 0.0) && x.iter().sum::<f64>().is_finite();
        is_usual.then(|| {
            std::array::from_fn(|i| {
                let before = if i == 0 { free[i] } else { free[i] + self.older[i] * drive };
                before + self.newer[i] * drive
            })
        })
    }

    #[inline]
    pub fn advance(&mut self, older: f64, newer: f64) {
        let free = times(&self.phi, &self.x);
        self.x = std::array::from_fn(|i| free[i] + self.older[i] * older + self.newer[i] * newer);
    }
}
