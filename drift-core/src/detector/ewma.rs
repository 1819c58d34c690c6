//! Exponentially weighted moving average (Roberts 1959; run lengths: Crowder 1987, Lucas & Saccucci 1990).

use super::{Detector, DetectorState, Side};
use crate::store::{Reader, Writer};

/// `mean += lambda*(z - mean)`; alarm where its magnitude is above `limit`.
///
/// The limit is `L*sqrt(lambda/(2 - lambda))` with the tables' L: with `lambda = 0.1, L = 2.814` one false alarm in
/// 500 decisions on average when the baseline is known exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Ewma {
    /// Weight of the newest residual, above 0 to 1.
    pub lambda: f32,
    /// Alarm where the average's magnitude is above, sigmas.
    pub limit: f32,
}

/// The weighted average, sigmas.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EwmaState {
    /// Of the residuals since the start or the last alarm; older ones count less.
    pub mean: f32,
}

impl DetectorState for EwmaState {
    const ZERO: Self = Self { mean: 0.0 };
    const BYTES: usize = 4;
    fn write(&self, to: &mut Writer<'_>) {
        to.f32(self.mean);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { mean: from.f32()? })
    }
}

impl Ewma {
    /// With this weight and limit.
    pub const fn new(lambda: f32, limit: f32) -> Self {
        Self { lambda, limit }
    }

    pub(crate) const fn valid(&self) -> bool {
        self.lambda > 0.0 && self.lambda <= 1.0 && self.limit.is_finite() && self.limit > 0.0
    }
}

impl Detector for Ewma {
    const FIELDS: &'static [&'static str] = &["lambda", "limit"];
    type State = EwmaState;

    fn start(&self) -> EwmaState {
        EwmaState::ZERO
    }

    /// After an alarm the average starts anew.
    fn update(&self, state: &mut EwmaState, z: f32) -> Option<Side> {
        let mean = state.mean + self.lambda * (z - state.mean);
        state.mean = if mean.abs() <= self.limit { mean } else { 0.0 };
        // NaN, the difference of two infinities, starts anew as well and alarms on no side.
        if mean > self.limit {
            Some(Side::High)
        } else if mean < -self.limit {
            Some(Side::Low)
        } else {
            None
        }
    }

    fn possible(&self, state: &EwmaState) -> bool {
        state.mean.abs() <= self.limit
    }

    fn each_number(&self, each: impl FnMut(f32)) {
        [self.lambda, self.limit].into_iter().for_each(each);
    }
}
