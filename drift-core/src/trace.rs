//! What the readings before, and the open block's gaps, mean to sums that are weighted with time or made of
//! differences. Plain sums remember none of it.

use crate::number::Number;
use crate::store::{Reader, Writer};

/// What is remembered from tick to tick besides the sums.
pub trait Trace<N: Number>: Copy + core::fmt::Debug {
    /// Nothing seen.
    const START: Self;
    /// Saved bytes.
    const BYTES: usize;
    /// (r, y) one tick earlier.
    fn before(&self) -> (N, N);
    /// The same, for the next tick.
    fn remember(&mut self, r: N, y: N);
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

/// For sums weighted with time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeTrace {
    time_left_out: u32,
}

/// For differences and sums weighted with time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WholeTrace<N: Number> {
    r_before: N,
    y_before: N,
    time_left_out: u32,
    unpaired: u16,
}

impl<N: Number> Trace<N> for NoTrace {
    const START: Self = Self;
    const BYTES: usize = 0;
    #[inline(always)]
    fn before(&self) -> (N, N) {
        (N::ZERO, N::ZERO)
    }
    #[inline(always)]
    fn remember(&mut self, _: N, _: N) {}
    fn leave_out(&mut self, _: u16) {}
    fn unpair(&mut self) {}
    fn start_block(&mut self) {}
    #[inline(always)]
    fn time_left_out(&self) -> u32 {
        0
    }
    #[inline(always)]
    fn unpaired(&self) -> u16 {
        0
    }
    fn write(&self, _: &mut Writer<'_>) {}
    fn read(_: &mut Reader<'_>) -> Option<Self> {
        Some(Self)
    }
}

impl<N: Number> Trace<N> for TimeTrace {
    const START: Self = Self { time_left_out: 0 };
    const BYTES: usize = 4;
    #[inline(always)]
    fn before(&self) -> (N, N) {
        (N::ZERO, N::ZERO)
    }
    #[inline(always)]
    fn remember(&mut self, _: N, _: N) {}
    fn leave_out(&mut self, tick_in_block: u16) {
        self.time_left_out = self.time_left_out.wrapping_add(u32::from(tick_in_block));
    }
    fn unpair(&mut self) {}
    fn start_block(&mut self) {
        *self = <Self as Trace<N>>::START;
    }
    fn time_left_out(&self) -> u32 {
        self.time_left_out
    }
    #[inline(always)]
    fn unpaired(&self) -> u16 {
        0
    }
    fn write(&self, to: &mut Writer<'_>) {
        to.u32(self.time_left_out);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { time_left_out: from.u32()? })
    }
}

impl<N: Number> Trace<N> for WholeTrace<N> {
    const START: Self = Self { r_before: N::ZERO, y_before: N::ZERO, time_left_out: 0, unpaired: 0 };
    const BYTES: usize = 14;
    #[inline(always)]
    fn before(&self) -> (N, N) {
        (self.r_before, self.y_before)
    }
    #[inline(always)]
    fn remember(&mut self, r: N, y: N) {
        self.r_before = r;
        self.y_before = y;
    }
    fn leave_out(&mut self, tick_in_block: u16) {
        self.time_left_out = self.time_left_out.wrapping_add(u32::from(tick_in_block));
    }
    fn unpair(&mut self) {
        self.unpaired = self.unpaired.wrapping_add(1);
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
        to.u32(self.r_before.to_word());
        to.u32(self.y_before.to_word());
        to.u32(self.time_left_out);
        to.u16(self.unpaired);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            r_before: N::from_word(from.u32()?),
            y_before: N::from_word(from.u32()?),
            time_left_out: from.u32()?,
            unpaired: from.u16()?,
        })
    }
}
