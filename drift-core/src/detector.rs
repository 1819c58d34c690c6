//! The detectors of a standardised residual. Their thresholds are numbers computed on the host; an update is
//! adds and compares.
//!
//! A repeated SPRT that restarts at its lower boundary is itself a CUSUM with another reset: running both at
//! equal cost adds their false alarms. Shewhart beside CUSUM is the sensible duo: the first finds a disturbance
//! at once, the second a small drift.

mod cusum;
mod shewhart;
mod sprt;

pub use cusum::{Cusum, CusumState};
pub use shewhart::Shewhart;
pub use sprt::{Sprt, SprtState};

use crate::store::{Fingerprint, Reader, Writer};

/// To which side a residual moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Side {
    /// The residual lies above the baseline.
    High,
    /// The residual lies below the baseline.
    Low,
}

impl Side {
    pub(crate) fn sign(self) -> f32 {
        match self {
            Self::High => 1.0,
            Self::Low => -1.0,
        }
    }
}

/// The detectors that watch one channel; each is optional.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Detectors {
    /// Instant: one residual beyond a limit.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub shewhart: Option<Shewhart>,
    /// Cumulative: small persistent shifts.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub cusum: Option<Cusum>,
    /// Sequential: a stated alternative in mean, or mean and variance.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub sprt: Option<Sprt>,
}

impl Detectors {
    /// None: the channel is only reported.
    pub const NONE: Self = Self { shewhart: None, cusum: None, sprt: None };

    pub(crate) fn start(&self) -> DetectorStates {
        DetectorStates { cusum: self.cusum.map_or(CusumState::ZERO, |c| c.start()), sprt: SprtState::ZERO }
    }

    /// One decision: feeds `z` to every detector.
    pub(crate) fn update(&self, states: &mut DetectorStates, z: f32) -> Alarms {
        Alarms {
            shewhart: self.shewhart.and_then(|d| d.check(z)),
            cusum: self.cusum.and_then(|d| d.update(&mut states.cusum, z)),
            sprt: self.sprt.and_then(|d| d.update(&mut states.sprt, z)),
        }
    }

    pub(crate) fn valid(&self) -> bool {
        self.shewhart.is_none_or(|d| d.valid())
            && self.cusum.is_none_or(|d| d.valid())
            && self.sprt.is_none_or(|d| d.valid())
    }

    /// Whether these detectors can hold such states; one that is absent never moves.
    pub(crate) fn possible(&self, states: &DetectorStates) -> bool {
        self.cusum.map_or(states.cusum == CusumState::ZERO, |d| d.possible(&states.cusum))
            && self.sprt.map_or(states.sprt == SprtState::ZERO, |d| d.possible(&states.sprt))
    }

    pub(crate) fn fingerprint(&self, to: &mut Fingerprint<'_>) {
        if let Some(d) = self.shewhart {
            to.u32(1);
            d.words().into_iter().for_each(|w| to.f32(w));
        }
        if let Some(d) = self.cusum {
            to.u32(2);
            d.words().into_iter().for_each(|w| to.f32(w));
        }
        if let Some(d) = self.sprt {
            to.u32(3);
            d.words().into_iter().for_each(|w| to.f32(w));
        }
    }
}

/// What the detectors of one channel remember between decisions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DetectorStates {
    /// The two cumulative sums, in sigmas.
    pub cusum: CusumState,
    /// The two log-likelihood ratios.
    pub sprt: SprtState,
}

/// Saved bytes of one channel's detectors.
pub(crate) const DETECTOR_BYTES: usize = 16;

impl DetectorStates {
    pub(crate) fn write(&self, to: &mut Writer<'_>) {
        [self.cusum.high, self.cusum.low, self.sprt.high, self.sprt.low].into_iter().for_each(|w| to.f32(w));
    }
    pub(crate) fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            cusum: CusumState { high: from.f32()?, low: from.f32()? },
            sprt: SprtState { high: from.f32()?, low: from.f32()? },
        })
    }
}

/// Which detectors alarmed at this decision, and to which side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Alarms {
    /// The side that [`Shewhart`] alarmed on, if it did.
    pub shewhart: Option<Side>,
    /// The side that [`Cusum`] alarmed on, if it did.
    pub cusum: Option<Side>,
    /// The side that [`Sprt`] alarmed on, if it did.
    pub sprt: Option<Side>,
}

impl Alarms {
    /// No detector alarmed.
    pub const NONE: Self = Self { shewhart: None, cusum: None, sprt: None };

    /// The side that the slow detectors name, else the instant one's.
    pub fn side(&self) -> Option<Side> {
        self.cusum.or(self.sprt).or(self.shewhart)
    }
}
