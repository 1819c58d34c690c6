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
        let shown = match shown.as_bytes() {
            [whole @ .., b'.', b'0'] => whole,
            shown => shown,
        };
        if shown.len() <= SURE_BYTES || !is_halfway(x, shown) {
            text.extend_from_slice(shown);
            return;
        }
    }
    // Writing to memory does not fail.
    let _ = write!(text, "{x}");
}

/// Numbers up to which every decimal number of so many digits has a double of its own.
const EXACT: f64 = 1e15;
/// Adding it to a smaller number that is not negative and taking it away again rounds that number to a whole one.
const ROUNDS: f64 = 4_503_599_627_370_496.0;

/// The whole number that a number which is not negative is without its decimal point, where it has that many decimals at most;
/// `scale` is ten to their number, up to 1e22. `None` where the shortest text has more of them or more than 15 digits.
#[inline]
pub(crate) fn without_point(x: f64, scale: f64) -> Option<f64> {
    let scaled = x * scale;
    let whole = (scaled + ROUNDS) - ROUNDS;
    // No two numbers of up to 15 digits have the same double: one of them that reads back as the number is the shortest text, but
    // for zeros at its end.
    #[expect(
        clippy::float_cmp,
        reason = "a division rounds to the very number that the text would be read as"
    )]
    let is_text = scaled < EXACT && whole / scale == x;
    is_text.then_some(whole)
}

/// Bytes of 15 decimals, or of a greater whole number, and a point.
const COUNT_BYTES: usize = 24;

/// Writes numbers that mostly have as few decimals as those before, such as times.
pub struct FewDecimals {
    /// The most that a number had so far, and ten to their number.
    decimals: usize,
    scale: f64,
}

impl Default for FewDecimals {
    fn default() -> Self {
        Self { decimals: 0, scale: 1.0 }
    }
}

impl FewDecimals {
    /// Adds the text that [`push`] writes of a number.
    pub fn push(&mut self, text: &mut Vec<u8>, x: f64) {
        if let Some(whole) = without_point(x, self.scale).filter(|_| x > 0.0) {
            return self.push_count(text, whole as u64);
        }
        let from = text.len();
        push(text, x);
        let shown = text.get(from..).unwrap_or_default();
        let decimals = decimals(shown) as usize;
        if shown.len() <= SURE_BYTES && decimals > self.decimals {
            (self.decimals, self.scale) = (decimals, libm::pow(10.0, decimals as f64));
        }
    }

    /// So many units of the last decimal, without zeros at the end.
    fn push_count(&self, text: &mut Vec<u8>, mut count: u64) {
        let mut decimals = self.decimals;
        while decimals > 0 && count.is_multiple_of(10) {
            (count, decimals) = (count / 10, decimals - 1);
        }
        let (mut shown, mut from) = ([0; COUNT_BYTES], COUNT_BYTES);
        // From the last digit to the first.
        for at in 0.. {
            if at > decimals && count == 0 {
                break;
            }
            if at == decimals && at > 0 {
                from = from.saturating_sub(1);
                shown[from] = b'.';
            }
            from = from.saturating_sub(1);
            shown[from] = b'0' + (count % 10) as u8;
            count /= 10;
        }
        text.extend_from_slice(shown.get(from..).unwrap_or_default());
    }
}

/// Whether a number lies in the middle between two texts of so many decimals: the library takes the even one then, the
/// standard library the one farther from zero. Such a number has one binary digit behind the point more than the text has decimals.
fn is_halfway(x: f64, shown: &[u8]) -> bool {
    const FRACTION_BITS: i32 = 52;
    let exponent = (x.to_bits() >> FRACTION_BITS & 0x7ff) as i32 - 1023;
    let zeros = (x.to_bits() | 1 << FRACTION_BITS).trailing_zeros() as i32;
    let digits_behind = FRACTION_BITS - exponent - zeros;
    // Nearly always more than the text could have, which takes no look at it.
    let length = shown.len() as i32;
    digits_behind <= length && digits_behind == decimals(shown) + 1
}

/// How many a text has behind its point.
fn decimals(shown: &[u8]) -> i32 {
    let point = shown.iter().position(|b| *b == b'.');
    point.map_or(0, |point| (shown.len() - point - 1) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    /// Grids of times and their neighbours, in one column each.
    #[test]
    fn numbers_of_few_decimals_are_written_alike() {
        for grid in [1.0, 10.0, 0.1, 0.25, 0.066, 0.001, 1e-5, 1e-9, 1.0 / 3.0, 1e6, 1e13] {
            let mut writer = FewDecimals::default();
            let counts = (0..3000_u32).chain([99_999, 100_000, 123_456_789, u32::MAX]).map(f64::from);
            let on_grid = counts.flat_map(|k| [k * grid, (k * grid * 1e6).round() / 1e6, k * grid + 1.7e9]);
            for x in
                on_grid.flat_map(|x| [x, -x, x.next_up(), x.next_down()]).chain([f64::NAN, f64::MAX, 1e-300])
            {
                let mut text = Vec::new();
                writer.push(&mut text, x);
                assert_eq!(String::from_utf8(text).unwrap(), x.to_string(), "grid {grid}");
            }
        }
    }

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
