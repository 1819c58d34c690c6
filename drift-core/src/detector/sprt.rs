//! Repeated sequential probability ratio test (Wald 1945) in both directions: restarts whenever it has accepted
//! the healthy hypothesis.

use super::{Detector, DetectorState, Side};
use crate::math;
use crate::store::{Reader, Writer};

/// Log-likelihood increments `constant +- linear*z + quadratic*z^2`, one test each side; alarm at `upper`,
/// restart at `lower`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Sprt {
    /// Added at every decision.
    pub constant: f32,
    /// Times z, with the side's sign.
    pub linear: f32,
    /// Times z^2; zero when only the mean is tested.
    pub quadratic: f32,
    /// Alarm at or above (positive).
    pub upper: f32,
    /// Healthy, restart from zero, at or below (negative).
    pub lower: f32,
}

/// The two log-likelihood ratios.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SprtState {
    /// Of the alternative above the baseline.
    pub high: f32,
    /// Of the alternative below it.
    pub low: f32,
}

impl DetectorState for SprtState {
    const ZERO: Self = Self { high: 0.0, low: 0.0 };
    const BYTES: usize = 8;
    fn write(&self, to: &mut Writer<'_>) {
        to.f32(self.high);
        to.f32(self.low);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { high: from.f32()?, low: from.f32()? })
    }
}

impl Sprt {
    /// Alternative: the mean is off by `shift` sigmas to either side.
    pub const fn mean(shift: f32, lower: f32, upper: f32) -> Self {
        Self { constant: -0.5 * shift * shift, linear: shift, quadratic: 0.0, upper, lower }
    }

    /// Alternative: the mean is off by `shift` sigmas and the standard deviation is `ratio` (> 0) times as large.
    pub fn mean_and_deviation(shift: f32, ratio: f32, lower: f32, upper: f32) -> Self {
        let precision = 1.0 / (ratio * ratio);
        Self {
            constant: -math::ln(ratio) - 0.5 * shift * shift * precision,
            linear: shift * precision,
            quadratic: 0.5 * (1.0 - precision),
            upper,
            lower,
        }
    }

    /// The ratio that the next decision starts from.
    fn after(&self, ratio: f32) -> f32 {
        // NaN, the difference of two overflows, starts anew as well: no state may stay poisoned.
        if ratio > self.lower && ratio < self.upper { ratio } else { 0.0 }
    }

    pub(crate) const fn valid(&self) -> bool {
        self.constant.is_finite()
            && self.linear.is_finite()
            && self.quadratic.is_finite()
            && self.upper.is_finite()
            && self.lower.is_finite()
            && self.upper > 0.0
            && self.lower < 0.0
    }
}

impl Detector for Sprt {
    const FIELDS: &'static [&'static str] = &["constant", "linear", "quadratic", "upper", "lower"];
    type State = SprtState;

    fn start(&self) -> SprtState {
        SprtState::ZERO
    }

    /// The side that alarms or accepts the healthy hypothesis starts anew.
    ///
    /// An alternative in the deviation can alarm on both sides at once: the side of the larger ratio is named, and
    /// between equal ratios the sign of z decides.
    fn update(&self, state: &mut SprtState, z: f32) -> Option<Side> {
        let even = self.constant + self.quadratic * (z * z);
        let odd = self.linear * z;
        let (high, low) = (state.high + (even + odd), state.low + (even - odd));
        state.high = self.after(high);
        state.low = self.after(low);
        if !(high >= self.upper || low >= self.upper) {
            return None;
        }
        // So put that a NaN on one side leaves the alarm to the other.
        let high_is_larger = high > low || (high == low && z >= 0.0);
        Some(if low >= self.upper && !high_is_larger { Side::Low } else { Side::High })
    }

    fn possible(&self, state: &SprtState) -> bool {
        [state.high, state.low].into_iter().all(|ratio| ratio > self.lower && ratio < self.upper)
    }

    fn each_number(&self, each: impl FnMut(f32)) {
        [self.constant, self.linear, self.quadratic, self.upper, self.lower].into_iter().for_each(each);
    }
}
