//! The window: closed blocks added up. [`Tumbling`] keeps the sum of the blocks so far and forgets them; [`Sliding`]
//! keeps the blocks, for windows that overlap, and adds them up anew at every decision. Both add in the same order
//! with the same code, so that they agree to the last bit, and neither ever subtracts.
//!
//! A block with too few valid ticks is struck: it is taken as the mean of the valid ones at its own place. Sums are
//! scaled for it at the end; for those that are weighted with time each valid block also stands at the places left
//! out.

use core::fmt::Debug;

use crate::index_set::Row;
use crate::store::{Reader, Writer};

/// Which sums need what: constants of the index set.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// Number of sums; what follows in a row are peaks.
    pub sums: usize,
    /// Which sums are weighted with time, and of which other sum.
    pub weighted: &'static [(usize, usize)],
}

/// A block that is to be closed, number by number.
pub trait Block {
    /// A sum.
    fn sum(&self, i: usize) -> f32;
    /// The same for the last time.
    fn take_sum(&mut self, i: usize) -> f32;
    /// A peak.
    fn peak(&self, i: usize) -> f32;
}

/// A block in a row: the sums, then the peaks.
#[derive(Debug)]
pub struct ClosedBlock<'a, C> {
    /// The row.
    pub closed: &'a C,
    /// Number of sums.
    pub sums: usize,
}

impl<C: Row<f32>> Block for ClosedBlock<'_, C> {
    #[inline(always)]
    fn sum(&self, i: usize) -> f32 {
        self.closed.as_ref().get(i).copied().unwrap_or(0.0)
    }
    #[inline(always)]
    fn take_sum(&mut self, i: usize) -> f32 {
        self.sum(i)
    }
    #[inline(always)]
    fn peak(&self, i: usize) -> f32 {
        self.sum(self.sums.wrapping_add(i))
    }
}

/// Blocks added up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Total<C, P> {
    /// The sums, then the peaks.
    pub closed: C,
    placed: P,
    /// Blocks that were not struck.
    pub valid: u16,
    places_left_out: u16,
}

impl<C: Row<f32>, P: Row<f32>> Total<C, P> {
    fn empty() -> Self {
        Self { closed: C::filled(0.0), placed: P::filled(0.0), valid: 0, places_left_out: 0 }
    }

    #[inline]
    fn strike(&mut self, place: u16) {
        self.places_left_out = self.places_left_out.wrapping_add(place);
    }

    #[inline(always)]
    fn fold(&mut self, layout: &Layout, block: &mut impl Block, place: u16) {
        self.valid = self.valid.wrapping_add(1);
        for (placed, &(_, plain)) in self.placed.as_mut().iter_mut().zip(layout.weighted) {
            *placed += f32::from(place) * block.sum(plain);
        }
        let Some((sums, peaks)) = self.closed.as_mut().split_at_mut_checked(layout.sums) else { return };
        // Bounded ranges: `enumerate` counts with a check for overflow where those are on.
        for (total, i) in sums.iter_mut().zip(0..usize::MAX) {
            *total += block.take_sum(i);
        }
        for (total, i) in peaks.iter_mut().zip(0..usize::MAX) {
            let x = block.peak(i);
            if x > *total {
                *total = x;
            }
        }
    }

    /// Moves the weighted sums to their blocks' places; `apart_ticks` between one valid block and the next.
    #[inline(always)]
    pub fn weigh(&mut self, layout: &Layout, apart_ticks: f32) {
        for (&placed, &(weighted, plain)) in self.placed.as_ref().iter().zip(layout.weighted) {
            let plain = self.closed.as_ref().get(plain).copied().unwrap_or(0.0);
            let mut at = placed;
            if self.places_left_out > 0 {
                at += plain * (f32::from(self.places_left_out) / f32::from(self.valid));
            }
            if let Some(weighted) = self.closed.as_mut().get_mut(weighted) {
                *weighted += apart_ticks * at;
            }
        }
    }

    fn write(&self, to: &mut Writer<'_>) {
        self.closed.as_ref().iter().chain(self.placed.as_ref()).for_each(|&x| to.f32_or_nan(x));
        to.u16(self.valid);
        to.u16(self.places_left_out);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let mut read = Self::empty();
        for x in read.closed.as_mut().iter_mut().chain(read.placed.as_mut()) {
            *x = from.f32_or_nan()?;
        }
        (read.valid, read.places_left_out) = (from.u16()?, from.u16()?);
        Some(read)
    }
}

/// How windows follow one another, as a type: [`Tumbling`], [`Sliding`].
pub trait WindowKind: Copy + Debug + 'static {
    /// What is kept of the closed blocks.
    type Blocks<C: Row<f32>, P: Row<f32>>: Blocks<C, P>;
    /// Windows may overlap.
    const SLIDES: bool;
    /// Most blocks per window.
    const CAPACITY: u16;
}

/// What is kept of the closed blocks.
pub trait Blocks<C: Row<f32>, P: Row<f32>>: Copy + Debug {
    /// Saved bytes.
    const BYTES: usize;
    /// None yet.
    fn none() -> Self;
    /// A block is closed, the `place`th of its window; `None` strikes it.
    fn close(&mut self, layout: &Layout, block: Option<&mut impl Block>, place: u16);
    /// Hands over the sum of the newest `blocks`; then a tumbling window begins anew.
    fn with_total<R>(&mut self, layout: &Layout, blocks: u16, of: impl FnOnce(&mut Total<C, P>) -> R) -> R;
    /// Saves.
    fn write(&self, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self>;
}

/// Each window begins where the one before ended: the hop is the window. No ring is kept.
#[derive(Debug, Clone, Copy)]
pub struct Tumbling;

/// Windows of up to `B` blocks (1 to 64) that may overlap.
#[derive(Debug, Clone, Copy)]
pub struct Sliding<const B: usize>;

impl WindowKind for Tumbling {
    type Blocks<C: Row<f32>, P: Row<f32>> = Total<C, P>;
    const SLIDES: bool = false;
    const CAPACITY: u16 = 64;
}

impl<C: Row<f32>, P: Row<f32>> Blocks<C, P> for Total<C, P> {
    const BYTES: usize = size_of::<C>() + size_of::<P>() + 4;
    fn none() -> Self {
        Self::empty()
    }
    #[inline(always)]
    fn close(&mut self, layout: &Layout, block: Option<&mut impl Block>, place: u16) {
        match block {
            Some(block) => self.fold(layout, block, place),
            None => self.strike(place),
        }
    }
    #[inline(always)]
    fn with_total<R>(&mut self, _: &Layout, _: u16, of: impl FnOnce(&mut Self) -> R) -> R {
        let result = of(self);
        *self = Self::empty();
        result
    }
    fn write(&self, to: &mut Writer<'_>) {
        Total::write(self, to);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Total::read(from)
    }
}

/// A ring of closed blocks; the newest at `newest`, the older ones before it and round the end.
#[derive(Debug, Clone, Copy)]
pub struct Ring<C, const B: usize> {
    blocks: [C; B],
    newest: u8,
}

/// The first sum, the energy, of a block that was struck: no sum of squares is negative.
const STRUCK: f32 = -1.0;

impl<const B: usize> WindowKind for Sliding<B> {
    type Blocks<C: Row<f32>, P: Row<f32>> = Ring<C, B>;
    const SLIDES: bool = true;
    const CAPACITY: u16 = B as u16;
}

impl<C: Row<f32>, const B: usize> Ring<C, B> {
    /// The newest `count` blocks, oldest first: two stretches of the ring.
    fn newest(&self, count: usize) -> (&[C], &[C]) {
        let end = usize::from(self.newest) + 1;
        let older = self.blocks.get((B + end).saturating_sub(count).max(end)..).unwrap_or(&[]);
        (older, self.blocks.get(end.saturating_sub(count)..end).unwrap_or(&[]))
    }
}

impl<C: Row<f32>, P: Row<f32>, const B: usize> Blocks<C, P> for Ring<C, B> {
    const BYTES: usize = B * size_of::<C>();
    fn none() -> Self {
        const { assert!(B > 0 && B <= 64, "a sliding window has 1 to 64 blocks") };
        Self { blocks: [C::filled(0.0); B], newest: 0 }
    }
    fn close(&mut self, layout: &Layout, block: Option<&mut impl Block>, _: u16) {
        let next = self.newest.wrapping_add(1);
        self.newest = if usize::from(next) < B { next } else { 0 };
        let Some(place) = self.blocks.get_mut(usize::from(self.newest)) else { return };
        let Some(block) = block else {
            *place = C::filled(STRUCK);
            return;
        };
        if let Some((sums, peaks)) = place.as_mut().split_at_mut_checked(layout.sums) {
            sums.iter_mut().zip(0..usize::MAX).for_each(|(into, i)| *into = block.take_sum(i));
            peaks.iter_mut().zip(0..usize::MAX).for_each(|(into, i)| *into = block.peak(i));
        }
    }
    fn with_total<R>(&mut self, layout: &Layout, blocks: u16, of: impl FnOnce(&mut Total<C, P>) -> R) -> R {
        let mut total = Total::empty();
        let (older, newer) = self.newest(usize::from(blocks));
        let mut place = 0u16;
        for stretch in [older, newer] {
            for block in stretch {
                let struck = block.as_ref().first().is_some_and(|energy| *energy < 0.0);
                if struck {
                    total.strike(place)
                } else {
                    total.fold(layout, &mut ClosedBlock { closed: block, sums: layout.sums }, place)
                }
                place = place.wrapping_add(1);
            }
        }
        of(&mut total)
    }
    fn write(&self, to: &mut Writer<'_>) {
        // The oldest first: wherever the ring stood, the bytes are the same.
        let (older, newer) = self.newest(B);
        let blocks = older.iter().chain(newer);
        blocks.for_each(|block| block.as_ref().iter().for_each(|&x| to.f32_or_nan(x)));
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let mut read = <Self as Blocks<C, P>>::none();
        read.newest = (B - 1) as u8;
        for x in read.blocks.iter_mut().flat_map(|block| block.as_mut()) {
            *x = from.f32_or_nan()?;
        }
        Some(read)
    }
}
