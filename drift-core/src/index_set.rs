//! What is summed per tick: [`Pair`] keeps the paper's pair (E_u and one error index), [`Full`] everything that
//! the three residual channels and the reports need.

use core::marker::PhantomData;

use crate::error_sums::{ErrorSums, Plain, Weighted};
use crate::index::{Index, Indices};
use crate::number::Number;
use crate::store::{Reader, Writer};

/// One valid tick and the readings before it.
#[derive(Debug, Clone, Copy)]
pub struct Step<N> {
    /// Reference.
    pub r: N,
    /// Measured output.
    pub y: N,
    /// Controller output.
    pub u: N,
    /// Reference one tick earlier.
    pub r_before: N,
    /// Measured output one tick earlier.
    pub y_before: N,
}

/// How a window's raw sums become indices in units and seconds.
#[derive(Debug, Clone, Copy)]
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
    /// No tick yet.
    const EMPTY: Self::Block;
    /// Takes a block's place in the window that had too few valid ticks.
    const INVALID: Self::Block;
    /// The readings before are needed at every tick.
    const USES_BEFORE: bool;
    /// y of the tick before, where the set needs it.
    type YBefore: Copy + core::fmt::Debug + Default;
    /// The longest block whose sums can't overflow, ticks.
    const MAX_BLOCK_TICKS: u32;
    /// Mean u and y, the reference's activity and the motion are kept: the effort and activity channels need them.
    const KEEPS_EFFORT: bool;
    /// Marks the set in saved state.
    const TAG: u8;
    /// Whether the error index is kept.
    fn keeps(index: Index) -> bool;
    /// Stores y for the next tick.
    fn remember_y(memory: &mut Self::YBefore, y: N);
    /// The stored y; zero where the set needs none.
    fn y_before(memory: &Self::YBefore) -> N;
    /// Adds one valid tick.
    fn add(block: &mut Self::Block, step: &Step<N>);
    /// A tick passes without a valid sample.
    fn pass(block: &mut Self::Block);
    /// Not [`IndexSet::INVALID`].
    fn is_valid(block: &Self::Block) -> bool;
    /// As if all `whole` ticks had been valid, not `part`.
    fn extrapolate(block: &mut Self::Block, part: u32, whole: u32);
    /// The window's raw sums so far.
    type Total;
    /// No block yet.
    const NO_BLOCK: Self::Total;
    /// Adds a block that ends before the window's tick `end_ticks`.
    fn fold(total: &mut Self::Total, block: &Self::Block, end_ticks: f32);
    /// Raw sums to units and seconds; what is not kept stays as it is.
    fn scale(total: &Self::Total, by: &Scale, to: &mut Indices);
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
pub struct Pair<J>(PhantomData<J>);

/// Sums of one block of a [`Pair`].
#[derive(Debug, Clone, Copy)]
pub struct PairBlock<S, E> {
    energy: S,
    error: E,
}

impl<J: ErrorIndex> sealed::Sealed for Pair<J> {}

impl<N: Number, J: ErrorIndex> IndexSet<N> for Pair<J> {
    type Block = PairBlock<N::Sum, J::Sums<N>>;
    type YBefore = ();
    const EMPTY: Self::Block = PairBlock { energy: N::NOTHING, error: J::Sums::EMPTY };
    const INVALID: Self::Block = PairBlock { energy: N::NO_SUM, error: J::Sums::EMPTY };
    const USES_BEFORE: bool = false;
    const MAX_BLOCK_TICKS: u32 = J::Sums::<N>::MAX_BLOCK_TICKS;
    const KEEPS_EFFORT: bool = false;
    const TAG: u8 = 1 + J::INDEX as u8;

    fn keeps(index: Index) -> bool {
        index == J::INDEX
    }
    #[inline(always)]
    fn remember_y((): &mut (), _: N) {}
    #[inline(always)]
    fn y_before((): &()) -> N {
        N::ZERO
    }
    #[inline(always)]
    fn add(block: &mut Self::Block, step: &Step<N>) {
        step.u.add_square(&mut block.energy);
        block.error.add(step.r.minus(step.y).magnitude(), J::SQUARED);
    }
    fn pass(block: &mut Self::Block) {
        block.error.pass();
    }
    fn is_valid(block: &Self::Block) -> bool {
        !N::is_no_sum(block.energy)
    }
    fn extrapolate(block: &mut Self::Block, part: u32, whole: u32) {
        block.energy = N::extrapolate(block.energy, part, whole);
        block.error.extrapolate(part, whole);
    }
    type Total = (N::Sum, <J::Sums<N> as ErrorSums<N>>::Total);
    const NO_BLOCK: Self::Total = (N::NOTHING, J::Sums::NO_BLOCK);
    #[inline(always)]
    fn fold(total: &mut Self::Total, block: &Self::Block, end_ticks: f32) {
        N::add_sum(&mut total.0, block.energy);
        block.error.fold(&mut total.1, end_ticks);
    }
    fn scale(total: &Self::Total, by: &Scale, to: &mut Indices) {
        to.e_u = N::sum_to_f32(total.0) * (by.u_unit * by.u_unit * by.tick_s * by.fill);
        *to.error_index_mut(J::INDEX) = J::Sums::<N>::index(total.1) * by.error(J::INDEX);
    }
    fn write(block: &Self::Block, to: &mut Writer<'_>) {
        to.u64(N::sum_to_word(block.energy));
        block.error.write(to);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self::Block> {
        Some(PairBlock { energy: N::sum_from_word(from.u64()?), error: J::Sums::read(from)? })
    }
}

/// Every index: for all channels and for reports that show the whole window.
#[derive(Debug, Clone, Copy)]
pub struct Full;

/// Sums of one block of [`Full`].
#[derive(Debug, Clone, Copy)]
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

/// A window's sums of [`Full`].
#[derive(Debug, Clone, Copy)]
pub struct FullTotal<N: Number> {
    sums: FullBlock<N>,
    itae: f32,
    itse: f32,
}

/// y of the tick before.
#[derive(Debug, Clone, Copy)]
pub struct YBefore<N>(N);

impl<N: Number> Default for YBefore<N> {
    fn default() -> Self {
        Self(N::ZERO)
    }
}

impl sealed::Sealed for Full {}

impl<N: Number> IndexSet<N> for Full {
    type Block = FullBlock<N>;
    type YBefore = YBefore<N>;
    const INVALID: FullBlock<N> = FullBlock { energy: N::NO_SUM, ..Self::EMPTY };
    const USES_BEFORE: bool = true;
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
    fn remember_y(memory: &mut YBefore<N>, y: N) {
        memory.0 = y;
    }
    #[inline(always)]
    fn y_before(memory: &YBefore<N>) -> N {
        memory.0
    }
    #[inline(always)]
    fn add(block: &mut FullBlock<N>, step: &Step<N>) {
        let e = step.r.minus(step.y);
        let (magnitude, u_magnitude) = (e.magnitude(), step.u.magnitude());
        let dy = step.y.minus(step.y_before);
        step.u.add_square(&mut block.energy);
        block.absolute.add(magnitude, false);
        block.square.add(magnitude, true);
        step.u.add(&mut block.u);
        step.y.add(&mut block.y);
        e.add(&mut block.e);
        step.r.minus(step.r_before).add_square(&mut block.reference_step_square);
        step.u.along(dy).add(&mut block.motion_effort);
        dy.magnitude().add(&mut block.travel);
        if magnitude > block.peak_e {
            block.peak_e = magnitude;
        }
        if u_magnitude > block.peak_u {
            block.peak_u = u_magnitude;
        }
    }
    fn pass(block: &mut FullBlock<N>) {
        ErrorSums::<N>::pass(&mut block.absolute);
        ErrorSums::<N>::pass(&mut block.square);
    }
    fn is_valid(block: &FullBlock<N>) -> bool {
        !N::is_no_sum(block.energy)
    }
    fn extrapolate(block: &mut FullBlock<N>, part: u32, whole: u32) {
        block.absolute.extrapolate(part, whole);
        block.square.extrapolate(part, whole);
        for sum in [
            &mut block.energy,
            &mut block.u,
            &mut block.y,
            &mut block.e,
            &mut block.reference_step_square,
            &mut block.motion_effort,
            &mut block.travel,
        ] {
            *sum = N::extrapolate(*sum, part, whole);
        }
    }
    type Total = FullTotal<N>;
    const NO_BLOCK: FullTotal<N> = FullTotal { sums: Self::EMPTY, itae: 0.0, itse: 0.0 };
    fn fold(total: &mut FullTotal<N>, block: &FullBlock<N>, end_ticks: f32) {
        block.absolute.fold(&mut total.itae, end_ticks);
        block.square.fold(&mut total.itse, end_ticks);
        let sums = &mut total.sums;
        sums.absolute.add_plain(&block.absolute);
        sums.square.add_plain(&block.square);
        N::add_sum(&mut sums.energy, block.energy);
        N::add_sum(&mut sums.u, block.u);
        N::add_sum(&mut sums.y, block.y);
        N::add_sum(&mut sums.e, block.e);
        N::add_sum(&mut sums.reference_step_square, block.reference_step_square);
        N::add_sum(&mut sums.motion_effort, block.motion_effort);
        N::add_sum(&mut sums.travel, block.travel);
        sums.peak_u = larger(sums.peak_u, block.peak_u);
        sums.peak_e = larger(sums.peak_e, block.peak_e);
    }
    fn scale(total: &FullTotal<N>, by: &Scale, to: &mut Indices) {
        let sums = &total.sums;
        let mean_u = by.u_unit * by.per_tick;
        let mean_y = by.y_unit * by.per_tick;
        *to = Indices {
            e_u: N::sum_to_f32(sums.energy) * (by.u_unit * by.u_unit * by.tick_s * by.fill),
            iae: sums.absolute.plain() * by.error(Index::Iae),
            ise: sums.square.plain() * by.error(Index::Ise),
            itae: total.itae * by.error(Index::Itae),
            itse: total.itse * by.error(Index::Itse),
            mean_u: N::sum_to_f32(sums.u) * mean_u,
            mean_y: N::sum_to_f32(sums.y) * mean_y,
            mean_e: N::sum_to_f32(sums.e) * mean_y,
            peak_u: sums.peak_u.to_f32() * by.u_unit,
            peak_e: sums.peak_e.to_f32() * by.y_unit,
            reference_activity: N::sum_to_f32(sums.reference_step_square) * (by.y_unit * by.y_unit * by.fill),
            motion_effort: N::sum_to_f32(sums.motion_effort) * mean_u,
            speed: N::sum_to_f32(sums.travel) * (mean_y / by.tick_s),
        };
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
            to.u64(N::sum_to_word(sum));
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
            *sum = N::sum_from_word(from.u64()?);
        }
        block.peak_u = N::from_word(from.u32()?);
        block.peak_e = N::from_word(from.u32()?);
        Some(block)
    }
}

fn larger<N: PartialOrd>(a: N, b: N) -> N {
    if b > a { b } else { a }
}
