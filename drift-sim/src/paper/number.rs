//! Numbers as text, for people.

use super::spread::{Share, Spread};

/// So many significant digits; very small and very large ones with an exponent.
pub(super) fn significant(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "\u{2013}".into();
    }
    let with_exponent = format!("{x:.*e}", digits.saturating_sub(1));
    let exponent: i32 = with_exponent.rsplit_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    if !(-4..5).contains(&exponent) {
        return with_exponent;
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    format!("{x:.decimals$}")
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
        assert_eq!(significant(5.284_1e-6, 3), "5.28e-6");
        assert_eq!(significant(27_123.4, 3), "27123");
        assert_eq!(significant(0.0, 3), "0.00");
        assert_eq!(significant(f64::NAN, 3), "\u{2013}");
    }
}
