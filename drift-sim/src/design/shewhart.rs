//! Run lengths of the Shewhart chart: an alarm when z > upper or z < -lower. Decisions are independent, so N is geometric.

use super::run_length::RunLength;
use super::{check, normal, root};
use crate::sentences::typed;
use crate::{Error, Result};

/// The largest limit that is computed, in sigmas.
pub const LARGEST_LIMIT: f64 = 30.0;

/// Limits on both sides, which may differ; infinite: that side never alarms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shewhart {
    upper: f64,
    lower: f64,
}

impl Shewhart {
    /// Alarm at `z > upper` and at `z < -lower`, in sigmas; infinity switches a side off.
    ///
    /// # Errors
    /// A limit is not above 0 and up to [`LARGEST_LIMIT`], or both are off.
    pub fn new(upper: f64, lower: f64) -> Result<Self> {
        for limit in [upper, lower] {
            let fine = limit > 0.0 && (limit <= LARGEST_LIMIT || limit == f64::INFINITY);
            if !fine || upper.min(lower) == f64::INFINITY {
                return Err(Error::new(format!("the limit is {}", typed(limit)))
                    .allowed(format!("above 0, up to {LARGEST_LIMIT} sigmas")));
            }
        }
        Ok(Self { upper, lower })
    }

    /// The equal limits that give the wanted two-sided in-control run length in decisions.
    ///
    /// # Errors
    /// `arl0` is not above 1 or above [`super::LARGEST_ARL0`].
    pub fn with_arl0(arl0: f64) -> Result<Self> {
        let limit = limit(0.5 / arl0, arl0)?;
        Ok(Self { upper: limit, lower: limit })
    }

    /// The upper limit alone that gives the wanted in-control run length.
    ///
    /// # Errors
    /// As [`Self::with_arl0`]; also where `arl0` is 2 or less, which needs a limit below the mean.
    pub fn one_sided_with_arl0(arl0: f64) -> Result<Self> {
        if arl0 <= 2.0 {
            return Err(Error::new(format!("arl0 is {}", typed(arl0))).allowed("above 2 for one side"));
        }
        Ok(Self { upper: limit(1.0 / arl0, arl0)?, lower: f64::INFINITY })
    }

    /// The upper limit, in sigmas.
    pub fn upper(&self) -> f64 {
        self.upper
    }

    /// The lower limit's distance below zero, in sigmas.
    pub fn lower(&self) -> f64 {
        self.lower
    }

    /// P(a decision alarms) when z is N(`mean`, `deviation`^2).
    pub fn alarm_probability(&self, mean: f64, deviation: f64) -> f64 {
        normal::above((self.upper - mean) / deviation) + normal::below((-self.lower - mean) / deviation)
    }

    /// Average run length in decisions when z is N(`mean`, 1).
    pub fn arl(&self, mean: f64) -> f64 {
        1.0 / self.alarm_probability(mean, 1.0)
    }

    /// The whole distribution of the run length.
    pub fn run_length(&self, mean: f64) -> RunLength {
        RunLength::geometric(self.alarm_probability(mean, 1.0))
    }

    /// Average run length in decisions when z's mean grows by `slope` sigmas a decision, from 0 at the first.
    ///
    /// # Errors
    /// `slope` is not within [`super::SMALLEST_SLOPE`]..=[`super::LARGEST_SLOPE`].
    pub fn drift_arl(&self, slope: f64) -> Result<f64> {
        check::slope(slope)?;
        let (mut average, mut surviving, mut n) = (0.0, 1.0, 0.0);
        while surviving > 1e-17 * average {
            average += surviving;
            surviving *= 1.0 - self.alarm_probability(n * slope, 1.0).min(1.0);
            n += 1.0;
        }
        Ok(average)
    }
}

/// Where the upper tail has the probability `tail`.
fn limit(tail: f64, arl0: f64) -> Result<f64> {
    check::arl0(arl0)?;
    Ok(root::bracketed(|x| tail.ln() - normal::above(x).ln(), 0.0, LARGEST_LIMIT))
}
