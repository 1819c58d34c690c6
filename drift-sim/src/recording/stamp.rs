//! A time stamp as text: its value and how finely it is written, which is all the rounding that can be read off it.

use crate::shortest;

/// A time stamp and how finely it is written.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Stamp {
    pub t_s: f64,
    decimals: i32,
    digits: i32,
}

impl Stamp {
    /// `None` where the text is not a finite number.
    pub fn parse(cell: &[u8]) -> Option<Self> {
        let t_s = std::str::from_utf8(cell).ok()?.parse::<f64>().ok().filter(|t| t.is_finite())?;
        Self::written_as(t_s, cell)
    }

    /// The stamp of a finite number that was written so.
    #[inline]
    pub fn written_as(t_s: f64, cell: &[u8]) -> Option<Self> {
        let (mut decimals, mut digits, mut exponent) = (0, 0, 0);
        let mut in_fraction = false;
        for (at, b) in cell.iter().enumerate() {
            match b {
                b'0'..=b'9' => {
                    decimals += i32::from(in_fraction);
                    digits += i32::from(digits > 0 || *b != b'0');
                }
                b'.' => in_fraction = true,
                b'e' | b'E' => {
                    let text = std::str::from_utf8(cell.get(at + 1..)?).ok()?;
                    exponent = text.parse::<i32>().ok()?.clamp(-400, 400);
                    break;
                }
                _ => {}
            }
        }
        Some(Self { t_s, decimals: decimals.saturating_sub(exponent), digits })
    }

    /// The stamp that a text begins with, and its length, where it is of up to 15 digits with at most a point among them. A whole number
    /// and a power of ten that are both exact have the very quotient that the text is read as.
    #[inline]
    pub fn of_digits(text: &[u8]) -> Option<(Self, usize)> {
        let (mut count, mut digits, mut point) = (0_u64, 0, None);
        let (mut at, mut last) = (0, b'.');
        for b in text.get(..DIGITS_TEXT_MAX).unwrap_or(text) {
            match b {
                b'0'..=b'9' => {
                    count = count * 10 + u64::from(b - b'0');
                    digits += i32::from(count > 0);
                }
                b'.' if point.is_none() && at > 0 => point = Some(at),
                _ => break,
            }
            (at, last) = (at + 1, *b);
        }
        let decimals = point.map_or(0, |point| at - point - 1);
        let is_whole = at < DIGITS_TEXT_MAX && last != b'.' && digits <= f64::DIGITS as i32;
        let t_s = count as f64 / POWERS.get(decimals).filter(|_| is_whole)?;
        Some((Self { t_s, decimals: decimals as i32, digits }, at))
    }

    /// A time that was written with so many decimals.
    pub fn written_to(t_s: f64, decimals: i32) -> Self {
        Self { t_s, decimals, digits: f64::DIGITS as i32 }
    }

    /// Digits behind the point.
    pub fn decimals(self) -> i32 {
        self.decimals
    }
}

/// Decimals up to which ten to their number is a double.
const DECIMALS_MAX: i32 = 22;

/// Bytes up to which a text's digits are read by themselves.
const DIGITS_TEXT_MAX: usize = 18;
/// Ten to as many decimals as such a text may have.
const POWERS: [f64; DIGITS_TEXT_MAX] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17];

/// Stamps that come as numbers: each is taken as the shortest text that reads back as it.
#[derive(Debug, Clone)]
pub(super) struct Shortest {
    /// Decimals that stamps had so far, and ten to their number.
    decimals: i32,
    scale: f64,
    /// Digits that stamps had so far, and ten to their number.
    digits: i32,
    digits_end: f64,
    /// Room for a text.
    text: Vec<u8>,
}

impl Default for Shortest {
    fn default() -> Self {
        Self { decimals: 0, scale: 1.0, digits: 0, digits_end: 1.0, text: Vec::new() }
    }
}

impl Shortest {
    /// `None` where it is not a finite number.
    #[inline]
    pub fn stamp(&mut self, t_s: f64) -> Option<Stamp> {
        let stamp = self.exact(t_s)?;
        if stamp.digits > self.digits && stamp.digits <= f64::DIGITS as i32 {
            (self.digits, self.digits_end) = (stamp.digits, libm::pow(10.0, f64::from(stamp.digits)));
        }
        Some(stamp)
    }

    /// The stamps of the numbers that come first, as long as none has more decimals or more digits than one before it had: such
    /// stamps say nothing new about how stamps are written, so each is said to have as many as there were.
    #[inline]
    pub fn no_finer<'a>(&'a self, times: &'a [f64]) -> impl Iterator<Item = Stamp> + 'a {
        let (decimals, digits) = (self.decimals, self.digits);
        let end = self.digits_end;
        let is_known = move |t_s: &f64| self.text_of(*t_s).is_some_and(|whole| whole < end);
        times.iter().copied().take_while(is_known).map(move |t_s| Stamp { t_s, decimals, digits })
    }

    /// The whole number that a stamp without its sign and its decimal point would be, where it is one of the decimals there were.
    #[inline]
    fn text_of(&self, t_s: f64) -> Option<f64> {
        shortest::without_point(t_s.abs(), self.scale)
    }

    #[inline]
    fn exact(&mut self, t_s: f64) -> Option<Stamp> {
        let Some(whole) = self.text_of(t_s) else {
            return if t_s.is_finite() { self.by_text(t_s) } else { None };
        };
        let (mut count, mut decimals) = (whole as u64, self.decimals);
        if count == 0 {
            return Some(Stamp { t_s, decimals: 0, digits: 0 });
        }
        while decimals > 0 && count.is_multiple_of(10) {
            count /= 10;
            decimals -= 1;
        }
        Some(Stamp { t_s, decimals, digits: count.ilog10() as i32 + 1 })
    }

    /// The stamp by its text, whose decimals later ones may have too.
    #[inline(never)]
    fn by_text(&mut self, t_s: f64) -> Option<Stamp> {
        self.text.clear();
        shortest::push(&mut self.text, t_s);
        let stamp = Stamp::written_as(t_s, &self.text)?;
        let is_exact = stamp.decimals <= DECIMALS_MAX && stamp.digits <= f64::DIGITS as i32;
        if is_exact && stamp.decimals > self.decimals {
            (self.decimals, self.scale) = (stamp.decimals, libm::pow(10.0, f64::from(stamp.decimals)));
        }
        Some(stamp)
    }
}

/// What a column of time counts: seconds times ten to a whole power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimeUnit {
    exponent: i32,
    /// Ten to the exponent's opposite.
    in_a_second: f64,
}

impl TimeUnit {
    pub fn of(exponent: i32) -> Self {
        Self { exponent, in_a_second: libm::pow(10.0, f64::from(-exponent)) }
    }

    /// Seconds are counted in tens to this.
    pub fn exponent(self) -> i32 {
        self.exponent
    }

    /// A stamp that counts this unit, in seconds.
    #[inline]
    pub fn scale(self, stamp: Stamp) -> Stamp {
        if self.exponent == 0 {
            return stamp;
        }
        // Dividing by a whole power of ten rounds once; multiplying by its inverse twice.
        let decimals = stamp.decimals.saturating_sub(self.exponent);
        Stamp { t_s: stamp.t_s / self.in_a_second, decimals, ..stamp }
    }
}

/// The finest writing seen so far: a fixed number of decimals, or of digits, from which trailing zeros may have
/// been cut.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution {
    decimals: i32,
    digits: i32,
    /// Times between which the step is the one found last, and that step, s.
    known: (f64, f64, f64),
}

/// How far from a power of ten, as a part of it, logarithms are sure to lie on their side of a whole number.
const SURE: f64 = 1e-9;

impl Resolution {
    pub fn of(stamps: &[(u64, Stamp)]) -> Self {
        let mut finest = Self { decimals: i32::MIN, digits: 1, known: (f64::INFINITY, 0.0, 0.0) };
        stamps.iter().for_each(|(_, stamp)| finest.learn(*stamp));
        finest
    }

    /// Whether a stamp is written more finely than those before.
    #[inline]
    pub fn is_refined_by(&self, stamp: Stamp) -> bool {
        stamp.decimals > self.decimals || stamp.digits > self.digits
    }

    #[inline]
    pub fn learn(&mut self, stamp: Stamp) {
        if self.is_refined_by(stamp) {
            self.decimals = self.decimals.max(stamp.decimals);
            self.digits = self.digits.max(stamp.digits);
            self.known = (f64::INFINITY, 0.0, 0.0);
        }
    }

    /// The step between neighbouring stamps that can be written at this time, s.
    pub fn step_s(&self, t_s: f64) -> f64 {
        let by_decimals = libm::pow(10.0, f64::from(-self.decimals));
        if t_s == 0.0 {
            return by_decimals;
        }
        let magnitude = libm::floor(libm::log10(t_s.abs()));
        by_decimals.max(libm::pow(10.0, magnitude + 1.0 - f64::from(self.digits)))
    }

    /// The same, quick for times of the same magnitude as the one before.
    #[inline]
    pub fn next_step_s(&mut self, t_s: f64) -> f64 {
        let (from_s, to_s, step_s) = self.known;
        if t_s.abs() > from_s && t_s.abs() < to_s {
            return step_s;
        }
        self.find_step_s(t_s)
    }

    #[cold]
    fn find_step_s(&mut self, t_s: f64) -> f64 {
        let step_s = self.step_s(t_s);
        // Between two powers of ten, not too near either, the magnitude and with it the step are the same.
        let power = libm::pow(10.0, libm::floor(libm::log10(t_s.abs())));
        let (from_s, to_s) = ((1.0 + SURE) * power, (1.0 - SURE) * 10.0 * power);
        if power.is_normal() && t_s.abs() > from_s && t_s.abs() < to_s {
            self.known = (from_s, to_s, step_s);
        }
        step_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    #[test]
    fn resolution_is_read_off_the_text() {
        for (text, t_s, step_s) in
            [("0.07", 0.07, 0.01), ("1e-3", 0.001, 0.001), ("12", 12.0, 1.0), ("1.50E1", 15.0, 0.1)]
        {
            let stamp = Stamp::parse(text.as_bytes()).unwrap();
            assert_eq!(stamp.t_s, t_s);
            let step = Resolution::of(&[(2, stamp)]).step_s(t_s);
            assert!((step / step_s - 1.0).abs() < 1e-9, "{text}: {step}");
        }
        assert_eq!(Stamp::parse(b"inf"), None);
    }

    #[test]
    fn a_text_of_few_digits_is_the_stamp_that_the_standard_library_reads() {
        let texts =
            ["0", "0.0", "7", "10", "0.07", "0.070", "12.5", "00012.5", "1234.567", "999999999999999"];
        let more = ["0.000000000000001", "123456789012.345", "1000000", "170000000.000125"];
        for text in texts.into_iter().chain(more) {
            let followed = format!("{text},1");
            assert_eq!(
                Stamp::of_digits(followed.as_bytes()),
                Some((Stamp::parse(text.as_bytes()).unwrap(), text.len()))
            );
        }
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for _ in 0..100_000 {
            let (count, decimals) = (rng.next_u64() % 1_000_000_000_000_000, (rng.next_u64() % 15) as usize);
            let digits = format!("{count:016}");
            let text = format!("{}.{}", &digits[..15 - decimals], &digits[15 - decimals..]);
            let (stamp, length) = Stamp::of_digits(format!("{text}\n").as_bytes()).unwrap();
            assert_eq!((stamp, length), (Stamp::parse(text.as_bytes()).unwrap(), text.len()), "{text}");
        }
        for text in ["", ".", ".5,", "5.,", "-1,", "x", "1234567890123456,", "0.12345678901234567890,"] {
            assert_eq!(Stamp::of_digits(text.as_bytes()), None, "{text}");
        }
        // What follows tells whether the cell ends there.
        assert_eq!(Stamp::of_digits(b"1e5,").unwrap().1, 1);
        assert_eq!(Stamp::of_digits(b"1.5.2,").unwrap().1, 3);
    }

    /// Against the text that the standard library writes.
    #[test]
    fn a_number_is_the_shortest_text_that_reads_back_as_it() {
        let grids = [1.0, 0.1, 0.066, 0.001, 1e-5, 1e-9, 1.0 / 3.0, 1e6, 1e15];
        let counts = || (0..2000_u32).chain([99_999, 100_000, 1_000_000, u32::MAX]).map(f64::from);
        let near = |t: f64| [t, -t, t.next_up(), t.next_down(), t + 1.7e9];
        for grid in grids {
            let mut shortest = Shortest::default();
            let on_grid = counts().flat_map(|k| [k * grid, (k * grid * 1e6).round() / 1e6]);
            for t_s in on_grid.flat_map(near).chain([1e22, 1e23, f64::MAX, 5e-324, 9_007_199_254_740_993.0]) {
                assert_eq!(shortest.stamp(t_s), Stamp::parse(t_s.to_string().as_bytes()), "{t_s}");
            }
        }
        assert_eq!(Shortest::default().stamp(f64::NAN), None);
        assert_eq!(Shortest::default().stamp(f64::INFINITY), None);
    }
}
