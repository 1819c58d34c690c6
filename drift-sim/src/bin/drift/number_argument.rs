//! Numbers as arguments: each parser refuses what is out of range, and says what is allowed.

use std::ops::RangeInclusive;
use std::str::FromStr;

use drift_sim::control_loop::{LARGEST, SAMPLE_TIMES_S};
use drift_sim::sentences::typed;

type Parsed<T> = Result<T, String>;

fn number<T: FromStr>(text: &str, is_allowed: impl Fn(&T) -> bool, allowed: &str) -> Parsed<T> {
    text.parse().ok().filter(is_allowed).ok_or_else(|| format!("{allowed} is allowed"))
}

/// Any number that is still told from its neighbours beside the loop's other signals.
pub fn finite(text: &str) -> Parsed<f64> {
    let allowed = format!("a number from {} to {}", typed(-LARGEST), typed(LARGEST));
    number(text, |value: &f64| value.abs() <= LARGEST, &allowed)
}

/// Above 0.
pub fn positive(text: &str) -> Parsed<f64> {
    let allowed = format!("a number above 0, up to {}", typed(LARGEST));
    number(text, |value: &f64| *value > 0.0 && *value <= LARGEST, &allowed)
}

/// 0 or above.
pub fn not_negative(text: &str) -> Parsed<f64> {
    let allowed = format!("a number from 0 to {}", typed(LARGEST));
    number(text, |value: &f64| (0.0..=LARGEST).contains(value), &allowed)
}

/// A time that a loop's samples may be apart, or that it is watched for.
pub fn seconds(text: &str) -> Parsed<f64> {
    let allowed = format!(
        "a number of seconds from {} to {}",
        typed(*SAMPLE_TIMES_S.start()),
        typed(*SAMPLE_TIMES_S.end())
    );
    number(text, |value| SAMPLE_TIMES_S.contains(value), &allowed)
}

/// Between 0 and 1, neither included.
pub fn part(text: &str) -> Parsed<f64> {
    number(text, |value: &f64| *value > 0.0 && *value < 1.0, "a number between 0 and 1")
}

/// Within a range, its ends included.
pub fn within(range: RangeInclusive<f64>) -> impl Fn(&str) -> Parsed<f64> + Clone + Send + Sync + 'static {
    move |text| {
        let allowed = format!("a number from {} to {}", typed(*range.start()), typed(*range.end()));
        number(text, |value| range.contains(value), &allowed)
    }
}

/// A whole number from 1 on.
pub fn count(text: &str) -> Parsed<u64> {
    number(text, |count: &u64| *count > 0, "a whole number from 1 on")
}

/// A seed: any whole number that 64 bits hold.
pub fn seed(text: &str) -> Parsed<u64> {
    number(text, |_: &u64| true, &format!("a whole number from 0 to {}", u64::MAX))
}

/// Two numbers, the first below the second.
pub fn limits(text: &str) -> Parsed<[f64; 2]> {
    let pair = text.split_once(',').and_then(|(low, high)| {
        let limits = [low, high].map(|end| end.trim().parse::<f64>().unwrap_or(f64::NAN));
        (limits[0] < limits[1]).then_some(limits)
    });
    pair.ok_or_else(|| "two numbers are needed, the lower limit and the upper one, like 0,100".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_told_what_is_allowed() {
        let refused = |parsed: Parsed<f64>| parsed.unwrap_err();
        assert_eq!(refused(finite("nan")), "a number from -1e15 to 1e15 is allowed");
        assert_eq!(refused(finite("1e308")), "a number from -1e15 to 1e15 is allowed");
        assert_eq!(refused(positive("-1")), "a number above 0, up to 1e15 is allowed");
        assert_eq!(refused(not_negative("-1")), "a number from 0 to 1e15 is allowed");
        assert_eq!(refused(seconds("1e-300")), "a number of seconds from 1e-9 to 1e9 is allowed");
        assert_eq!(refused(part("1")), "a number between 0 and 1 is allowed");
        assert_eq!(refused(within(0.5..=0.99)("3")), "a number from 0.5 to 0.99 is allowed");
        assert_eq!(count("0").unwrap_err(), "a whole number from 1 on is allowed");
        assert_eq!(seed("-1").unwrap_err(), "a whole number from 0 to 18446744073709551615 is allowed");
        for bad in ["1", "5,2", "a,b", "nan,1", ""] {
            assert!(limits(bad).unwrap_err().contains("like 0,100"), "{bad}");
        }
    }

    #[test]
    fn what_is_allowed_is_taken() {
        assert_eq!((finite("-2.5"), not_negative("0"), part("0.98")), (Ok(-2.5), Ok(0.0), Ok(0.98)));
        assert_eq!((seconds("0.001"), within(0.5..=0.99)("0.5")), (Ok(0.001), Ok(0.5)));
        assert_eq!((count("1"), seed("0"), limits("-10, 10")), (Ok(1), Ok(0), Ok([-10.0, 10.0])));
    }
}
