//! The two kinds of sample numbers: `f32` in engineering units, `i32` in converter counts.
//!
//! Sums of `f32` are `f32` (their rounding is bounded by strips and the block ring, see [`crate::Monitor`]); sums of counts are `i64` and
//! exact. On cores without an FPU the second costs 6 to 20 times fewer instructions per tick.

use crate::store::{Reader, Writer};

/// A sample's number. Sealed: implemented for `f32` and `i32`.
pub trait Number: Copy + PartialOrd + core::fmt::Debug + sealed::Sealed + 'static {
    /// What sums of it are kept in.
    type Sum: Copy + core::fmt::Debug + PartialEq;
    /// The empty sum.
    const NOTHING: Self::Sum;
    /// A sum that no sum of squares is.
    const STRUCK: Self::Sum;
    /// Zero.
    const ZERO: Self;
    /// Largest admissible magnitude of r, y and u: beyond it a window's sum could overflow.
    /// 1e12 for `f32`; 2^20 - 1 for counts.
    const LIMIT: Self;
    /// Ticks that a block may hold when it sums `t*e^2`, the index that grows fastest.
    const MAX_BLOCK_TICKS_WEIGHTED: u32;
    /// Sums do not round: strips would buy nothing.
    const EXACT: bool;
    /// Marks the number's type in saved state.
    const TAG: u8;

    /// Finite and within [`Number::LIMIT`].
    fn admissible(self) -> bool;
    /// True only if all three are admissible; may be false for admissible ones close to the limit. The tick path
    /// asks this first.
    fn surely_admissible(r: Self, y: Self, u: Self) -> bool;
    /// Where sums are exact: from the sum of a stretch and the sum of its running sums to the sum weighted with time,
    /// for a stretch that ends before tick `end`.
    fn weigh(sum: Self::Sum, running: Self::Sum, end: u32) -> Self::Sum;
    /// `sum += term`.
    fn add_sum(sum: &mut Self::Sum, term: Self::Sum);
    /// Below zero.
    fn is_negative(sum: Self::Sum) -> bool;
    /// NaN or infinite; never for counts.
    fn non_finite(self) -> bool;
    /// `self - other`; exact for admissible counts.
    fn minus(self, other: Self) -> Self;
    /// Magnitude.
    fn magnitude(self) -> Self;
    /// -1, 0 or 1 times `self`, by the sign of `direction`.
    fn along(self, direction: Self) -> Self;
    /// `sum += self`.
    fn add(self, sum: &mut Self::Sum);
    /// `sum += self^2`.
    fn add_square(self, sum: &mut Self::Sum);
    /// `sum += weight*self`.
    fn add_weighted(self, weight: u32, sum: &mut Self::Sum);
    /// `sum += weight*self^2`.
    fn add_weighted_square(self, weight: u32, sum: &mut Self::Sum);
    /// `a + b`.
    fn join(a: Self::Sum, b: Self::Sum) -> Self::Sum;
    /// `sum*whole/part`: what the sum would be, had all of a block's ticks been valid.
    fn extrapolate(sum: Self::Sum, part: u32, whole: u32) -> Self::Sum;
    /// The sum as `f32`, to be scaled at the hop.
    fn sum_to_f32(sum: Self::Sum) -> f32;
    /// The number as `f32`.
    fn to_f32(self) -> f32;
    /// The number's 32 bits.
    fn to_word(self) -> u32;
    /// From 32 bits.
    fn from_word(word: u32) -> Self;
    /// Saves a sum.
    fn write_sum(sum: Self::Sum, to: &mut Writer<'_>);
    /// Restores a sum; `None` past the end, or if it is not finite.
    fn read_sum(from: &mut Reader<'_>) -> Option<Self::Sum>;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for i32 {}
}

/// A core without floating-point registers: comparisons of bits are cheaper there.
pub(crate) const SOFT_FLOAT: bool =
    cfg!(any(all(target_arch = "arm", target_abi = "eabi"), target_arch = "riscv32"));

impl Number for f32 {
    type Sum = f32;
    const NOTHING: f32 = 0.0;
    const STRUCK: f32 = -1.0;
    const ZERO: f32 = 0.0;
    // |e| <= 2e12, and the sum of t*e^2 over the longest window of 64*65535 ticks stays below 4e37.
    const LIMIT: f32 = 1e12;
    const MAX_BLOCK_TICKS_WEIGHTED: u32 = u16::MAX as u32;
    const EXACT: bool = false;
    const TAG: u8 = 1;

    #[inline(always)]
    fn admissible(self) -> bool {
        // One comparison refuses NaN, infinities and what would overflow.
        self.abs() <= Self::LIMIT
    }
    #[inline(always)]
    fn surely_admissible(r: f32, y: f32, u: f32) -> bool {
        if SOFT_FLOAT {
            // Magnitudes order as their bits do: no float routine is called.
            let limit = Self::LIMIT.to_bits();
            r.abs().to_bits() <= limit && y.abs().to_bits() <= limit && u.abs().to_bits() <= limit
        } else {
            // One comparison for all three; a NaN in any of them fails it.
            r.abs() + y.abs() + u.abs() <= Self::LIMIT
        }
    }
    fn weigh(_: f32, weighted: f32, _: u32) -> f32 {
        weighted
    }
    #[inline(always)]
    fn add_sum(sum: &mut f32, term: f32) {
        *sum += term;
    }
    #[inline]
    fn is_negative(sum: f32) -> bool {
        sum.is_sign_negative()
    }
    #[inline]
    fn non_finite(self) -> bool {
        !self.is_finite()
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self - other
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn along(self, direction: Self) -> Self {
        if direction > 0.0 {
            self
        } else if direction < 0.0 {
            -self
        } else {
            0.0
        }
    }
    #[inline(always)]
    fn add(self, sum: &mut f32) {
        *sum += self;
    }
    #[inline(always)]
    fn add_square(self, sum: &mut f32) {
        *sum += self * self;
    }
    #[inline(always)]
    fn add_weighted(self, weight: u32, sum: &mut f32) {
        *sum += weight as f32 * self;
    }
    #[inline(always)]
    fn add_weighted_square(self, weight: u32, sum: &mut f32) {
        *sum += weight as f32 * (self * self);
    }
    #[inline]
    fn join(a: f32, b: f32) -> f32 {
        a + b
    }
    #[inline]
    fn extrapolate(sum: f32, part: u32, whole: u32) -> f32 {
        sum * (whole as f32 / part.max(1) as f32)
    }
    #[inline]
    fn sum_to_f32(sum: f32) -> f32 {
        sum
    }
    #[inline]
    fn to_f32(self) -> f32 {
        self
    }
    fn to_word(self) -> u32 {
        self.to_bits()
    }
    fn from_word(word: u32) -> Self {
        Self::from_bits(word)
    }
    fn write_sum(sum: f32, to: &mut Writer<'_>) {
        to.f32(sum);
    }
    fn read_sum(from: &mut Reader<'_>) -> Option<f32> {
        from.f32()
    }
}

impl Number for i32 {
    type Sum = i64;
    const NOTHING: i64 = 0;
    const STRUCK: i64 = -1;
    const ZERO: i32 = 0;
    // |e| < 2^21, e^2 < 2^42, and the sum of j*e^2 over j < 2048 stays below 2^63.
    const LIMIT: i32 = (1 << 20) - 1;
    const MAX_BLOCK_TICKS_WEIGHTED: u32 = 2048;
    const EXACT: bool = true;
    const TAG: u8 = 2;

    #[inline(always)]
    fn admissible(self) -> bool {
        // One unsigned comparison; i32::MIN wraps to a large number and is refused as well.
        self.wrapping_add(Self::LIMIT) as u32 <= 2 * Self::LIMIT as u32
    }
    #[inline(always)]
    fn surely_admissible(r: i32, y: i32, u: i32) -> bool {
        r.admissible() && y.admissible() && u.admissible()
    }
    fn weigh(sum: i64, running: i64, end: u32) -> i64 {
        // Whatever wraps in between, the result is exact: it fits.
        sum.wrapping_mul(i64::from(end)).wrapping_sub(running)
    }
    #[inline(always)]
    fn add_sum(sum: &mut i64, term: i64) {
        *sum = sum.wrapping_add(term);
    }
    #[inline]
    fn is_negative(sum: i64) -> bool {
        sum < 0
    }
    #[inline]
    fn non_finite(self) -> bool {
        false
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.wrapping_sub(other)
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.wrapping_abs()
    }
    #[inline(always)]
    fn along(self, direction: Self) -> Self {
        self.wrapping_mul(direction.signum())
    }
    #[inline(always)]
    fn add(self, sum: &mut i64) {
        *sum = sum.wrapping_add(i64::from(self));
    }
    #[inline(always)]
    fn add_square(self, sum: &mut i64) {
        *sum = sum.wrapping_add(i64::from(self) * i64::from(self));
    }
    #[inline(always)]
    fn add_weighted(self, weight: u32, sum: &mut i64) {
        *sum = sum.wrapping_add(i64::from(self) * i64::from(weight));
    }
    #[inline(always)]
    fn add_weighted_square(self, weight: u32, sum: &mut i64) {
        *sum = sum.wrapping_add((i64::from(self) * i64::from(self)).wrapping_mul(i64::from(weight)));
    }
    #[inline]
    fn join(a: i64, b: i64) -> i64 {
        a.saturating_add(b)
    }
    fn extrapolate(sum: i64, part: u32, whole: u32) -> i64 {
        let (part, whole) = (i64::from(part.max(1)), i64::from(whole));
        // Whole part and remainder apart: the product of the sum itself could overflow.
        (sum / part).saturating_mul(whole).saturating_add(sum % part * whole / part)
    }
    #[inline]
    fn sum_to_f32(sum: i64) -> f32 {
        sum as f32
    }
    #[inline]
    fn to_f32(self) -> f32 {
        self as f32
    }
    fn to_word(self) -> u32 {
        self as u32
    }
    fn from_word(word: u32) -> Self {
        word as i32
    }
    fn write_sum(sum: i64, to: &mut Writer<'_>) {
        to.u64(sum as u64);
    }
    fn read_sum(from: &mut Reader<'_>) -> Option<i64> {
        from.u64().map(|word| word as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_floats_are_not_admissible_and_small_ones_are() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1.1e12] {
            assert!(!bad.admissible(), "{bad}");
        }
        for good in [0.0, -0.0, f32::MIN_POSITIVE, 1e-45, 1e12, -1e12] {
            assert!(good.admissible(), "{good}");
        }
    }

    #[test]
    fn hostile_counts_are_not_admissible() {
        for bad in [i32::MIN, i32::MIN + 1, i32::MAX, 1 << 20, -(1 << 20)] {
            assert!(!bad.admissible(), "{bad}");
        }
        for good in [0, 1, -1, (1 << 20) - 1, 1 - (1 << 20)] {
            assert!(good.admissible(), "{good}");
        }
    }

    #[test]
    fn the_largest_count_block_does_not_overflow() {
        let mut sum = 0i64;
        let e = 2 * <i32 as Number>::LIMIT;
        for j in 0..<i32 as Number>::MAX_BLOCK_TICKS_WEIGHTED {
            e.add_weighted_square(j, &mut sum);
        }
        let exact: i128 = (0..2048i128).map(|j| j * i128::from(e) * i128::from(e)).sum();
        assert_eq!(i128::from(sum), exact);
    }

    #[test]
    fn extrapolated_counts_are_exact_where_they_divide() {
        assert_eq!(<i32 as Number>::extrapolate(900, 3, 10), 3000);
        assert_eq!(<i32 as Number>::extrapolate(-7, 2, 4), -14);
    }
}
