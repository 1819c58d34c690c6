//! Shewhart limits: one standardised residual beyond a limit.

use super::{Detector, Side};

/// Limits on a single standardised residual, sigmas. With Gaussian residuals +-3 gives one false alarm in 370
/// decisions; a skewed index needs unequal limits, which calibration finds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Shewhart {
    /// Alarm below this (negative).
    pub lower: f32,
    /// Alarm above this (positive).
    pub upper: f32,
}

impl Shewhart {
    /// The same limit on both sides.
    pub const fn symmetric(limit: f32) -> Self {
        Self { lower: -limit, upper: limit }
    }

    /// The side beyond its limit.
    pub fn check(&self, z: f32) -> Option<Side> {
        if z > self.upper {
            Some(Side::High)
        } else if z < self.lower {
            Some(Side::Low)
        } else {
            None
        }
    }

    pub(crate) const fn valid(&self) -> bool {
        self.upper.is_finite() && self.lower.is_finite() && self.upper > 0.0 && self.lower < 0.0
    }
}

impl Detector for Shewhart {
    const FIELDS: &'static [&'static str] = &["lower", "upper"];
    type State = ();

    fn start(&self) {}

    fn update(&self, (): &mut (), z: f32) -> Option<Side> {
        self.check(z)
    }

    fn possible(&self, (): &()) -> bool {
        true
    }

    fn each_number(&self, each: impl FnMut(f32)) {
        [self.lower, self.upper].into_iter().for_each(each);
    }
}
