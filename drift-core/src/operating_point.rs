//! A measured operating point: a number that the loop's effort depends on besides y, such as the outdoor temperature, the
//! payload or the feed. `value = b0 + b1*x + weight*point`, and what a hot day or a heavy load costs is no drift.
//!
//! The point comes with the tick ([`crate::Plan::tick_at`]), or is told when it is measured and held in between
//! ([`crate::Plan::operating_point`]). The set [`crate::FullAt`] sums it; with any other set there is nothing of it in
//! the program. Several measured numbers become one before they reach the monitor: `drift calibrate` says their weights.

use crate::store::Fingerprint;

/// How a channel's value goes with the operating point, and how well that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct OperatingPoint {
    /// Value units per unit of the point; 0: the channel does not depend on it.
    pub weight: f32,
    /// The point's mean over the windows that it was learnt from.
    pub mean: f32,
    /// How the point went with x in them, point units per x unit.
    pub per_x: f32,
    /// Their sum of squared deviations of the point that x does not explain, point units squared; 0 takes the weight as
    /// exactly known.
    pub ss: f32,
    /// Smallest point seen; a window outside min..=max is flagged as extrapolated.
    pub min: f32,
    /// Largest point seen.
    pub max: f32,
}

impl OperatingPoint {
    /// None: the channel does not depend on it.
    pub const NONE: Self = Self { weight: 0.0, mean: 0.0, per_x: 0.0, ss: 0.0, min: f32::MIN, max: f32::MAX };

    /// A weight taken as exactly known.
    pub const fn known(weight: f32) -> Self {
        Self { weight, ..Self::NONE }
    }

    /// The channel depends on it.
    pub const fn counts(&self) -> bool {
        self.weight != 0.0
    }

    /// What the weight's uncertainty adds to the prediction variance at this point, in units of sigma squared;
    /// `from_mean` is x less its mean.
    pub fn leverage(&self, from_mean: f32, point: f32) -> f32 {
        if self.ss > 0.0 {
            let apart = point - self.mean - self.per_x * from_mean;
            apart * (apart / self.ss)
        } else {
            0.0
        }
    }

    pub(crate) const fn valid(&self) -> bool {
        self.weight.is_finite()
            && self.mean.is_finite()
            && self.per_x.is_finite()
            && self.ss.is_finite()
            && self.ss >= 0.0
            && self.min.is_finite()
            && self.max.is_finite()
            && self.min <= self.max
    }

    pub(crate) fn fingerprint(&self, to: &mut Fingerprint<'_>) {
        if self.counts() {
            [self.weight, self.mean, self.per_x, self.ss, self.min, self.max]
                .into_iter()
                .for_each(|w| to.f32(w));
        }
    }
}

impl Default for OperatingPoint {
    fn default() -> Self {
        Self::NONE
    }
}
