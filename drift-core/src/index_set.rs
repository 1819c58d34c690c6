//! What is summed per tick: [`Pair`] keeps the paper's pair (E_u and one error index), [`Full`] everything that
//! the three residual channels and the reports need.

use core::marker::PhantomData;

use crate::error_sums::{ErrorSums, Plain, Trace, Weighted, WholeTrace};
use crate::index::{Index, Indices};
use crate::number::Number;
use crate::store::{Reader, Writer};

/// One valid tick and the readings before it.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step<N> {
    /// Reference, in the number's own unit (engineering unit or count), as all fields.
    pub r: N,
    /// Measured output.
    pub y: N,
    /// Controller output.
    pub u: N,
    /// Reference one tick earlier; the same as `r` where that is not known.
    pub r_before: N,
    /// Measured output one tick earlier; the same as `y` where that is not known.
    pub y_before: N,
}

/// How much of a block was valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Coverage {
    /// Ticks of the block.
    pub whole: u32,
    /// Valid ticks among them.
    pub valid: u32,
    /// Valid ticks whose predecessor is known: only they enter sums of differences.
    pub paired: u32,
    /// Pairs below which the sums of differences stand for nothing.
    pub least_paired: u32,
    /// The sum of the positions in the block of the ticks left out.
    pub time_left_out: u32,
}

/// How a window's raw sums become indices in units and seconds.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scale {
    /// Seconds per tick.
    pub tick_s: f32,
    /// y-units per count (1 for f32).
    pub y_unit: f32,
    /// u-units per count (1 for f32).
    pub u_unit: f32,
    /// 1 over the ticks that the valid blocks stand for.
    pub per_tick: f32,
    /// All blocks over valid blocks: makes a window with gaps comparable with a whole one.
    pub fill: f32,
}

impl Scale {
    fn error(&self, index: Index) -> f32 {
        let per_sample = match index {
            Index::Iae | Index::Itae => self.y_unit,
            Index::Ise | Index::Itse => self.y_unit * self.y_unit,
        };
        let time = match index {
            Index::Iae | Index::Ise => self.tick_s,
            Index::Itae | Index::Itse => self.tick_s * self.tick_s,
        };
        per_sample * time * self.fill
    }
}

/// What is summed per tick. Sealed: [`Pair`] and [`Full`].
pub trait IndexSet<N: Number>: sealed::Sealed {
    /// The sums over one block.
    type Block: Copy + core::fmt::Debug;
    /// What gaps and differences need to be known besides.
    type Trace: Trace<N>;
    /// No tick yet.
    const EMPTY: Self::Block;
    /// The longest block whose sums can't overflow, ticks.
    const MAX_BLOCK_TICKS: u32;
    /// Mean u and y, the reference's activity and the motion are kept: the effort and activity channels need them.
    const KEEPS_EFFORT: bool;
    /// Marks the set in saved state.
    const TAG: u8;
    /// Whether the error index is kept.
    fn keeps(index: Index) -> bool;
    /// Adds one valid tick.
    fn add(block: &mut Self::Block, tick_in_block: u32, step: &Step<N>);
    /// Adds the sums of a stretch of ticks that ends before tick `end` of the same block.
    fn join(block: &mut Self::Block, stretch: &Self::Block, end: u32);
    /// A tick passes without a valid sample.
    fn pass(block: &mut Self::Block);
    /// As if the ticks left out had shown the mean of the valid ones.
    fn extrapolate(block: &mut Self::Block, coverage: &Coverage);
    /// Marks a block that has too few valid ticks: its energy is negative, which no sum of squares is.
    fn strike(block: &mut Self::Block);
    /// Whether it is marked so.
    fn is_struck(block: &Self::Block) -> bool;
    /// Zero in the indices that are kept.
    fn begin(total: &mut Indices);
    /// Adds a block that begins `offset_ticks` into the window.
    fn fold(total: &mut Indices, block: &Self::Block, offset_ticks: f32);
    /// Raw sums to units and seconds.
    fn scale(total: &mut Indices, by: &Scale);
    /// Saves.
    fn write(block: &Self::Block, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self::Block>;
}

mod sealed {
    pub trait Sealed {}
}

/// An error index as a type, for [`Pair`]: [`Iae`], [`Ise`], [`Itae`], [`Itse`].
pub trait ErrorIndex: sealed::Sealed + 'static {
    /// Which one.
    const INDEX: Index;
    /// Of e^2 rather than |e|.
    const SQUARED: bool;
    /// Its sums.
    type Sums<N: Number>: ErrorSums<N>;
}

macro_rules! error_index {
    ($name:ident, $sums:ident, $squared:literal) => {
        #[doc = concat!("[`Index::", stringify!($name), "`] as a type.")]
        #[derive(Debug, Clone, Copy)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $name;
        impl sealed::Sealed for $name {}
        impl ErrorIndex for $name {
            const INDEX: Index = Index::$name;
            const SQUARED: bool = $squared;
            type Sums<N: Number> = $sums<N>;
        }
    };
}
error_index!(Iae, Plain, false);
error_index!(Ise, Plain, true);
error_index!(Itae, Weighted, false);
error_index!(Itse, Weighted, true);

/// The paper's pair: E_u and one error index. Two sums per block, three for ITAE and ITSE.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pair<J>(PhantomData<J>);

/// Sums of one block of a [`Pair`].
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PairBlock<S, E> {
    energy: S,
    error: E,
}

impl<J: ErrorIndex> sealed::Sealed for Pair<J> {}

impl<N: Number, J: ErrorIndex> IndexSet<N> for Pair<J> {
    type Block = PairBlock<N::Sum, J::Sums<N>>;
    type Trace = <J::Sums<N> as ErrorSums<N>>::Trace;
    const EMPTY: Self::Block = PairBlock { energy: N::NOTHING, error: J::Sums::EMPTY };
    const MAX_BLOCK_TICKS: u32 = J::Sums::<N>::MAX_BLOCK_TICKS;
    const KEEPS_EFFORT: bool = false;
    const TAG: u8 = 1 + J::INDEX as u8;

    fn keeps(index: Index) -> bool {
        index == J::INDEX
    }
    #[inline(always)]
    fn add(block: &mut Self::Block, tick_in_block: u32, step: &Step<N>) {
        step.u.add_square(&mut block.energy);
        block.error.add(tick_in_block, step.r.minus(step.y).magnitude(), J::SQUARED);
    }
    #[inline]
    fn pass(block: &mut Self::Block) {
        block.error.pass();
    }
    fn join(block: &mut Self::Block, other: &Self::Block, end: u32) {
        block.energy = N::join(block.energy, other.energy);
        block.error.join(&other.error, end);
    }
    fn extrapolate(block: &mut Self::Block, coverage: &Coverage) {
        block.energy = N::extrapolate(block.energy, coverage.valid, coverage.whole);
        block.error.extrapolate(coverage);
    }
    fn strike(block: &mut Self::Block) {
        block.energy = N::STRUCK;
    }
    fn is_struck(block: &Self::Block) -> bool {
        N::is_negative(block.energy)
    }
    fn begin(total: &mut Indices) {
        total.e_u = 0.0;
        *total.error_index_mut(J::INDEX) = 0.0;
    }
    fn fold(total: &mut Indices, block: &Self::Block, offset_ticks: f32) {
        total.e_u += N::sum_to_f32(block.energy);
        *total.error_index_mut(J::INDEX) += block.error.in_window(offset_ticks);
    }
    fn scale(total: &mut Indices, by: &Scale) {
        total.e_u *= by.u_unit * by.u_unit * by.tick_s * by.fill;
        *total.error_index_mut(J::INDEX) *= by.error(J::INDEX);
    }
    fn write(block: &Self::Block, to: &mut Writer<'_>) {
        N::write_sum(block.energy, to);
        block.error.write(to);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self::Block> {
        Some(PairBlock { energy: N::read_sum(from)?, error: J::Sums::read(from)? })
    }
}

/// Every index: for all channels and for reports that show the whole window.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Full;

/// Sums of one block of [`Full`].
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FullBlock<N: Number> {
    energy: N::Sum,
    absolute: Weighted<N>,
    square: Weighted<N>,
    u: N::Sum,
    y: N::Sum,
    e: N::Sum,
    reference_step_square: N::Sum,
    motion_effort: N::Sum,
    travel: N::Sum,
    peak_u: N,
    peak_e: N,
}

impl sealed::Sealed for Full {}

impl<N: Number> IndexSet<N> for Full {
    type Block = FullBlock<N>;
    type Trace = WholeTrace<N>;
    const EMPTY: FullBlock<N> = FullBlock {
        energy: N::NOTHING,
        absolute: Weighted::EMPTY,
        square: Weighted::EMPTY,
        u: N::NOTHING,
        y: N::NOTHING,
        e: N::NOTHING,
        reference_step_square: N::NOTHING,
        motion_effort: N::NOTHING,
        travel: N::NOTHING,
        peak_u: N::ZERO,
        peak_e: N::ZERO,
    };
    const MAX_BLOCK_TICKS: u32 = N::MAX_BLOCK_TICKS_WEIGHTED;
    const KEEPS_EFFORT: bool = true;
    const TAG: u8 = 5;

    fn keeps(_: Index) -> bool {
        true
    }
    #[inline(always)]
    fn add(block: &mut FullBlock<N>, tick_in_block: u32, step: &Step<N>) {
        let e = step.r.minus(step.y);
        let (magnitude, u_magnitude) = (e.magnitude(), step.u.magnitude());
        step.u.add_square(&mut block.energy);
        block.absolute.add(tick_in_block, magnitude, false);
        block.square.add(tick_in_block, magnitude, true);
        step.u.add(&mut block.u);
        step.y.add(&mut block.y);
        e.add(&mut block.e);
        step.r.minus(step.r_before).add_square(&mut block.reference_step_square);
        let dy = step.y.minus(step.y_before);
        step.u.along(dy).add(&mut block.motion_effort);
        dy.magnitude().add(&mut block.travel);
        if magnitude > block.peak_e {
            block.peak_e = magnitude;
        }
        if u_magnitude > block.peak_u {
            block.peak_u = u_magnitude;
        }
    }
    #[inline]
    fn pass(block: &mut FullBlock<N>) {
        ErrorSums::<N>::pass(&mut block.absolute);
        ErrorSums::<N>::pass(&mut block.square);
    }
    fn join(block: &mut FullBlock<N>, other: &FullBlock<N>, end: u32) {
        block.absolute.join(&other.absolute, end);
        block.square.join(&other.square, end);
        block.energy = N::join(block.energy, other.energy);
        block.u = N::join(block.u, other.u);
        block.y = N::join(block.y, other.y);
        block.e = N::join(block.e, other.e);
        block.reference_step_square = N::join(block.reference_step_square, other.reference_step_square);
        block.motion_effort = N::join(block.motion_effort, other.motion_effort);
        block.travel = N::join(block.travel, other.travel);
        if other.peak_e > block.peak_e {
            block.peak_e = other.peak_e;
        }
        if other.peak_u > block.peak_u {
            block.peak_u = other.peak_u;
        }
    }
    fn extrapolate(block: &mut FullBlock<N>, coverage: &Coverage) {
        block.absolute.extrapolate(coverage);
        block.square.extrapolate(coverage);
        for sum in [&mut block.energy, &mut block.u, &mut block.y, &mut block.e] {
            *sum = N::extrapolate(*sum, coverage.valid, coverage.whole);
        }
        for sum in [&mut block.reference_step_square, &mut block.motion_effort, &mut block.travel] {
            *sum = N::extrapolate(*sum, coverage.paired, coverage.whole);
        }
        if coverage.paired < coverage.least_paired {
            // No sum of magnitudes is negative.
            block.travel = N::STRUCK;
        }
    }
    fn strike(block: &mut Self::Block) {
        block.energy = N::STRUCK;
    }
    fn is_struck(block: &Self::Block) -> bool {
        N::is_negative(block.energy)
    }
    fn begin(total: &mut Indices) {
        *total = Indices {
            e_u: 0.0,
            iae: 0.0,
            ise: 0.0,
            itae: 0.0,
            itse: 0.0,
            mean_u: 0.0,
            mean_y: 0.0,
            mean_e: 0.0,
            peak_u: 0.0,
            peak_e: 0.0,
            reference_activity: 0.0,
            motion_effort: 0.0,
            speed: 0.0,
        };
    }
    fn fold(total: &mut Indices, block: &FullBlock<N>, offset_ticks: f32) {
        total.e_u += N::sum_to_f32(block.energy);
        total.iae += block.absolute.plain();
        total.ise += block.square.plain();
        total.itae += block.absolute.in_window(offset_ticks);
        total.itse += block.square.in_window(offset_ticks);
        total.mean_u += N::sum_to_f32(block.u);
        total.mean_y += N::sum_to_f32(block.y);
        total.mean_e += N::sum_to_f32(block.e);
        // What has no pairs of ticks has no differences: NaN, which no detector takes.
        let known = if N::is_negative(block.travel) { f32::NAN } else { 1.0 };
        total.reference_activity += known * N::sum_to_f32(block.reference_step_square);
        total.motion_effort += known * N::sum_to_f32(block.motion_effort);
        total.speed += known * N::sum_to_f32(block.travel);
        total.peak_u = larger(total.peak_u, block.peak_u.to_f32());
        total.peak_e = larger(total.peak_e, block.peak_e.to_f32());
    }
    fn scale(total: &mut Indices, by: &Scale) {
        let mean_u = by.u_unit * by.per_tick;
        let mean_y = by.y_unit * by.per_tick;
        total.e_u *= by.u_unit * by.u_unit * by.tick_s * by.fill;
        for index in [Index::Iae, Index::Ise, Index::Itae, Index::Itse] {
            *total.error_index_mut(index) *= by.error(index);
        }
        total.mean_u *= mean_u;
        total.mean_y *= mean_y;
        total.mean_e *= mean_y;
        total.peak_u *= by.u_unit;
        total.peak_e *= by.y_unit;
        total.reference_activity *= by.y_unit * by.y_unit * by.fill;
        total.motion_effort *= mean_u;
        total.speed *= mean_y / by.tick_s;
    }
    fn write(block: &FullBlock<N>, to: &mut Writer<'_>) {
        block.absolute.write(to);
        block.square.write(to);
        for sum in [
            block.energy,
            block.u,
            block.y,
            block.e,
            block.reference_step_square,
            block.motion_effort,
            block.travel,
        ] {
            N::write_sum(sum, to);
        }
        to.u32(block.peak_u.to_word());
        to.u32(block.peak_e.to_word());
    }
    fn read(from: &mut Reader<'_>) -> Option<FullBlock<N>> {
        let mut block =
            FullBlock { absolute: Weighted::read(from)?, square: Weighted::read(from)?, ..Self::EMPTY };
        for sum in [
            &mut block.energy,
            &mut block.u,
            &mut block.y,
            &mut block.e,
            &mut block.reference_step_square,
            &mut block.motion_effort,
            &mut block.travel,
        ] {
            *sum = N::read_sum(from)?;
        }
        block.peak_u = N::from_word(from.u32()?);
        block.peak_e = N::from_word(from.u32()?);
        (block.peak_u.admissible() && !block.peak_e.non_finite()).then_some(block)
    }
}

fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
