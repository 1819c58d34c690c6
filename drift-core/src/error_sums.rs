//! Sums of |e| or e^2 over one block, plain or weighted with time.
//!
//! A weighted sum uses the tick within the block; the block's own place in the window comes in when the window
//! is put together (`sum (offset + j) x = sum j x + offset sum x`). The recursion that is often used instead
//! integrates its own rounding error: 63 % off after 14 hours at 1 kHz.

use crate::index_set::Coverage;
use crate::number::Number;
use crate::store::{Reader, Writer};

/// Sums of one error index over one block.
pub trait ErrorSums<N: Number>: Copy + core::fmt::Debug {
    /// What gaps need to be known.
    type Trace: Trace<N>;
    /// No tick yet.
    const EMPTY: Self;
    /// The longest block that can't overflow, ticks.
    const MAX_BLOCK_TICKS: u32;
    /// Adds the error of one tick.
    fn add(&mut self, tick_in_block: u32, magnitude: N, squared: bool);
    /// A tick passes without a valid sample.
    fn pass(&mut self);
    /// Adds the sums of a stretch of ticks that ends before tick `end` of the same block.
    fn join(&mut self, stretch: &Self, end: u32);
    /// As if the ticks left out had shown the mean of the valid ones.
    fn extrapolate(&mut self, coverage: &Coverage);
    /// The block's share of the window's index, in raw units, for a block that begins at `offset_ticks`.
    fn in_window(&self, offset_ticks: f32) -> f32;
    /// Saves.
    fn write(&self, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self>;
}

/// What the open block's gaps and the readings before mean to sums that are weighted with time or made of
/// differences. Plain sums remember none of it.
pub trait Trace<N: Number>: Copy + core::fmt::Debug {
    /// Nothing seen.
    const START: Self;
    /// Saved bytes.
    const BYTES: usize;
    /// Measured output one tick earlier.
    fn y_before(&self) -> N;
    /// The same, for the next tick.
    fn remember(&mut self, y: N);
    /// A tick of the block is left out.
    fn leave_out(&mut self, tick_in_block: u16);
    /// A valid tick's predecessor is not known.
    fn unpair(&mut self);
    /// The next block begins.
    fn start_block(&mut self);
    /// The sum of the positions in the block of the ticks left out.
    fn time_left_out(&self) -> u32;
    /// Valid ticks of the block whose predecessor is not known.
    fn unpaired(&self) -> u16;
    /// Saves.
    fn write(&self, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self>;
}

/// For plain sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoTrace;

/// For all others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WholeTrace<N: Number> {
    y_before: N,
    time_left_out: u32,
    unpaired: u16,
}

impl<N: Number> Trace<N> for NoTrace {
    const START: Self = Self;
    const BYTES: usize = 0;
    #[inline(always)]
    fn y_before(&self) -> N {
        N::ZERO
    }
    #[inline(always)]
    fn remember(&mut self, _: N) {}
    fn leave_out(&mut self, _: u16) {}
    fn unpair(&mut self) {}
    fn start_block(&mut self) {}
    fn time_left_out(&self) -> u32 {
        0
    }
    fn unpaired(&self) -> u16 {
        0
    }
    fn write(&self, _: &mut Writer<'_>) {}
    fn read(_: &mut Reader<'_>) -> Option<Self> {
        Some(Self)
    }
}

impl<N: Number> Trace<N> for WholeTrace<N> {
    const START: Self = Self { y_before: N::ZERO, time_left_out: 0, unpaired: 0 };
    const BYTES: usize = 10;
    #[inline(always)]
    fn y_before(&self) -> N {
        self.y_before
    }
    #[inline(always)]
    fn remember(&mut self, y: N) {
        self.y_before = y;
    }
    fn leave_out(&mut self, tick_in_block: u16) {
        self.time_left_out += u32::from(tick_in_block);
    }
    fn unpair(&mut self) {
        self.unpaired += 1;
    }
    fn start_block(&mut self) {
        self.time_left_out = 0;
        self.unpaired = 0;
    }
    fn time_left_out(&self) -> u32 {
        self.time_left_out
    }
    fn unpaired(&self) -> u16 {
        self.unpaired
    }
    fn write(&self, to: &mut Writer<'_>) {
        to.u32(self.y_before.to_word());
        to.u32(self.time_left_out);
        to.u16(self.unpaired);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { y_before: N::from_word(from.u32()?), time_left_out: from.u32()?, unpaired: from.u16()? })
    }
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
    /// The sum weighted with the tick in the block. Of counts, in a stretch not yet joined: the sum of the plain sum
    /// after each tick, in which a value is once for every tick from its own to the end. That saves two 64-bit
    /// multiplications a tick; rounded numbers would cancel where it is turned into the other.
    weighted: N::Sum,
}

impl<N: Number> ErrorSums<N> for Plain<N> {
    type Trace = NoTrace;
    const EMPTY: Self = Self { sum: N::NOTHING };
    const MAX_BLOCK_TICKS: u32 = u16::MAX as u32;

    #[inline(always)]
    fn add(&mut self, _: u32, magnitude: N, squared: bool) {
        if squared {
            magnitude.add_square(&mut self.sum);
        } else {
            magnitude.add(&mut self.sum);
        }
    }
    fn pass(&mut self) {}
    fn join(&mut self, stretch: &Self, _: u32) {
        self.sum = N::join(self.sum, stretch.sum);
    }
    fn extrapolate(&mut self, coverage: &Coverage) {
        self.sum = N::extrapolate(self.sum, coverage.valid, coverage.whole);
    }
    fn in_window(&self, _: f32) -> f32 {
        N::sum_to_f32(self.sum)
    }
    fn write(&self, to: &mut Writer<'_>) {
        N::write_sum(self.sum, to);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { sum: N::read_sum(from)? })
    }
}

impl<N: Number> Weighted<N> {
    /// The unweighted sum, scaled: the integral without the factor t.
    pub fn plain(&self) -> f32 {
        self.plain.in_window(0.0)
    }
}

impl<N: Number> ErrorSums<N> for Weighted<N> {
    type Trace = WholeTrace<N>;
    const EMPTY: Self = Self { plain: Plain::EMPTY, weighted: N::NOTHING };
    const MAX_BLOCK_TICKS: u32 = N::MAX_BLOCK_TICKS_WEIGHTED;

    #[inline(always)]
    fn add(&mut self, tick_in_block: u32, magnitude: N, squared: bool) {
        self.plain.add(tick_in_block, magnitude, squared);
        if N::EXACT {
            N::add_sum(&mut self.weighted, self.plain.sum);
        } else if squared {
            magnitude.add_weighted_square(tick_in_block, &mut self.weighted);
        } else {
            magnitude.add_weighted(tick_in_block, &mut self.weighted);
        }
    }
    fn pass(&mut self) {
        if N::EXACT {
            N::add_sum(&mut self.weighted, self.plain.sum);
        }
    }
    fn join(&mut self, stretch: &Self, end: u32) {
        self.plain.join(&stretch.plain, end);
        let weighted =
            if N::EXACT { N::weigh(stretch.plain.sum, stretch.weighted, end) } else { stretch.weighted };
        self.weighted = N::join(self.weighted, weighted);
    }
    fn extrapolate(&mut self, coverage: &Coverage) {
        // Each tick left out gets the mean error at its own time: scaling the weighted sum would move it.
        let left_out = N::extrapolate(self.plain.sum, coverage.valid, coverage.time_left_out);
        self.weighted = N::join(self.weighted, left_out);
        self.plain.extrapolate(coverage);
    }
    fn in_window(&self, offset_ticks: f32) -> f32 {
        N::sum_to_f32(self.weighted) + offset_ticks * self.plain()
    }
    fn write(&self, to: &mut Writer<'_>) {
        self.plain.write(to);
        N::write_sum(self.weighted, to);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { plain: Plain::read(from)?, weighted: N::read_sum(from)? })
    }
}
