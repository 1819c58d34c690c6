//! What a monitor is told, apart from what it remembers: `const`-constructible, so that it can lie in flash.

use crate::blanking::{Blanking, BlankingKind};
use crate::channel::Channel;
use crate::course::Decision;
use crate::detector::DetectorSet;
use crate::index_set::IndexSet;
use crate::memory::MemoryKind;
use crate::number::Number;
use crate::options::Options;
use crate::store::Fingerprint;
use crate::window::WindowKind;

/// Samples at or beyond these limits are saturated: the loop is not in control there.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Saturation<N> {
    /// Lower limit of u.
    pub u_min: N,
    /// Upper limit of u.
    pub u_max: N,
}

/// Configuration of a monitor with `C` channels. `const`-constructible; checked, in a `const` as well, by
/// [`crate::Plan::new`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config<N, const C: usize> {
    /// Seconds per tick, > 0.
    pub sample_time_s: f32,
    /// Ticks per block; a window is `window_blocks*block_ticks` ticks long.
    pub block_ticks: u32,
    /// Blocks per window, at most 64, and at most the capacity of a [`crate::Sliding`] window.
    pub window_blocks: u16,
    /// Blocks from one decision to the next; equal to `window_blocks` unless there is a reason: decisions on
    /// overlapping windows are correlated, and the detectors' thresholds must then be made for that.
    pub hop_blocks: u16,
    /// A block and a window count only when at least this fraction of their ticks was valid; what is missing is
    /// made up in proportion.
    pub min_valid: f32,
    /// y-units per count; 1 for `f32` in units.
    pub y_unit: f32,
    /// u-units per count; 1 for `f32` in units.
    pub u_unit: f32,
    /// Limits of u, if it has any.
    pub saturation: Option<Saturation<N>>,
    /// Blanking after steps of the reference, if wanted.
    pub blanking: Option<Blanking<N>>,
    /// What tells a drift from a disturbance (sections 3.1 and 3.2 of the paper).
    pub decision: Decision,
    /// The residual channels, in the order in which reports list them.
    pub channels: [Channel; C],
}

impl<N, const C: usize> Config<N, C> {
    /// Tumbling windows of `window_blocks*block_ticks` ticks, no limits, no blanking, default decision.
    pub const fn new(
        sample_time_s: f32,
        block_ticks: u32,
        window_blocks: u16,
        channels: [Channel; C],
    ) -> Self {
        Self {
            sample_time_s,
            block_ticks,
            window_blocks,
            hop_blocks: window_blocks,
            min_valid: 0.5,
            y_unit: 1.0,
            u_unit: 1.0,
            saturation: None,
            blanking: None,
            decision: Decision::DEFAULT,
            channels,
        }
    }

    /// Decides every `blocks` blocks.
    #[must_use]
    pub const fn with_hop(mut self, blocks: u16) -> Self {
        self.hop_blocks = blocks;
        self
    }

    /// Treats samples with u at or beyond the limits as saturated.
    #[must_use]
    pub const fn with_saturation(mut self, u_min: N, u_max: N) -> Self
    where
        N: Copy,
    {
        self.saturation = Some(Saturation { u_min, u_max });
        self
    }

    /// Leaves out `ticks` ticks after a step of the reference beyond `reference_step`.
    #[must_use]
    pub const fn with_blanking(mut self, reference_step: N, ticks: u32) -> Self
    where
        N: Copy,
    {
        self.blanking = Some(Blanking { reference_step, ticks });
        self
    }

    /// Units per count of the converters.
    #[must_use]
    pub const fn with_units(mut self, y_unit: f32, u_unit: f32) -> Self {
        self.y_unit = y_unit;
        self.u_unit = u_unit;
        self
    }

    /// How a drift is confirmed.
    #[must_use]
    pub const fn with_decision(mut self, decision: Decision) -> Self {
        self.decision = decision;
        self
    }

    /// Ticks per window: `window_blocks*block_ticks`.
    pub const fn window_ticks(&self) -> u32 {
        self.block_ticks.saturating_mul(self.window_blocks as u32)
    }

    /// Ticks from one decision to the next.
    pub const fn hop_ticks(&self) -> u32 {
        self.block_ticks.saturating_mul(self.hop_blocks as u32)
    }
}

/// Why a configuration was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// The named number must be finite and above zero.
    NotPositive(&'static str),
    /// The named number is outside its range.
    OutOfRange(&'static str),
    /// The named limits are not finite, or the lower one is not below the upper one.
    InvertedRange(&'static str),
    /// Blocks are longer than the sums can hold; use more of them.
    BlockTooLong,
    /// More blocks per window than the monitor's capacity.
    TooManyBlocks,
    /// A channel needs an index that the set does not keep; use [`crate::Full`].
    IndexNotKept(&'static str),
    /// The named part is configured, but the monitor's options leave it out.
    NotLinked(&'static str),
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotPositive(what) => write!(f, "{what} must be finite and above zero"),
            Self::OutOfRange(what) => write!(f, "{what} is out of range"),
            Self::InvertedRange(what) => {
                write!(f, "{what}: the limits must be finite, the lower one below the upper one")
            }
            Self::BlockTooLong => f.write_str("block_ticks is larger than the sums can hold"),
            Self::TooManyBlocks => f.write_str("window_blocks is larger than the monitor's capacity"),
            Self::IndexNotKept(channel) => {
                write!(f, "channel {channel} needs an index that this set does not keep")
            }
            Self::NotLinked(what) => {
                write!(f, "{what} is configured, but the monitor's options leave it out")
            }
        }
    }
}

impl core::error::Error for ConfigError {}

impl<N: Number, const C: usize> Config<N, C> {
    /// Checks all but the limits of u and the step of the reference, whose number is not known here.
    pub(crate) const fn check<S: IndexSet<N>, O: Options>(&self) -> Result<(), ConfigError> {
        if let Err(error) = self.check_timing::<S, O>() {
            return Err(error);
        }
        if !(self.min_valid > 0.0 && self.min_valid <= 1.0) {
            return Err(ConfigError::OutOfRange("min_valid"));
        }
        if !positive(self.y_unit) {
            return Err(ConfigError::NotPositive("y_unit"));
        }
        if !positive(self.u_unit) {
            return Err(ConfigError::NotPositive("u_unit"));
        }
        if self.saturation.is_some() && !O::LIMITS {
            return Err(ConfigError::NotLinked("saturation"));
        }
        if self.blanking.is_some() && !O::Blanking::LINKED {
            return Err(ConfigError::NotLinked("blanking"));
        }
        if !self.decision.valid() {
            return Err(ConfigError::OutOfRange("decision"));
        }
        let mut i = 0;
        while i < C {
            if let Err(error) = check_channel::<N, S, O>(&self.channels[i]) {
                return Err(error);
            }
            i += 1;
        }
        Ok(())
    }

    const fn check_timing<S: IndexSet<N>, O: Options>(&self) -> Result<(), ConfigError> {
        if !positive(self.sample_time_s) {
            return Err(ConfigError::NotPositive("sample_time_s"));
        }
        if self.block_ticks == 0 {
            return Err(ConfigError::NotPositive("block_ticks"));
        }
        if self.window_blocks == 0 {
            return Err(ConfigError::NotPositive("window_blocks"));
        }
        if self.window_blocks > O::Window::CAPACITY {
            return Err(ConfigError::TooManyBlocks);
        }
        if self.hop_blocks == 0 {
            return Err(ConfigError::NotPositive("hop_blocks"));
        }
        if self.hop_blocks != self.window_blocks && !O::Window::SLIDES {
            return Err(ConfigError::NotLinked("hop_blocks"));
        }
        if self.block_ticks > S::MAX_BLOCK_TICKS {
            return Err(ConfigError::BlockTooLong);
        }
        Ok(())
    }

    /// Changes with any number that a saved state depends on.
    pub(crate) fn fingerprint(&self) -> u32 {
        Fingerprint::of(|to| {
            to.f32(self.sample_time_s);
            to.u32(self.block_ticks);
            to.u32(u32::from(self.window_blocks));
            to.u32(u32::from(self.hop_blocks));
            [self.min_valid, self.y_unit, self.u_unit].into_iter().for_each(|w| to.f32(w));
            // Each optional part is preceded by a number of its own: the limits of one are not those of another.
            if let Some(s) = self.saturation {
                to.u32(1);
                to.u32(s.u_min.to_word());
                to.u32(s.u_max.to_word());
            }
            if let Some(b) = self.blanking {
                to.u32(2);
                to.u32(b.reference_step.to_word());
                to.u32(b.ticks);
            }
            self.decision.fingerprint(to);
            self.channels.iter().for_each(|c| c.fingerprint(to));
        })
    }
}

const fn check_channel<N: Number, S: IndexSet<N>, O: Options>(channel: &Channel) -> Result<(), ConfigError> {
    let kept = match channel.kind.index() {
        Some(index) => S::KEEPS & (1 << index as u8) != 0,
        None => S::KEEPS_EFFORT,
    };
    if !kept {
        return Err(ConfigError::IndexNotKept(channel.kind.name()));
    }
    if !channel.baseline.valid() {
        return Err(ConfigError::OutOfRange("baseline"));
    }
    if !O::PREDICTION && (channel.baseline.windows > 0.0 || channel.baseline.x_ss > 0.0) {
        return Err(ConfigError::NotLinked("a learnt baseline's uncertainty"));
    }
    if !channel.memory.valid() {
        return Err(ConfigError::OutOfRange("memory"));
    }
    if channel.memory.order > 0 && !O::Memory::LINKED {
        return Err(ConfigError::NotLinked("memory"));
    }
    if !channel.operating_point.valid() {
        return Err(ConfigError::OutOfRange("operating_point"));
    }
    if channel.operating_point.counts() && !S::KEEPS_POINT {
        return Err(ConfigError::NotLinked("operating_point"));
    }
    if !channel.detectors.valid() {
        return Err(ConfigError::OutOfRange("detectors"));
    }
    match channel.detectors.not_linked(O::Detectors::LINKED) {
        Some(name) => Err(ConfigError::NotLinked(name)),
        None => Ok(()),
    }
}

const fn positive(x: f32) -> bool {
    x.is_finite() && x > 0.0
}
