//! Numbers as one types them: in messages, which quote what was typed, and in advice that can be typed back.

/// Numbers from here on, and below its other end, are written with an exponent.
const WITHOUT_EXPONENT: std::ops::Range<f64> = 1e-4..1e7;

/// A number with nine significant digits at most, without the last digits of binary fractions: `0.3`, `5e-300`, `1e9`.
pub fn typed(value: f64) -> String {
    typed_to(value, 9)
}

/// The same with so many significant digits at most, for what was computed and not typed.
pub fn typed_to(value: f64, digits: usize) -> String {
    let decimals = digits.saturating_sub(1);
    let rounded = format!("{value:.decimals$e}").parse::<f64>().unwrap_or(value);
    if rounded == 0.0 {
        // Without the sign that a zero may have.
        "0".into()
    } else if !rounded.is_finite() || WITHOUT_EXPONENT.contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::typed;

    #[test]
    fn a_number_is_short_and_can_be_typed_back() {
        for (value, text) in [
            (1e-300, "1e-300"),
            (0.1 + 0.2, "0.3"),
            (-1.0, "-1"),
            (604_800.0, "604800"),
            (1e12, "1e12"),
            (0.0, "0"),
            (-0.0, "0"),
            (f64::NAN, "NaN"),
            (1.0 / 3.0, "0.333333333"),
        ] {
            assert_eq!(typed(value), text);
            assert!(value.is_nan() || (text.parse::<f64>().unwrap() - value).abs() <= 1e-8 * value.abs());
        }
    }
}
