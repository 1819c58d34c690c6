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
        let exponent_at = cell.iter().position(|b| matches!(b, b'e' | b'E'));
        let mantissa = &cell[..exponent_at.unwrap_or(cell.len())];
        let exponent = match exponent_at {
            Some(at) => std::str::from_utf8(&cell[at + 1..]).ok()?.parse::<i32>().ok()?.clamp(-400, 400),
            None => 0,
        };
        let (mut decimals, mut digits, mut in_fraction) = (0, 0, false);
        for b in mantissa {
            match b {
                b'.' => in_fraction = true,
                b'0'..=b'9' => {
                    decimals += i32::from(in_fraction);
                    digits += i32::from(digits > 0 || *b != b'0');
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

    /// The same stamp where its number counts seconds times ten to `exponent`.
    pub fn scaled(self, exponent: i32) -> Self {
        if exponent == 0 {
            return self;
        }
        // Dividing by a whole power of ten rounds once; multiplying by its inverse twice.
        let t_s = self.t_s / libm::pow(10.0, f64::from(-exponent));
        Self { t_s, decimals: self.decimals.saturating_sub(exponent), ..self }
    }
}

/// The finest writing seen so far: a fixed number of decimals, or of digits, from which trailing zeros may have
/// been cut.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution {
    decimals: i32,
    digits: i32,
}

impl Resolution {
    pub fn of(stamps: &[(u64, Stamp)]) -> Self {
        let mut finest = Self { decimals: i32::MIN, digits: 1 };
        stamps.iter().for_each(|(_, stamp)| finest.learn(*stamp));
        finest
    }

    pub fn learn(&mut self, stamp: Stamp) {
        self.decimals = self.decimals.max(stamp.decimals);
        self.digits = self.digits.max(stamp.digits);
    }

    /// The step between neighbouring stamps that can be written at this time, s.
    pub fn step_s(self, t_s: f64) -> f64 {
        let by_decimals = libm::pow(10.0, f64::from(-self.decimals));
        if t_s == 0.0 {
            return by_decimals;
        }
        let magnitude = libm::floor(libm::log10(t_s.abs()));
        by_decimals.max(libm::pow(10.0, magnitude + 1.0 - f64::from(self.digits)))
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
