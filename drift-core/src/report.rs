//! What a monitor says at a decision.

use crate::channel::{ChannelKind, ChannelReport};
use crate::course::Verdict;
use crate::detector::Side;
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
    fn with(self, kind: ChannelKind, side: Option<Side>) -> Self {
        if side.is_none() {
            return self;
        }
        let here = kind.location();
        match self {
            Self::Nowhere => here,
            same if same == here => same,
            _ => Self::Several,
        }
    }
}

/// What one decision says: the window's indices, the channels that judge them, and what they amount to. `I`: what the
/// index set keeps; `X`: how ticks left out are counted; `K`: what a channel reports.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(bound(serialize = "I: serde::Serialize, X: serde::Serialize, K: serde::Serialize"))
)]
pub struct Report<const C: usize, I = Indices, X = Excluded, K = ChannelReport> {
    /// Decisions before this one; wraps at 2^32.
    pub hop: u32,
    /// Whether the window could be judged.
    pub status: WindowStatus,
    /// The most severe verdict among the channels.
    pub verdict: Verdict,
    /// The window's indices, in the loop's units; NaN where too few ticks were valid.
    pub indices: I,
    /// Ticks left out since the last decision.
    pub excluded: X,
    /// The channels, in the configuration's order.
    #[cfg_attr(feature = "serde", serde(serialize_with = "serialize_channels"))]
    pub channels: [K; C],
}

impl<const C: usize, I, X, D, F> Report<C, I, X, ChannelReport<D, F>> {
    /// Where the deviation seems to be.
    pub fn location(&self) -> Location {
        self.channels.iter().fold(Location::Nowhere, |location, c| location.with(c.kind, c.side))
    }
}

/// serde knows arrays of fixed lengths only, not of a generic one.
#[cfg(feature = "serde")]
fn serialize_channels<S: serde::Serializer, K: serde::Serialize, const C: usize>(
    channels: &[K; C],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(channels.iter())
}
