//! Numbers as people read them in tables.

/// Four significant digits without trailing zeros; very small and very large ones with an exponent; a dash for what is
/// not a number.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if !x.is_finite() {
        "\u{2013}".into()
    } else if x == 0.0 {
        "0".into()
    } else if (1e-3..1e6).contains(&size) {
        let places = (3 - libm::floor(libm::log10(size)) as i32).clamp(0, 6) as usize;
        let text = format!("{x:.places$}");
        if places > 0 { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        let text = format!("{x:.3e}");
        match text.split_once('e') {
            Some((mantissa, exponent)) => {
                format!("{}e{exponent}", mantissa.trim_end_matches('0').trim_end_matches('.'))
            }
            None => text,
        }
    }
}

/// `low to high`.
pub fn interval([low, high]: [f64; 2]) -> String {
    format!("{} to {}", number(low), number(high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits() {
        let shown = [20.391_2, 0.0, -123_456.4, 2.5e-9, 100.0, 0.012_345, f64::NAN].map(number);
        assert_eq!(shown, ["20.39", "0", "-123456", "2.5e-9", "100", "0.01235", "\u{2013}"]);
    }
}
