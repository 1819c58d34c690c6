//! What a tick can bring besides a valid sample. Only valid samples enter a sum; the others are counted.

use crate::store::{Reader, Writer};

/// What one tick brings: a sample, or why there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Input<N> {
    /// The loop is closed: reference, measured output, controller output.
    Sample {
        /// Reference.
        r: N,
        /// Measured output.
        y: N,
        /// Controller output.
        u: N,
    },
    /// The loop is open or in manual mode: time passes, nothing is summed.
    Manual,
    /// No sample arrived this tick.
    Missing,
}

/// Why a sample did not enter the sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Exclusion {
    /// No sample arrived.
    Missing,
    /// r, y or u is NaN or infinite.
    NonFinite,
    /// r, y or u is beyond [`crate::Number::LIMIT`].
    OutOfRange,
    /// u is at or beyond a configured limit: the loop is not in control there.
    Saturated,
    /// The loop is open.
    Manual,
    /// Within the blanking time after a step of the reference.
    Blanked,
}

/// Ticks left out since the last hop, by reason; saturating.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Excluded {
    /// Ticks at which no sample arrived.
    pub missing: u16,
    /// Ticks at which r, y or u was NaN or infinite.
    pub non_finite: u16,
    /// Ticks at which r, y or u was beyond [`crate::Number::LIMIT`].
    pub out_of_range: u16,
    /// Ticks at which u was at a limit of [`crate::Saturation`].
    pub saturated: u16,
    /// Ticks at which the loop was open.
    pub manual: u16,
    /// Ticks soon after a step of the reference ([`crate::Blanking`]).
    pub blanked: u16,
}

impl Excluded {
    /// Nothing left out.
    pub const NONE: Self =
        Self { missing: 0, non_finite: 0, out_of_range: 0, saturated: 0, manual: 0, blanked: 0 };

    /// Ticks left out, whatever the reason.
    pub fn total(&self) -> u32 {
        [self.missing, self.non_finite, self.out_of_range, self.saturated, self.manual, self.blanked]
            .iter()
            .map(|&n| u32::from(n))
            .sum()
    }

    const fn as_array(&self) -> [u16; 6] {
        [self.missing, self.non_finite, self.out_of_range, self.saturated, self.manual, self.blanked]
    }
}

/// How ticks that are left out are counted, as a type: [`Excluded`] or [`TotalExcluded`].
pub trait Exclusions: Copy + core::fmt::Debug + PartialEq + 'static {
    /// Nothing left out.
    const NONE: Self;
    /// Saved bytes.
    const BYTES: usize;
    /// One more, for this reason; saturating.
    fn count(&mut self, why: Exclusion);
    /// Saves.
    fn write(&self, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self>;
}

impl Exclusions for Excluded {
    const NONE: Self = Self::NONE;
    const BYTES: usize = 12;
    fn count(&mut self, why: Exclusion) {
        let counter = match why {
            Exclusion::Missing => &mut self.missing,
            Exclusion::NonFinite => &mut self.non_finite,
            Exclusion::OutOfRange => &mut self.out_of_range,
            Exclusion::Saturated => &mut self.saturated,
            Exclusion::Manual => &mut self.manual,
            Exclusion::Blanked => &mut self.blanked,
        };
        *counter = counter.saturating_add(1);
    }
    fn write(&self, to: &mut Writer<'_>) {
        self.as_array().into_iter().for_each(|n| to.u16(n));
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            missing: from.u16()?,
            non_finite: from.u16()?,
            out_of_range: from.u16()?,
            saturated: from.u16()?,
            manual: from.u16()?,
            blanked: from.u16()?,
        })
    }
}

/// Ticks left out since the last hop, whatever the reason; saturating.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TotalExcluded {
    /// Ticks.
    pub ticks: u16,
}

impl Exclusions for TotalExcluded {
    const NONE: Self = Self { ticks: 0 };
    const BYTES: usize = 2;
    fn count(&mut self, _: Exclusion) {
        self.ticks = self.ticks.saturating_add(1);
    }
    fn write(&self, to: &mut Writer<'_>) {
        to.u16(self.ticks);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { ticks: from.u16()? })
    }
}
