//! The two kinds of sample numbers: `f32` in engineering units, `i32` in converter counts.
//!
//! Sums of `f32` are `f32` (their rounding is bounded by strips that are joined with a carry, see
//! [`crate::Monitor`]); sums of counts are `i64` and exact. On cores without an FPU the second costs 6 to 20 times
//! fewer instructions per tick.

use crate::config::{Config, ConfigError};
use crate::index_set::IndexSet;
use crate::monitor::Plan;
use crate::options::Options;
use crate::store::{Reader, Writer};

/// A sample's number. Sealed: implemented for `f32` and `i32`.
pub trait Number: Copy + PartialOrd + core::fmt::Debug + sealed::Sealed + 'static {
    /// What sums of it are kept in.
    type Sum: Copy + core::fmt::Debug + PartialEq;
    /// What the strips of a block are joined in; empty where sums are exact.
    type Joined: Copy + core::fmt::Debug + PartialEq;
    /// The empty sum.
    const NOTHING: Self::Sum;
    /// No strip yet.
    const NOTHING_JOINED: Self::Joined;
    /// Saved bytes of a sum.
    const SUM_BYTES: usize;
    /// Saved bytes of a joined sum.
    const JOINED_BYTES: usize;
    /// Zero.
    const ZERO: Self;
    /// Largest admissible magnitude of r, y and u: beyond it a window's sum could overflow.
    /// 1e12 for `f32`; 2^20 - 1 for counts.
    const LIMIT: Self;
    /// Ticks that a block may hold when it sums `t*e^2`, the index that grows fastest.
    const MAX_BLOCK_TICKS_WEIGHTED: u32;
    /// Below every admissible number.
    const LOWEST: Self;
    /// Above every admissible number.
    const HIGHEST: Self;
    /// Sums do not round: strips would buy nothing.
    const EXACT: bool;
    /// Marks the number's type in saved state.
    const TAG: u8;

    /// [`Plan::new`] where the number is not known: not `const`.
    ///
    /// # Errors
    /// As [`Plan::new`].
    fn plan<S: IndexSet<Self>, O: Options, const C: usize>(
        config: Config<Self, C>,
    ) -> Result<Plan<Self, S, O, C>, ConfigError>;

    /// Finite and within [`Number::LIMIT`].
    fn admissible(self) -> bool;
    /// True only if all three are admissible; may be false for admissible ones close to the limit. The tick path
    /// asks this first.
    fn surely_admissible(r: Self, y: Self, u: Self) -> bool;
    /// Adds what r, y and u amount to, for [`Number::all_admissible`].
    fn add_size(size: &mut Self::Sum, r: Self, y: Self, u: Self);
    /// True only if all whose sizes were added are surely admissible; false for some admissible ones far above what loops have.
    fn all_admissible<const K: usize>(sizes: [Self::Sum; K]) -> bool;
    /// `sum += term`.
    fn add_sum(sum: &mut Self::Sum, term: Self::Sum);
    /// Adds a strip to the block; nothing to do where sums are exact.
    fn join(joined: &mut Self::Joined, strip: Self::Sum);
    /// The block's sum: its joined strips and the open one.
    fn closed(joined: &Self::Joined, sum: Self::Sum) -> f32;
    /// The same of a sum weighted with time, where sums are exact: `weighted` is the sum of the running sums of `plain`
    /// after each of the block's `ticks`. Others are joined as they are.
    fn closed_weighted(weighted: Self::Sum, plain: Self::Sum, ticks: u32) -> f32;
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
    /// Saves a joined sum.
    fn write_joined(joined: &Self::Joined, to: &mut Writer<'_>);
    /// Restores a joined sum; `None` past the end, or if it is not finite.
    fn read_joined(from: &mut Reader<'_>) -> Option<Self::Joined>;
}

/// A sum of strips and what its last additions rounded away (Kahan 1965).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried {
    sum: f32,
    carry: f32,
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
    type Joined = Carried;
    const NOTHING: f32 = 0.0;
    const NOTHING_JOINED: Carried = Carried { sum: 0.0, carry: 0.0 };
    const SUM_BYTES: usize = 4;
    const JOINED_BYTES: usize = 8;
    const ZERO: f32 = 0.0;
    // |e| <= 2e12, and the sum of t*e^2 over the longest window of 64*65535 ticks stays below 4e37.
    const LIMIT: f32 = 1e12;
    const MAX_BLOCK_TICKS_WEIGHTED: u32 = u16::MAX as u32;
    const LOWEST: f32 = f32::NEG_INFINITY;
    const HIGHEST: f32 = f32::INFINITY;
    const EXACT: bool = false;
    const TAG: u8 = 1;

    fn plan<S: IndexSet<Self>, O: Options, const C: usize>(
        config: Config<Self, C>,
    ) -> Result<Plan<Self, S, O, C>, ConfigError> {
        Plan::<f32, S, O, C>::new(config)
    }

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
            // One comparison for all three; a NaN in any of them fails it. The error stands in for r, of which it is
            // within a factor of two: its magnitude is needed anyway.
            (r - y).abs() + y.abs() + u.abs() <= 0.5 * Self::LIMIT
        }
    }
    #[inline(always)]
    fn add_size(size: &mut f32, r: f32, y: f32, u: f32) {
        *size += (r - y).abs() + y.abs() + u.abs();
    }
    #[inline(always)]
    fn all_admissible<const K: usize>(sizes: [f32; K]) -> bool {
        // None is negative, so none is larger than the sum; a NaN makes a NaN of it.
        sizes.iter().sum::<f32>() <= 0.5 * Self::LIMIT
    }
    #[inline(always)]
    fn add_sum(sum: &mut f32, term: f32) {
        *sum += term;
    }
    #[inline]
    fn join(joined: &mut Carried, strip: f32) {
        let term = strip - joined.carry;
        let sum = joined.sum + term;
        joined.carry = (sum - joined.sum) - term;
        joined.sum = sum;
    }
    #[inline]
    fn closed(joined: &Carried, strip: f32) -> f32 {
        joined.sum + (strip - joined.carry)
    }
    #[inline]
    fn closed_weighted(weighted: f32, _: f32, _: u32) -> f32 {
        weighted
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
    fn write_joined(joined: &Carried, to: &mut Writer<'_>) {
        to.f32(joined.sum);
        to.f32(joined.carry);
    }
    fn read_joined(from: &mut Reader<'_>) -> Option<Carried> {
        Some(Carried { sum: from.f32()?, carry: from.f32()? })
    }
}

impl Number for i32 {
    type Sum = i64;
    type Joined = ();
    const NOTHING: i64 = 0;
    const NOTHING_JOINED: () = ();
    const SUM_BYTES: usize = 8;
    const JOINED_BYTES: usize = 0;
    const ZERO: i32 = 0;
    // |e| < 2^21, e^2 < 2^42, and the sum of j*e^2 over j < 2048 stays below 2^63.
    const LIMIT: i32 = (1 << 20) - 1;
    const MAX_BLOCK_TICKS_WEIGHTED: u32 = 2048;
    const LOWEST: i32 = i32::MIN;
    const HIGHEST: i32 = i32::MAX;
    const EXACT: bool = true;
    const TAG: u8 = 2;

    fn plan<S: IndexSet<Self>, O: Options, const C: usize>(
        config: Config<Self, C>,
    ) -> Result<Plan<Self, S, O, C>, ConfigError> {
        Plan::<i32, S, O, C>::new(config)
    }

    #[inline(always)]
    fn admissible(self) -> bool {
        // One unsigned comparison; i32::MIN wraps to a large number and is refused as well.
        self.wrapping_add(Self::LIMIT) as u32 <= 2 * Self::LIMIT as u32
    }
    #[inline(always)]
    fn surely_admissible(r: i32, y: i32, u: i32) -> bool {
        r.admissible() && y.admissible() && u.admissible()
    }
    #[inline(always)]
    fn add_size(refused: &mut i64, r: i32, y: i32, u: i32) {
        *refused |= i64::from(!Self::surely_admissible(r, y, u));
    }
    #[inline(always)]
    fn all_admissible<const K: usize>(refused: [i64; K]) -> bool {
        refused.iter().all(|refused| *refused == 0)
    }
    #[inline(always)]
    fn add_sum(sum: &mut i64, term: i64) {
        *sum = sum.wrapping_add(term);
    }
    #[inline(always)]
    fn join((): &mut (), _: i64) {}
    #[inline]
    fn closed((): &(), sum: i64) -> f32 {
        sum as f32
    }
    #[inline]
    fn closed_weighted(weighted: i64, plain: i64, ticks: u32) -> f32 {
        // Whatever wraps in between, the result is exact: it fits.
        plain.wrapping_mul(i64::from(ticks)).wrapping_sub(weighted) as f32
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
        *sum = sum.wrapping_add(i64::from(self).wrapping_mul(i64::from(self)));
    }
    #[inline(always)]
    fn add_weighted(self, weight: u32, sum: &mut i64) {
        *sum = sum.wrapping_add(i64::from(self).wrapping_mul(i64::from(weight)));
    }
    #[inline(always)]
    fn add_weighted_square(self, weight: u32, sum: &mut i64) {
        *sum =
            sum.wrapping_add(i64::from(self).wrapping_mul(i64::from(self)).wrapping_mul(i64::from(weight)));
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
    fn write_joined((): &(), _: &mut Writer<'_>) {}
    fn read_joined(_: &mut Reader<'_>) -> Option<()> {
        Some(())
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
}
