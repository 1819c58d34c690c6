//! Numbers as arguments, each with what it may be.

/// Any finite number.
pub fn finite(text: &str) -> std::result::Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "not a finite number".to_string())
}

/// Above 0.
pub fn positive(text: &str) -> std::result::Result<f64, String> {
    finite(text).and_then(|value| if value > 0.0 { Ok(value) } else { Err("must be > 0".to_string()) })
}

/// 0 or above.
pub fn not_negative(text: &str) -> std::result::Result<f64, String> {
    finite(text).and_then(|value| if value >= 0.0 { Ok(value) } else { Err("must be >= 0".to_string()) })
}

/// Between 0 and 1, neither included.
pub fn part(text: &str) -> std::result::Result<f64, String> {
    let is_part = |value: f64| value > 0.0 && value < 1.0;
    finite(text).and_then(|value| {
        if is_part(value) { Ok(value) } else { Err("must lie between 0 and 1".to_string()) }
    })
}
