//! What a monitor says at a decision.

use crate::channel::{ChannelKind, ChannelReport};
use crate::course::Verdict;
use crate::index::Indices;
use crate::sample::Excluded;

/// Whether the window could be judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum WindowStatus {
    /// Enough valid ticks: at least [`crate::Config::min_valid`] of them.
    Valid,
    /// Too few: indices are NaN, detectors stand still.
    TooFewValid,
}

/// A first location of the fault, from which channels are away from their baselines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Location {
    /// No channel is away.
    Nowhere,
    /// Only the effort: a load, a leak, a bias, or gain that is lost at rest. The error does not show it.
    OperatingPoint,
    /// Only the effort along the motion: friction, or drive gain.
    Friction,
    /// Only the activity: changed dynamics, gain at high frequency, or noise.
    Dynamics,
    /// Only the energy-error relation: the loop tracks worse (or better) for the energy that it spends.
    Tracking,
    /// Several channels are away: the operating point and the dynamics changed together.
    Several,
}

impl Location {
    /// With what a further channel says.
    pub(crate) fn with(self, channel: &ChannelReport) -> Self {
        if channel.side.is_none() {
            return self;
        }
        let here = match channel.kind {
            ChannelKind::EnergyError(_) => Self::Tracking,
            ChannelKind::Effort => Self::OperatingPoint,
            ChannelKind::MotionEffort => Self::Friction,
            ChannelKind::Activity => Self::Dynamics,
        };
        match self {
            Self::Nowhere => here,
            same if same == here => same,
            _ => Self::Several,
        }
    }
}

/// What one decision says: the window's indices, the channels that judge them, and what they amount to.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Report<const C: usize> {
    /// Decisions before this one; wraps at 2^32.
    pub hop: u32,
    /// Whether the window could be judged.
    pub status: WindowStatus,
    /// The most severe verdict among the channels.
    pub verdict: Verdict,
    /// Where the deviation seems to be.
    pub location: Location,
    /// The window's indices, in the loop's units; NaN where the set does not keep them or too few ticks were valid.
    pub indices: Indices,
    /// Ticks left out since the last decision, by reason.
    pub excluded: Excluded,
    /// The channels, in the configuration's order.
    #[cfg_attr(feature = "serde", serde(serialize_with = "serialize_channels"))]
    pub channels: [ChannelReport; C],
}

/// serde knows arrays of fixed lengths only, not of a generic one.
#[cfg(feature = "serde")]
fn serialize_channels<S: serde::Serializer, const C: usize>(
    channels: &[ChannelReport; C],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(channels.iter())
}
