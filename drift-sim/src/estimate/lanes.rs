//! Numbers of several runs side by side, or of a single one: what a filter reckons with, written once for both.

use std::ops::{Add, Div, Mul, Sub};

use wide::f64x4;

/// Runs that go side by side.
pub const LANES: usize = 4;

/// Numbers of all lanes, or of the only one.
pub trait Side:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// Which lanes a condition holds in.
    type Mask: Copy;

    /// The numbers of each lane.
    fn of(each: impl Fn(usize) -> f64) -> Self;
    /// The number of one lane.
    fn lane(self, lane: usize) -> f64;
    /// The absolute values.
    fn abs(self) -> Self;
    /// The square roots.
    fn sqrt(self) -> Self;
    /// The natural logarithms.
    fn ln(self) -> Self;
    /// The exponentials.
    fn exp(self) -> Self;
    /// In which lanes this is less than the other.
    fn is_less(self, other: Self) -> Self::Mask;
    /// In which lanes both are the same.
    fn is_same(self, other: Self) -> Self::Mask;
    /// `yes` where the mask holds, else `no`.
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Whether the mask holds anywhere.
    fn holds_anywhere(mask: Self::Mask) -> bool;
    /// Whether the mask holds in a lane.
    fn holds_in(mask: Self::Mask, lane: usize) -> bool;

    /// The same number in all lanes.
    fn all(value: f64) -> Self {
        Self::of(|_| value)
    }
}

impl Side for f64 {
    type Mask = bool;

    #[inline(always)]
    fn of(each: impl Fn(usize) -> f64) -> Self {
        each(0)
    }

    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        libm::log(self)
    }

    #[inline(always)]
    fn exp(self) -> Self {
        libm::exp(self)
    }

    #[inline(always)]
    fn is_less(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    #[expect(clippy::float_cmp, reason = "a mass at rest is exactly at rest")]
    fn is_same(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn choose(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn holds_anywhere(mask: bool) -> bool {
        mask
    }

    #[inline(always)]
    fn holds_in(mask: bool, _: usize) -> bool {
        mask
    }
}

impl Side for f64x4 {
    type Mask = f64x4;

    #[inline(always)]
    fn of(each: impl Fn(usize) -> f64) -> Self {
        Self::from(std::array::from_fn::<f64, LANES, _>(each))
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.to_array().get(lane).copied().unwrap_or(f64::NAN)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64x4::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64x4::sqrt(self)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        f64x4::ln(self)
    }

    #[inline(always)]
    fn exp(self) -> Self {
        f64x4::exp(self)
    }

    #[inline(always)]
    fn is_less(self, other: Self) -> f64x4 {
        self.simd_lt(other)
    }

    #[inline(always)]
    fn is_same(self, other: Self) -> f64x4 {
        self.simd_eq(other)
    }

    #[inline(always)]
    fn choose(mask: f64x4, yes: Self, no: Self) -> Self {
        mask.bitselect(yes, no)
    }

    #[inline(always)]
    fn holds_anywhere(mask: f64x4) -> bool {
        mask.any()
    }

    #[inline(always)]
    fn holds_in(mask: f64x4, lane: usize) -> bool {
        mask.to_bitmask() >> lane & 1 == 1
    }
}
