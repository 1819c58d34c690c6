//! After a step of the reference the next ticks are left out: the loop's answer to it is no index of its health.

use core::fmt::Debug;

use crate::number::Number;
use crate::options::Never;
use crate::store::{Reader, Writer};

/// After a step of the reference the next ticks are left out.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Blanking<N> {
    /// A change of r from one tick to the next beyond this is a step.
    pub reference_step: N,
    /// Ticks to leave out, counting the step's own.
    pub ticks: u32,
}

/// Whether blanking is linked, as a type: [`Blanks`] or [`Never`].
pub trait BlankingKind: Copy + Debug + 'static {
    /// What is remembered for it.
    type State<N: Number>: BlankingState<N>;
    /// It is.
    const LINKED: bool;
}

/// What blanking remembers.
pub trait BlankingState<N: Number>: Copy + Debug {
    /// Nothing seen.
    const START: Self;
    /// Saved bytes.
    const BYTES: usize;
    /// The reference at the last sample.
    fn r_before(&self) -> N;
    /// The same, for the next sample.
    fn remember(&mut self, r: N);
    /// Ticks still to be left out.
    fn ticks(&self) -> u32;
    /// Leaves out so many from now on.
    fn set(&mut self, ticks: u32);
    /// Saves.
    fn write(&self, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self>;
}

/// Blanking is linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Blanks;

/// The reference at the last sample, and the ticks still to be left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlankTicks<N> {
    r_before: N,
    ticks: u32,
}

impl BlankingKind for Blanks {
    type State<N: Number> = BlankTicks<N>;
    const LINKED: bool = true;
}

impl<N: Number> BlankingState<N> for BlankTicks<N> {
    const START: Self = Self { r_before: N::ZERO, ticks: 0 };
    const BYTES: usize = 8;
    #[inline(always)]
    fn r_before(&self) -> N {
        self.r_before
    }
    #[inline(always)]
    fn remember(&mut self, r: N) {
        self.r_before = r;
    }
    #[inline(always)]
    fn ticks(&self) -> u32 {
        self.ticks
    }
    fn set(&mut self, ticks: u32) {
        self.ticks = ticks;
    }
    fn write(&self, to: &mut Writer<'_>) {
        to.u32(self.r_before.to_word());
        to.u32(self.ticks);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let read = Self { r_before: N::from_word(from.u32()?), ticks: from.u32()? };
        read.r_before.admissible().then_some(read)
    }
}

impl BlankingKind for Never {
    type State<N: Number> = Self;
    const LINKED: bool = false;
}

impl<N: Number> BlankingState<N> for Never {
    const START: Self = Self;
    const BYTES: usize = 0;
    #[inline(always)]
    fn r_before(&self) -> N {
        N::ZERO
    }
    #[inline(always)]
    fn remember(&mut self, _: N) {}
    #[inline(always)]
    fn ticks(&self) -> u32 {
        0
    }
    #[inline(always)]
    fn set(&mut self, _: u32) {}
    fn write(&self, _: &mut Writer<'_>) {}
    fn read(_: &mut Reader<'_>) -> Option<Self> {
        Some(Self)
    }
}
