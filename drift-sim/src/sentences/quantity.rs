//! Numbers as a person reads them: with the digits that their interval carries, and in units of a size to imagine.

/// From here on a number of standard deviations says no more than "far outside".
const FAR_SIGMAS: f64 = 100.0;
/// Numbers from here on are written with a power of ten.
const LARGE: f64 = 1e7;
/// Numbers below are written with a power of ten.
const SMALL: f64 = 1e-4;
/// The half width of an interval that matters, part of the value.
const MATTERS: f64 = 1e-6;
/// What an improvement must reach, in per cent, to be a number.
pub const LEAST_PERCENT: f64 = 0.05;

/// A value with so many significant digits, without zeros at the end; thousands are set apart from 10 000 on. A dash for what
/// is not a number.
pub fn plain(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "\u{2013}".into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let decimals = digits as i32 - 1 - magnitude(value);
    to_decimals(rounded_to(value, decimals), decimals)
}

/// Of a number above 0: the power of ten of its first digit.
fn magnitude(value: f64) -> i32 {
    libm::floor(libm::log10(value.abs()) + 1e-12) as i32
}

fn rounded_to(value: f64, decimals: i32) -> f64 {
    let scale = libm::pow(10.0, f64::from(decimals.clamp(-300, 300)));
    if scale.is_finite() && scale > 0.0 { libm::round(value * scale) / scale } else { value }
}

/// A value that is rounded to so many decimals already (negative: to tens, hundreds ...).
fn to_decimals(value: f64, decimals: i32) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".into();
    }
    if !(SMALL..LARGE).contains(&size) {
        let exponent = magnitude(value);
        let digits = (decimals + exponent).clamp(0, 12) as usize;
        let mantissa = value / libm::pow(10.0, f64::from(exponent));
        return format!("{}{}", without_zeros(format!("{mantissa:.digits$}")), power_of_ten(exponent));
    }
    let text = without_zeros(format!("{value:.decimals$}", decimals = decimals.clamp(0, 12) as usize));
    if size < 1e4 { text } else { grouped(&text) }
}

/// The digits from 0 on as they stand in a power, and the sign of a negative one.
const RAISED: [char; 10] = [
    '\u{2070}', '\u{b9}', '\u{b2}', '\u{b3}', '\u{2074}', '\u{2075}', '\u{2076}', '\u{2077}', '\u{2078}',
    '\u{2079}',
];
const RAISED_MINUS: char = '\u{207b}';

/// Times ten to a whole power, as one writes it.
fn power_of_ten(exponent: i32) -> String {
    let raised = |c: char| c.to_digit(10).and_then(|digit| RAISED.get(digit as usize)).copied();
    let exponent = exponent.to_string();
    let power = exponent.chars().map(|c| raised(c).unwrap_or(RAISED_MINUS));
    "\u{d7}10".chars().chain(power).collect()
}

/// The text with its powers behind a caret, where raised digits can't be shown.
pub(crate) fn with_carets(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut in_power = false;
    for c in text.chars() {
        let digit =
            RAISED.iter().position(|raised| *raised == c).and_then(|at| char::from_digit(at as u32, 10));
        let sign = (c == RAISED_MINUS).then_some('-');
        let lowered = digit.or(sign);
        if lowered.is_some() && !in_power {
            plain.push('^');
        }
        in_power = lowered.is_some();
        plain.push(lowered.unwrap_or(c));
    }
    plain
}

fn without_zeros(text: String) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Thousands apart by a blank that does not break.
fn grouped(text: &str) -> String {
    let (whole, rest) = text.find('.').map_or((text, ""), |at| text.split_at(at));
    let digits = whole.trim_start_matches('-');
    let mut out = String::from(if digits.len() < whole.len() { "-" } else { "" });
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 {
            out.push('\u{a0}');
        }
        out.push(digit);
    }
    out + rest
}

/// Decimals that a half width carries: its first digit, and the second where the first is 1 or 2.
fn decimals_of(half_width: f64) -> i32 {
    let first = magnitude(half_width);
    let leading = half_width / libm::pow(10.0, f64::from(first));
    if leading < 2.95 { 1 - first } else { -first }
}

/// A value without the digits that its 95 % interval does not carry; four digits where there is no interval, or it is narrower than these.
pub fn rounded(value: f64, half_width: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    rounded_to(value, decimals(value, half_width))
}

fn decimals(value: f64, half_width: f64) -> i32 {
    let four = if value == 0.0 { 4 } else { 3 - magnitude(value) };
    if half_width.is_finite() && half_width > 0.0 { decimals_of(half_width).min(four) } else { four }
}

/// `20.8`: a value with the digits that its interval carries.
pub fn value(value: f64, half_width: f64) -> String {
    if value.is_finite() {
        to_decimals(rounded(value, half_width), decimals(value, half_width))
    } else {
        plain(value, 4)
    }
}

/// `20.8 ± 0.4 N`: the same with its half width and unit; the value alone where the interval is not known or too narrow to matter, and
/// `within 0.4 N of 0` where nothing of the value is left.
pub fn measured(of: f64, half_width: f64, unit: &str) -> String {
    let size = of.abs().max(half_width.abs());
    if !(half_width.is_finite() && half_width > MATTERS * of.abs() && of.is_finite()) {
        return with_unit(value(of, half_width), unit);
    }
    if rounded_to(of, decimals_of(half_width)) == 0.0 {
        return format!("within {} of 0", with_unit(value(half_width, half_width), unit));
    }
    let exponent = if (SMALL..LARGE).contains(&size) { 0 } else { magnitude(size) };
    let scale = libm::pow(10.0, f64::from(-exponent));
    let (of, half_width) = (of * scale, half_width * scale);
    // Of both as many decimals: 0.80 says more than 0.8.
    let decimals = decimals_of(half_width);
    let fixed = |x: f64| {
        let x = rounded_to(x, decimals);
        let text = format!("{x:.places$}", places = decimals.clamp(0, 12) as usize);
        if x.abs() < 1e4 { text } else { grouped(&text) }
    };
    let text = format!("{} \u{b1} {}", fixed(of), fixed(half_width));
    with_unit(if exponent == 0 { text } else { format!("({text}){}", power_of_ten(exponent)) }, unit)
}

/// `20.4 to 21.2`: the ends of an interval with the digits that its width carries.
pub fn ends(low: f64, high: f64) -> String {
    let decimals = decimals_of((0.5 * (high - low)).max(1e-300)).min(12);
    let end = |x: f64| to_decimals(rounded_to(x, decimals), decimals);
    let (low, high) = (end(low), end(high));
    let places = |text: &str| text.split_once('.').map_or(0, |(_, places)| places.len());
    let most = places(&low).max(places(&high));
    // Both ends show as many decimals.
    let filled = |text: String| match most - places(&text) {
        0 => text,
        _ if text.contains('\u{d7}') => text,
        more if text.contains('.') => text + &"0".repeat(more),
        more => format!("{text}.{}", "0".repeat(more)),
    };
    format!("{} to {}", filled(low), filled(high))
}

/// The name of a term's number in words, without the unit that its key in the loop file ends in: `delay_s` is a delay.
pub fn number_name(key: &str) -> String {
    let bare = ["_per_s", "_hz", "_s"].iter().find_map(|unit| key.strip_suffix(unit)).unwrap_or(key);
    bare.replace('_', " ")
}

/// A number with its unit, if it has one.
pub fn with_unit(number: String, unit: &str) -> String {
    match unit {
        "" | "1" => number,
        unit => format!("{number} {}", simple_unit(unit)),
    }
}

/// `N/(m/s)` is `N s/m`, `(N m)/(rad/s)` is `N m s/rad`.
pub fn simple_unit(unit: &str) -> String {
    let Some((above, below)) = unit.split_once("/(") else { return unit.to_owned() };
    let Some((length, time)) = below.strip_suffix(')').and_then(|below| below.split_once('/')) else {
        return unit.to_owned();
    };
    if length.contains(['(', ')', '/']) || time.contains(['(', ')', '/']) {
        return unit.to_owned();
    }
    format!("{} {time}/{length}", above.trim_start_matches('(').trim_end_matches(')'))
}

/// A rate in units a second as one in units a minute, hour or day, where it is easier to imagine: the factor, and the unit.
pub fn rate(value: f64, unit: &str) -> (f64, String) {
    let of = unit.strip_suffix("/s").filter(|of| !of.contains('(') || of.ends_with(')'));
    // Of a number without a unit, `per` is all that there is.
    let of = match unit {
        "per s" => "per ".to_owned(),
        unit => match of {
            Some(of) => format!("{of}/"),
            None => return (1.0, unit.to_owned()),
        },
    };
    let spans = [(1.0, "s"), (60.0, "min"), (3600.0, "h"), (86_400.0, "day")];
    let (factor, span) =
        spans.into_iter().find(|(factor, _)| value.abs() * factor >= 0.05).unwrap_or(spans[3]);
    (factor, of + span)
}

/// `4.1 sigma`; what is far outside has no number.
pub fn sigmas(z: f64) -> String {
    if z.abs() >= FAR_SIGMAS { format!("more than {FAR_SIGMAS:.0} sigma") } else { format!("{z:.1} sigma") }
}

/// A fit in per cent with one decimal, more near 100; a fit below -1000 follows nothing.
pub fn fit(percent: f64) -> String {
    let left = 100.0 - percent;
    if !percent.is_finite() || percent < -1000.0 {
        "below -1000".into()
    } else if percent.abs() < LEAST_PERCENT {
        // Neither 0.0 nor -0.0: it follows nothing.
        "0".into()
    } else if left > 0.0 && left < 0.095 {
        format!("{percent:.2}")
    } else {
        format!("{percent:.1}")
    }
}

/// A share in per cent: whole ones from 10 on.
pub fn percent(percent: f64) -> String {
    if percent.abs() < LEAST_PERCENT && percent != 0.0 {
        "less than 0.1 %".into()
    } else if percent.abs() < 10.0 {
        format!("{} %", without_zeros(format!("{percent:.1}")))
    } else {
        format!("{} %", plain(percent, 3))
    }
}

/// A relation `b0 + b1 x` as a person writes it.
pub fn line(b0: f64, b1: f64) -> String {
    let sign = if b1 < 0.0 { '\u{2212}' } else { '+' };
    if b1 == 0.0 {
        return plain(b0, 3);
    }
    format!("{} {sign} {} x", plain(b0, 3), plain(b1.abs(), 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_interval() {
        assert_eq!(measured(20.812_345, 0.412, "N"), "20.8 \u{b1} 0.4 N");
        assert_eq!(measured(163.26, 10.2, "N/(m/s)"), "163 \u{b1} 10 N s/m");
        assert_eq!(measured(1150.238, 0.0172, ""), "1150.238 \u{b1} 0.017");
        assert_eq!(measured(0.1000, f64::NAN, "1"), "0.1");
        assert_eq!(measured(-0.0317, 0.4, "N"), "within 0.4 N of 0");
        assert_eq!(measured(0.0, 23.0, "1"), "within 23 of 0");
        assert_eq!(measured(0.8, 2e-5, ""), "0.800000 \u{b1} 0.000020");
        assert_eq!(measured(1.2341e-9, 2.5e-11, "N"), "(1.234 \u{b1} 0.025)\u{d7}10\u{207b}\u{2079} N");
        assert_eq!(value(12_345_678.0, 1e5), "1.235\u{d7}10\u{2077}");
        assert_eq!(plain(259_200.0, 6), "259\u{a0}200");
        assert_eq!(plain(f64::NAN, 4), "\u{2013}");
        assert_eq!(plain(99.999, 3), "100");
    }

    #[test]
    fn ends_have_the_digits_of_their_width() {
        assert_eq!(ends(20.4012, 21.2034), "20.4 to 21.2");
        assert_eq!(ends(1150.2209, 1150.2553), "1150.221 to 1150.255");
        assert_eq!(ends(103.02, 105.18), "103.0 to 105.2");
        assert_eq!(ends(0.0, 2.4), "0.0 to 2.4");
    }

    #[test]
    fn powers_stand_behind_a_caret_where_they_cannot_be_raised() {
        assert_eq!(with_carets("5.8\u{d7}10\u{207b}\u{b9}\u{2077} m/s\u{b2}"), "5.8\u{d7}10^-17 m/s^2");
    }

    #[test]
    fn a_slow_rate_is_one_an_hour_or_a_day() {
        let (factor, unit) = rate(2.8e-5, "degC/s");
        assert_eq!((value(2.8e-5 * factor, f64::NAN), unit.as_str()), ("0.1008".into(), "degC/h"));
        let (factor, unit) = rate(5.8e-7, "degC/s");
        assert_eq!((value(5.8e-7 * factor, 1e-8 * factor), unit.as_str()), ("0.0501".into(), "degC/day"));
        assert_eq!(rate(3.0, "N"), (1.0, "N".into()));
    }

    #[test]
    fn a_unit_is_said_once() {
        for (key, name) in [
            ("delay_s", "delay"),
            ("frequency_hz", "frequency"),
            ("rate_per_s", "rate"),
            ("coulomb_pos", "coulomb pos"),
        ] {
            assert_eq!(number_name(key), name);
        }
    }

    #[test]
    fn units_of_damping_are_simple() {
        assert_eq!(simple_unit("(N m)/(rad/s)"), "N m s/rad");
        assert_eq!(simple_unit("N"), "N");
        assert_eq!(simple_unit("(N m)/(rad/s)^2"), "(N m)/(rad/s)^2");
    }

    #[test]
    fn what_is_nothing_or_far_outside_has_no_digits() {
        assert_eq!(sigmas(4497.0), "more than 100 sigma");
        assert_eq!(sigmas(7.64), "7.6 sigma");
        assert_eq!(percent(1.308e-11), "less than 0.1 %");
        assert_eq!(percent(48.25), "48.3 %");
        assert_eq!(fit(99.98), "99.98");
        assert_eq!(fit(-5.7e30), "below -1000");
        assert_eq!((fit(-0.04), fit(0.0), fit(0.06)), ("0".into(), "0".into(), "0.1".into()));
        assert_eq!(line(2.668e6, -3615.0), "2\u{a0}670\u{a0}000 \u{2212} 3620 x");
    }
}
