//! Sums of |e| or e^2 over one block, plain or weighted with time.
//!
//! A weighted sum uses the tick within the block; the block's own place in the window comes in when the window
//! is put together (`sum (offset + j) x = sum j x + offset sum x`). The recursion that is often used instead
//! integrates its own rounding error: 63 % off after 14 hours at 1 kHz.

use crate::number::Number;
use crate::store::{Reader, Writer};

/// Sums of one error index over one block.
pub trait ErrorSums<N: Number>: Copy + core::fmt::Debug {
    /// No tick yet.
    const EMPTY: Self;
    /// The longest block that can't overflow, ticks.
    const MAX_BLOCK_TICKS: u32;
    /// Adds the error of one tick.
    fn add(&mut self, tick_in_block: u32, magnitude: N, squared: bool);
    /// As if all `whole` ticks had been valid, not `part`.
    fn extrapolate(&mut self, part: u32, whole: u32);
    /// The block's share of the window's index, in raw units, for a block that begins at `offset_ticks`.
    fn in_window(&self, offset_ticks: f32) -> f32;
    /// Saves.
    fn write(&self, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self>;
}

/// For IAE and ISE.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plain<N: Number> {
    sum: N::Sum,
}

/// For ITAE and ITSE; gives the plain index as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighted<N: Number> {
    plain: Plain<N>,
    weighted: N::Sum,
}

impl<N: Number> ErrorSums<N> for Plain<N> {
    const EMPTY: Self = Self { sum: N::NOTHING };
    const MAX_BLOCK_TICKS: u32 = 1 << 16;

    #[inline(always)]
    fn add(&mut self, _: u32, magnitude: N, squared: bool) {
        if squared {
            magnitude.add_square(&mut self.sum);
        } else {
            magnitude.add(&mut self.sum);
        }
    }
    fn extrapolate(&mut self, part: u32, whole: u32) {
        self.sum = N::extrapolate(self.sum, part, whole);
    }
    fn in_window(&self, _: f32) -> f32 {
        N::sum_to_f32(self.sum)
    }
    fn write(&self, to: &mut Writer<'_>) {
        to.u64(N::sum_to_word(self.sum));
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { sum: N::sum_from_word(from.u64()?) })
    }
}

impl<N: Number> Weighted<N> {
    /// The unweighted sum.
    pub fn plain(&self) -> f32 {
        self.plain.in_window(0.0)
    }
}

impl<N: Number> ErrorSums<N> for Weighted<N> {
    const EMPTY: Self = Self { plain: Plain::EMPTY, weighted: N::NOTHING };
    const MAX_BLOCK_TICKS: u32 = N::MAX_BLOCK_TICKS_WEIGHTED;

    #[inline(always)]
    fn add(&mut self, tick_in_block: u32, magnitude: N, squared: bool) {
        self.plain.add(tick_in_block, magnitude, squared);
        if squared {
            magnitude.add_weighted_square(tick_in_block, &mut self.weighted);
        } else {
            magnitude.add_weighted(tick_in_block, &mut self.weighted);
        }
    }
    fn extrapolate(&mut self, part: u32, whole: u32) {
        self.plain.extrapolate(part, whole);
        self.weighted = N::extrapolate(self.weighted, part, whole);
    }
    fn in_window(&self, offset_ticks: f32) -> f32 {
        N::sum_to_f32(self.weighted) + offset_ticks * self.plain()
    }
    fn write(&self, to: &mut Writer<'_>) {
        self.plain.write(to);
        to.u64(N::sum_to_word(self.weighted));
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { plain: Plain::read(from)?, weighted: N::sum_from_word(from.u64()?) })
    }
}
