//! Numbers as text, for people.

use super::spread::{Share, Spread};

/// So many significant digits; very small and very large ones with a power of ten, as `5.28 × 10⁻⁶`.
pub(super) fn significant(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "\u{2013}".into();
    }
    let with_exponent = format!("{x:.*e}", digits.saturating_sub(1));
    let exponent: i32 = with_exponent.rsplit_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    if !(-4..5).contains(&exponent) {
        let mantissa = with_exponent.split('e').next().unwrap_or_default();
        return format!("{mantissa} \u{d7} 10{}", raised(exponent));
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    format!("{x:.decimals$}")
}

/// A whole number in raised digits.
fn raised(exponent: i32) -> String {
    let raised = |digit: char| match digit {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => digit.to_digit(10).and_then(|digit| char::from_u32(0x2070 + digit)).unwrap_or(digit),
    };
    exponent.to_string().chars().map(raised).collect()
}

pub(super) fn interval((low, high): (f64, f64), digits: usize) -> String {
    format!("{} to {}", significant(low, digits), significant(high, digits))
}

/// Mean and range.
pub(super) fn ranged(s: &Spread, digits: usize) -> String {
    format!("{} ({})", significant(s.mean, digits), interval((s.min, s.max), digits))
}

/// Mean and standard error.
pub(super) fn with_error(s: &Spread) -> String {
    let decimals = if s.mean.abs() < 100.0 { 1 } else { 0 };
    format!("{:.decimals$} \u{b1} {:.decimals$}", s.mean, s.se)
}

/// Per cent with its standard error.
pub(super) fn per_cent(s: &Share) -> String {
    format!("{:.1} \u{b1} {:.1} %", 100.0 * s.share, 100.0 * s.se)
}

pub(super) fn seconds(t: Option<f64>) -> String {
    t.map_or("none".into(), |t| format!("{t:.1} s"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_significant_ones() {
        assert_eq!(significant(0.119_93, 4), "0.1199");
        assert_eq!(significant(5.284_1e-6, 3), "5.28 × 10⁻⁶");
        assert_eq!(significant(-1.2e13, 2), "-1.2 × 10¹³");
        assert_eq!(significant(27_123.4, 3), "27123");
        assert_eq!(significant(0.0, 3), "0.00");
        assert_eq!(significant(f64::NAN, 3), "\u{2013}");
    }
}
