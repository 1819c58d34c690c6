//! What is summed per tick: [`Pair`] keeps the paper's pair (E_u and one error index), [`Full`] everything that
//! the three residual channels and the reports need, [`FullAt`] a measured operating point as well.
//!
//! A set is a row of sums. Per tick each of them grows; what is done with a whole row (joining strips, closing a
//! block, adding up a window) is written once, in [`crate::window`] and [`crate::Plan`], and reads the constants here.
//!
//! A weighted sum uses the tick within the block; the block's own place in the window comes in when the window
//! is put together (`sum (offset + j) x = sum j x + offset sum x`). The recursion that is often used instead
//! integrates its own rounding error: 63 % off after 14 hours at 1 kHz.

use core::fmt::Debug;
use core::marker::PhantomData;

use crate::channel::ChannelKind;
use crate::index::{Index, Indices, IndicesAt, PairIndices};
use crate::number::Number;
use crate::trace::{NoTrace, TimeTrace, Trace, WholeTrace};

/// An array of fixed length.
pub trait Row<T: Copy>: Copy + Debug + AsRef<[T]> + AsMut<[T]> {
    /// The same number everywhere.
    fn filled(with: T) -> Self;
}

impl<T: Copy + Debug, const K: usize> Row<T> for [T; K] {
    fn filled(with: T) -> Self {
        [with; K]
    }
}

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
    fn energy(&self) -> f32 {
        self.u_unit * self.u_unit * self.tick_s * self.fill
    }

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

/// What is summed per tick. Sealed: [`Pair`], [`Full`] and [`FullAt`].
pub trait IndexSet<N: Number>: sealed::Sealed + Copy + Debug + 'static {
    /// The sums of the open strip.
    type Sums: Row<N::Sum>;
    /// The strips of the open block, joined.
    type Joined: Row<N::Joined>;
    /// The largest magnitudes of the open block.
    type Peaks: Row<N>;
    /// A closed block, and a window: the sums, then the peaks.
    type Closed: Row<f32>;
    /// For each weighted sum, the plain one times the block's place in the window.
    type Placed: Row<f32>;
    /// What gaps and differences need to be known besides.
    type Trace: Trace<N>;
    /// What a window amounts to.
    type Indices: Copy + Debug + PartialEq;
    /// The operating point as it comes with a tick: one number, or none.
    type Point: Row<N>;
    /// Its mean over a window.
    type PointMean: Row<f32>;
    /// No tick yet.
    const NO_SUMS: Self::Sums;
    /// No strip yet.
    const NO_STRIPS: Self::Joined;
    /// No tick yet.
    const NO_PEAKS: Self::Peaks;
    /// Before the first window.
    const NO_INDICES: Self::Indices;
    /// Number of sums.
    const SUMS: usize;
    /// Which sums are weighted with time, and of which other sum.
    const WEIGHTED: &'static [(usize, usize)];
    /// Sums from here on are of differences from tick to tick.
    const DIFFERENCES_FROM: usize;
    /// The longest block whose sums can't overflow, ticks.
    const MAX_BLOCK_TICKS: u32;
    /// Mean u and y, the reference's activity and the motion are kept: the effort and activity channels need them.
    const KEEPS_EFFORT: bool;
    /// The error indices that are kept: bit `index as u8`.
    const KEEPS: u8;
    /// A measured operating point is kept.
    const KEEPS_POINT: bool = false;
    /// Marks the set in saved state.
    const TAG: u8;
    /// Adds one valid tick.
    fn add(
        sums: &mut Self::Sums,
        peaks: &mut Self::Peaks,
        tick_in_block: u32,
        step: &Step<N>,
        point: &Self::Point,
    );
    /// The window's raw sums in units and seconds.
    fn indices(window: &Self::Closed, by: &Scale) -> Self::Indices;
    /// (x, value) of a channel: where on the baseline's axis the window lies, and the index that is judged there.
    fn coordinates(of: &Self::Indices, kind: ChannelKind) -> (f32, f32);
    /// The operating point's mean, if one is kept.
    fn point_mean(of: &Self::Indices) -> Self::PointMean;
}

mod sealed {
    pub trait Sealed {}
}

macro_rules! error_index {
    ($name:ident, $squared:literal, $sums:literal, $weighted:expr, $trace:ty) => {
        #[doc = concat!("[`Index::", stringify!($name), "`] as a type, for [`Pair`].")]
        #[derive(Debug, Clone, Copy)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $name;
        impl sealed::Sealed for Pair<$name> {}
        impl<N: Number> IndexSet<N> for Pair<$name> {
            type Sums = [N::Sum; $sums];
            type Joined = [N::Joined; $sums];
            type Peaks = [N; 0];
            type Closed = [f32; $sums];
            type Placed = [f32; $sums - 2];
            type Trace = $trace;
            type Indices = PairIndices;
            type Point = [N; 0];
            type PointMean = [f32; 0];
            const NO_SUMS: [N::Sum; $sums] = [N::NOTHING; $sums];
            const NO_STRIPS: [N::Joined; $sums] = [N::NOTHING_JOINED; $sums];
            const NO_PEAKS: [N; 0] = [];
            const NO_INDICES: PairIndices = PairIndices { e_u: f32::NAN, error: f32::NAN };
            const SUMS: usize = $sums;
            const WEIGHTED: &'static [(usize, usize)] = &$weighted;
            const DIFFERENCES_FROM: usize = $sums;
            const MAX_BLOCK_TICKS: u32 =
                if $sums > 2 { N::MAX_BLOCK_TICKS_WEIGHTED } else { u16::MAX as u32 };
            const KEEPS_EFFORT: bool = false;
            const KEEPS: u8 = 1 << Index::$name as u8;
            const TAG: u8 = 1 + Index::$name as u8;

            #[inline(always)]
            fn add(
                sums: &mut [N::Sum; $sums],
                _: &mut [N; 0],
                tick_in_block: u32,
                step: &Step<N>,
                _: &[N; 0],
            ) {
                let [energy, error, weighted @ ..] = sums;
                step.u.add_square(energy);
                let magnitude = step.r.minus(step.y).magnitude();
                add_error::<N>(error, weighted, tick_in_block, magnitude, $squared);
            }
            #[inline]
            fn indices(window: &[f32; $sums], by: &Scale) -> PairIndices {
                // The last sum is the weighted one, where there is one.
                let [e_u, .., error] = *window;
                PairIndices { e_u: e_u * by.energy(), error: error * by.error(Index::$name) }
            }
            #[inline(always)]
            fn coordinates(of: &PairIndices, _: ChannelKind) -> (f32, f32) {
                (of.e_u, of.error)
            }
            #[inline(always)]
            fn point_mean(_: &PairIndices) -> [f32; 0] {
                []
            }
        }
    };
}

/// Of counts, the weighted sum grows by the plain one: in the end a value is in it once for every tick from its own
/// to the block's end. That saves two 64-bit multiplications a tick; rounded numbers would cancel where it is turned
/// into the other.
#[inline(always)]
fn add_error<N: Number>(
    plain: &mut N::Sum,
    weighted: &mut [N::Sum],
    tick_in_block: u32,
    magnitude: N,
    squared: bool,
) {
    if squared {
        magnitude.add_square(plain);
    } else {
        magnitude.add(plain);
    }
    for weighted in weighted {
        if N::EXACT {
            N::add_sum(weighted, *plain);
        } else if squared {
            magnitude.add_weighted_square(tick_in_block, weighted);
        } else {
            magnitude.add_weighted(tick_in_block, weighted);
        }
    }
}

error_index!(Iae, false, 2, [], NoTrace);
error_index!(Ise, true, 2, [], NoTrace);
error_index!(Itae, false, 3, [(2, 1)], TimeTrace);
error_index!(Itse, true, 3, [(2, 1)], TimeTrace);

/// The paper's pair: E_u and one error index. Two sums, three for ITAE and ITSE.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pair<J>(PhantomData<J>);

/// Every index: for all channels and for reports that show the whole window.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Full;

/// As [`Full`], and the mean of a measured operating point: one more number in the tick, one more sum.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FullAt;

/// Indices with `P` means of operating points.
trait AtPoint<const P: usize> {
    fn of(indices: Indices, point: [f32; P]) -> Self;
    fn indices(&self) -> &Indices;
    fn point(&self) -> [f32; P];
}

impl AtPoint<0> for Indices {
    #[inline(always)]
    fn of(indices: Indices, _: [f32; 0]) -> Self {
        indices
    }
    #[inline(always)]
    fn indices(&self) -> &Indices {
        self
    }
    #[inline(always)]
    fn point(&self) -> [f32; 0] {
        []
    }
}

impl AtPoint<1> for IndicesAt {
    #[inline(always)]
    fn of(indices: Indices, [operating_point]: [f32; 1]) -> Self {
        Self { indices, operating_point }
    }
    #[inline(always)]
    fn indices(&self) -> &Indices {
        &self.indices
    }
    #[inline(always)]
    fn point(&self) -> [f32; 1] {
        [self.operating_point]
    }
}

/// `$points`: numbers that come with a tick besides r, y and u.
macro_rules! full {
    ($name:ident, $points:literal, $Indices:ty, $tag:literal) => {
        impl sealed::Sealed for $name {}

        impl<N: Number> IndexSet<N> for $name {
            // u^2, |e|, t |e|, e^2, t e^2, u, y, e, the points; then of differences: dr^2, u sign(dy), |dy|.
            type Sums = [N::Sum; 11 + $points];
            type Joined = [N::Joined; 11 + $points];
            type Peaks = [N; 2];
            type Closed = [f32; 13 + $points];
            type Placed = [f32; 2];
            type Trace = WholeTrace<N>;
            type Indices = $Indices;
            type Point = [N; $points];
            type PointMean = [f32; $points];
            const NO_SUMS: Self::Sums = [N::NOTHING; 11 + $points];
            const NO_STRIPS: Self::Joined = [N::NOTHING_JOINED; 11 + $points];
            const NO_PEAKS: [N; 2] = [N::ZERO; 2];
            const NO_INDICES: $Indices = <$Indices>::NOT_KEPT;
            const SUMS: usize = 11 + $points;
            const WEIGHTED: &'static [(usize, usize)] = &[(2, 1), (4, 3)];
            const DIFFERENCES_FROM: usize = 8 + $points;
            const MAX_BLOCK_TICKS: u32 = N::MAX_BLOCK_TICKS_WEIGHTED;
            const KEEPS_EFFORT: bool = true;
            const KEEPS: u8 = 0b1111;
            const KEEPS_POINT: bool = $points > 0;
            const TAG: u8 = $tag;

            #[inline(always)]
            fn add(
                sums: &mut Self::Sums,
                peaks: &mut [N; 2],
                tick_in_block: u32,
                step: &Step<N>,
                point: &[N; $points],
            ) {
                let [energy, absolute, t_absolute, square, t_square, u, y, e, rest @ ..] = sums;
                let [points @ .., activity, motion_effort, travel] = rest;
                let [peak_u, peak_e] = peaks;
                let error = step.r.minus(step.y);
                let (magnitude, u_magnitude) = (error.magnitude(), step.u.magnitude());
                // The peaks part the sums: all at once would take one register more than there are.
                step.u.add_square(energy);
                step.u.add(u);
                step.y.add(y);
                error.add(e);
                if u_magnitude > *peak_u {
                    *peak_u = u_magnitude;
                }
                add_error::<N>(absolute, core::slice::from_mut(t_absolute), tick_in_block, magnitude, false);
                add_error::<N>(square, core::slice::from_mut(t_square), tick_in_block, magnitude, true);
                if magnitude > *peak_e {
                    *peak_e = magnitude;
                }
                for (sum, point) in points.iter_mut().zip(point) {
                    point.add(sum);
                }
                step.r.minus(step.r_before).add_square(activity);
                let dy = step.y.minus(step.y_before);
                step.u.along(dy).add(motion_effort);
                dy.magnitude().add(travel);
            }

            fn indices(window: &Self::Closed, by: &Scale) -> $Indices {
                let [e_u, iae, itae, ise, itse, u, y, e, rest @ ..] = *window;
                let [point @ .., activity, motion_effort, travel, peak_u, peak_e] = rest;
                let (mean_u, mean_y) = (by.u_unit * by.per_tick, by.y_unit * by.per_tick);
                let indices = Indices {
                    e_u: e_u * by.energy(),
                    iae: iae * by.error(Index::Iae),
                    ise: ise * by.error(Index::Ise),
                    itae: itae * by.error(Index::Itae),
                    itse: itse * by.error(Index::Itse),
                    mean_u: u * mean_u,
                    mean_y: y * mean_y,
                    mean_e: e * mean_y,
                    peak_u: peak_u * by.u_unit,
                    peak_e: peak_e * by.y_unit,
                    reference_activity: activity * (by.y_unit * by.y_unit * by.fill),
                    motion_effort: motion_effort * mean_u,
                    speed: travel * (mean_y / by.tick_s),
                };
                // A point has no unit of its own: its weight is per count where samples are counts.
                AtPoint::of(indices, point.map(|sum| sum * by.per_tick))
            }

            #[inline]
            fn coordinates(of: &$Indices, kind: ChannelKind) -> (f32, f32) {
                kind.coordinates(AtPoint::indices(of))
            }

            #[inline(always)]
            fn point_mean(of: &$Indices) -> [f32; $points] {
                of.point()
            }
        }
    };
}

full!(Full, 0, Indices, 5);
full!(FullAt, 1, IndicesAt, 6);
