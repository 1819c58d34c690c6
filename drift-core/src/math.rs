//! The few functions that a hop may need; a tick needs none.
//!
//! `exp` and `ln` come from `libm`. The square root is exact to the last bit as `libm`'s is (a test holds one
//! against the other), but its own: `libm::sqrtf` brings a table of 256 bytes and 250 bytes of code, and takes 570
//! instructions on a Cortex-M0.
//!
//! Under feature `micromath` they are approximate. Its square root alone is up to 6.1 % too large; one Newton step
//! (a division) leaves 0.18 % at worst. What that does, as the tests here measure it:
//! * the prediction band (a root of 1 to 1.5): z is up to 0.03 % too small, for a well-known baseline not at all;
//! * a sigma learnt in place: up to 0.18 % too large, and with it a CUSUM designed for one false alarm in 465
//!   decisions realises up to 473.

use crate::number::SOFT_FLOAT;

#[cfg(not(any(feature = "libm", feature = "micromath")))]
compile_error!("drift-core needs a square root: enable feature `libm` (exact) or `micromath` (approximate)");

#[cfg(feature = "micromath")]
mod chosen {
    use micromath::F32Ext;
    pub fn sqrt(x: f32) -> f32 {
        if x.is_nan() || x <= 0.0 {
            // micromath's root of zero is not zero.
            return 0.0;
        }
        let root = F32Ext::sqrt(x);
        0.5 * (root + x / root)
    }
    pub fn exp(x: f32) -> f32 {
        F32Ext::exp(x)
    }
    pub fn ln(x: f32) -> f32 {
        F32Ext::ln(x)
    }
}

#[cfg(all(feature = "libm", not(feature = "micromath")))]
mod chosen {
    pub use super::exact::sqrt;
    pub fn exp(x: f32) -> f32 {
        libm::expf(x)
    }
    pub fn ln(x: f32) -> f32 {
        libm::logf(x)
    }
}

#[cfg(any(not(feature = "micromath"), all(test, feature = "libm")))]
mod exact {
    use super::{SOFT_FLOAT, exceeds};

    const HIDDEN: u32 = 1 << 23;

    /// Square root, correctly rounded; NaN below zero.
    #[inline(never)]
    pub fn sqrt(x: f32) -> f32 {
        let bits = x.to_bits();
        // Zero, NaN, infinity and what is negative.
        if !exceeds(x, 0.0) || bits >= f32::INFINITY.to_bits() {
            return if x < 0.0 { f32::NAN } else { x };
        }
        // x = mantissa*2^(exponent - 23) with 24 bits of mantissa, subnormal numbers included.
        let (mut mantissa, mut exponent) = (bits, ((bits >> 23) as i32).wrapping_sub(127));
        if bits >= HIDDEN {
            mantissa = (bits & (HIDDEN - 1)) | HIDDEN;
        } else {
            exponent = -126;
            while mantissa < HIDDEN {
                mantissa <<= 1;
                exponent = exponent.wrapping_sub(1);
            }
        }
        mantissa <<= exponent & 1;
        let root = if SOFT_FLOAT { by_digits(mantissa) } else { by_heron(mantissa) };
        // The root's own hidden bit adds one to the exponent field.
        f32::from_bits(root.wrapping_add(((exponent >> 1).wrapping_add(126) as u32).wrapping_mul(HIDDEN)))
    }

    /// `sqrt(mantissa*2^23)`, rounded, digit by digit: 25 of them, the last one rounds. It can't be a tie, whose
    /// square would have 49 bits.
    pub fn by_digits(mantissa: u32) -> u32 {
        let (mut rest, mut twice, mut digit) = (mantissa, 0u32, 1u32 << 24);
        while digit != 0 {
            rest <<= 1;
            let trial = twice.wrapping_add(digit);
            if trial <= rest {
                rest = rest.wrapping_sub(trial);
                twice = trial.wrapping_add(digit);
            }
            digit >>= 1;
        }
        twice.wrapping_add(2) >> 2
    }

    /// The same for a core that divides floats itself: three of Heron's steps come within one unit, and the
    /// remainder, of which the lower 32 bits say enough, tells which one.
    pub fn by_heron(mantissa: u32) -> u32 {
        let x = mantissa as f32 * (1.0 / HIDDEN as f32);
        let mut root = 0.6875 + 0.333 * x;
        for _ in 0..3 {
            root = 0.5 * (root + x / root);
        }
        let root = (root * HIDDEN as f32) as u32;
        let rest = (mantissa << 23).wrapping_sub(root.wrapping_mul(root)) as i32;
        if rest > root as i32 {
            root.wrapping_add(1)
        } else if rest <= (root as i32).wrapping_neg() {
            root.wrapping_sub(1)
        } else {
            root
        }
    }
}

#[cfg(any(feature = "libm", feature = "micromath"))]
pub(crate) use chosen::{exp, ln, sqrt};

/// `x > bound` for a bound that is not negative. Where floats are routines the bits are compared, which order as such
/// numbers do: a few instructions in place of about thirty.
#[inline(always)]
pub(crate) fn exceeds(x: f32, bound: f32) -> bool {
    if SOFT_FLOAT { bits_exceed(x, bound) } else { x > bound }
}

/// `x >= bound` for a bound above zero.
#[inline(always)]
pub(crate) fn reaches(x: f32, bound: f32) -> bool {
    if SOFT_FLOAT { bits_reach(x, bound) } else { x >= bound }
}

/// `0.5*x`. Where a product is a routine the exponent is lowered by one, unless it is at one of its ends.
#[inline(always)]
pub(crate) fn half(x: f32) -> f32 {
    if SOFT_FLOAT { half_by_exponent(x) } else { 0.5 * x }
}

#[inline(always)]
fn half_by_exponent(x: f32) -> f32 {
    const EXPONENT: u32 = 1 << 23;
    let exponent = x.to_bits() & f32::INFINITY.to_bits();
    if exponent > EXPONENT && exponent < f32::INFINITY.to_bits() {
        f32::from_bits(x.to_bits().wrapping_sub(EXPONENT))
    } else {
        0.5 * x
    }
}

/// What is negative, -0 and NaN have bits beyond infinity's.
#[inline(always)]
const fn bits_exceed(x: f32, bound: f32) -> bool {
    bound.to_bits() < x.to_bits() && x.to_bits() <= f32::INFINITY.to_bits()
}

#[inline(always)]
const fn bits_reach(x: f32, bound: f32) -> bool {
    bound.to_bits() <= x.to_bits() && x.to_bits() <= f32::INFINITY.to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::println;

    /// Every pair of the numbers at which something changes.
    #[test]
    fn bits_are_compared_as_the_numbers_are() {
        let bounds = [0.0, 1e-45, f32::MIN_POSITIVE, 0.5, 1.0, 4.6, 1e30, f32::MAX, f32::INFINITY, f32::NAN];
        let others = [-0.0, f32::NEG_INFINITY, -f32::NAN, f32::MIN];
        let near = bounds.into_iter().flat_map(|b| [b, -b, b.next_up(), b.next_down()]);
        for x in near.chain(others) {
            for bound in bounds {
                assert_eq!(bits_exceed(x, bound), x > bound, "{x:e} > {bound:e}");
                assert!(bound == 0.0 || bits_reach(x, bound) == (x >= bound), "{x:e} >= {bound:e}");
            }
        }
    }

    #[test]
    fn half_by_the_exponent_is_half() {
        // Miri is ten thousand times slower, and this is arithmetic.
        let step = if cfg!(miri) { 4_099_001 } else { 4099 };
        let mut bits = 0u32;
        while let Some(next) = bits.checked_add(step) {
            let x = f32::from_bits(bits);
            let (got, exact) = (half_by_exponent(x), 0.5 * x);
            assert!(got.to_bits() == exact.to_bits() || got.is_nan() && exact.is_nan(), "{x:e}");
            bits = next;
        }
    }

    /// Worst relative error of the square root over `from..to`, and its sign.
    fn worst_sqrt(from: f64, to: f64) -> f64 {
        let error = |i: i32| {
            let x = (from * (to / from).powf(f64::from(i) / 20_000.0)) as f32;
            f64::from(sqrt(x)) / f64::from(x).sqrt() - 1.0
        };
        (0..20_000).map(error).fold(0.0, |worst: f64, e| if e.abs() > worst.abs() { e } else { worst })
    }

    /// Siegmund's two-sided mean run length of CUSUM(0.5, 5) when sigma is taken `factor` times too large.
    fn realised_arl0(factor: f64) -> f64 {
        let (d, b) = (-0.5 * factor, 5.0 * factor + 1.166);
        0.5 * ((-2.0 * d * b).exp() - 1.0 + 2.0 * d * b) / (2.0 * d * d)
    }

    #[test]
    fn the_error_of_the_square_root_and_what_it_does() {
        let band = worst_sqrt(1.0, 1.5);
        let sigma = worst_sqrt(1e-12, 1e12);
        let by_sigma = realised_arl0(1.0 + sigma) / realised_arl0(1.0) * 465.44;
        println!(
            "root of 1 to 1.5 is off by {band:.2e}, any root by {sigma:.2e}: ARL0 {by_sigma:.1} for 465.4"
        );
        assert_eq!(sqrt(1.0), 1.0, "a baseline known exactly is not biased at all");
        assert_eq!(sqrt(0.0), 0.0);
        #[cfg(not(feature = "micromath"))]
        assert!(band.abs() < 1e-7 && sigma.abs() < 1e-7);
        #[cfg(feature = "micromath")]
        {
            assert!((0.0..0.0003).contains(&band), "as this module's first lines say: {band}");
            assert!((0.0..0.0018).contains(&sigma), "{sigma}");
            assert!((465.0..474.0).contains(&by_sigma), "{by_sigma}");
        }
    }

    #[cfg(feature = "micromath")]
    #[test]
    fn micromath_alone_would_be_six_percent_off() {
        let error = |i: u16| {
            let x = 1.0 + f32::from(i) * 1e-3;
            micromath::F32Ext::sqrt(x) / x.sqrt() - 1.0
        };
        let worst = (0..3000).map(error).fold(0.0f32, f32::max);
        println!("micromath's own square root: up to {:.2} % too large", 100.0 * worst);
        assert!((0.0600..0.0615).contains(&worst), "{worst}");
    }

    /// Against libm's own, bit for bit: every exponent, all patterns of a coarse grid of mantissas, and the ends.
    #[cfg(feature = "libm")]
    #[test]
    fn the_square_root_is_exact_to_the_last_bit() {
        let mut bits = 0u32;
        while bits < 0x7f80_0000 {
            let x = f32::from_bits(bits);
            assert_eq!(exact::sqrt(x).to_bits(), libm::sqrtf(x).to_bits(), "{x:e}");
            bits += 1009;
        }
        // The way of the cores that this test does not run on.
        for mantissa in ((1 << 23)..(1 << 25)).step_by(97) {
            assert_eq!(exact::by_digits(mantissa), exact::by_heron(mantissa), "{mantissa}");
        }
        for x in [0.0, -0.0, f32::MIN_POSITIVE, 1e-45, 1.0, 2.0, 4.0, f32::MAX, f32::INFINITY] {
            assert_eq!(exact::sqrt(x).to_bits(), libm::sqrtf(x).to_bits(), "{x:e}");
        }
        assert!(exact::sqrt(-1.0).is_nan() && exact::sqrt(f32::NAN).is_nan());
    }
}
