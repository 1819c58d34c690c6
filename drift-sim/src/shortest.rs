//! Numbers as the shortest decimal text that reads back as the same number, as `{}` writes them, several times as fast.

use std::io::Write;

/// Where the library writes no exponent, as `{}` never does.
const WITHOUT_EXPONENT: std::ops::Range<f64> = 1e-5..1e16;

/// Texts of up to so many bytes have 15 digits at most: no two such texts read back as the same number.
const SURE_BYTES: usize = 16;

/// Adds the text that `{}` writes of a number.
pub fn push(text: &mut Vec<u8>, x: f64) {
    if x == 0.0 || WITHOUT_EXPONENT.contains(&x.abs()) {
        let mut buffer = zmij::Buffer::new();
        let shown = buffer.format_finite(x);
        let shown = shown.strip_suffix(".0").unwrap_or(shown);
        if shown.len() <= SURE_BYTES || !is_halfway(x, shown) {
            text.extend_from_slice(shown.as_bytes());
            return;
        }
    }
    // Writing to memory does not fail.
    let _ = write!(text, "{x}");
}

/// Whether a number lies in the middle between two texts of so many decimals: the library takes the even one then, the
/// standard library the one farther from zero. Such a number has one binary digit behind the point more than the text has decimals.
fn is_halfway(x: f64, shown: &str) -> bool {
    const FRACTION_BITS: i32 = 52;
    let exponent = (x.to_bits() >> FRACTION_BITS & 0x7ff) as i32 - 1023;
    let zeros = (x.to_bits() | 1 << FRACTION_BITS).trailing_zeros() as i32;
    let decimals = shown.split_once('.').map_or(0, |(_, decimals)| decimals.len() as i32);
    FRACTION_BITS - exponent - zeros == decimals + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    fn pushed(x: f64) -> String {
        let mut text = Vec::new();
        push(&mut text, x);
        String::from_utf8(text).unwrap()
    }

    /// Against the standard library: numbers of every magnitude, numbers of few digits, powers of two and their neighbours.
    #[test]
    fn the_text_is_that_of_the_standard_library() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let any = (0..50_000).map(|_| f64::from_bits(rng.next_u64()));
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let near_one = (0..50_000).map(|_| (rng.next_u64() as i64) as f64 * libm::exp2(-40.0));
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        // Few binary digits behind the point: halfway between two texts more often than others.
        let halves =
            (0..50_000u32).map(|i| (rng.next_u64() >> (i % 53)) as f64 * libm::exp2(-f64::from(i % 41)));
        let few = (0..50_000).map(|i| f64::from(i) / 1000.0);
        let powers = (-1074..1024).map(|n| libm::exp2(f64::from(n)));
        let beside =
            |x: f64| [x, -x, f64::from_bits(x.to_bits() + 1), f64::from_bits(x.to_bits().max(1) - 1)];
        let edges = [0.0, 1e-5, 1e16, 1e15, 9.999e-6, f64::MAX, f64::INFINITY, f64::NAN];
        for x in any.chain(near_one).chain(halves).chain(few).chain(powers).chain(edges).flat_map(beside) {
            assert_eq!(pushed(x), x.to_string());
        }
    }
}
