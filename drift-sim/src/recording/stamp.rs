//! A time stamp as text: its value and how finely it is written, which is all the rounding that can be read off it.

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

    /// A time that was written with so many decimals.
    pub fn written_to(t_s: f64, decimals: i32) -> Self {
        Self { t_s, decimals, digits: f64::DIGITS as i32 }
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

    #[inline]
    pub fn learn(&mut self, stamp: Stamp) {
        if stamp.decimals > self.decimals || stamp.digits > self.digits {
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
}
