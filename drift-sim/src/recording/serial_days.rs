//! Times that count days, as spreadsheets do where a cell has no format: 45365.5 is noon of 14 March 2024.

use std::ops::Range;
use std::str::FromStr;

use super::stamp::Stamp;
use crate::{Error, Result};

/// What the numbers of a time column count, where its name states no unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeIn {
    /// Seconds.
    Seconds,
    /// Days since 30 December 1899.
    Days,
}

impl FromStr for TimeIn {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "seconds" => Ok(Self::Seconds),
            "days" => Ok(Self::Days),
            _ => Err(Error::new(format!("time in: '{text}'")).allowed("seconds, days")),
        }
    }
}

/// Seconds in a day.
pub(super) const DAY_S: f64 = 86_400.0;
/// The serial day of 1 January 1970.
const FIRST_OF_1970: f64 = 25_569.0;
/// Days of 1954 to 2119, in which recordings are made.
const OUR_DAYS: Range<f64> = 20_000.0..80_000.0;
/// Steps that tell, at least.
const STEPS_MIN: usize = 5;
/// Samples of a loop are not further apart, s.
const STEP_MAX_S: f64 = 3600.0;
/// A step shorter than this, read as seconds, would be a sampling at more than 1 kHz that begins more than five hours after time 0.
const SHORT: f64 = 1e-3;

/// What numbers of a time column count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Verdict {
    Seconds,
    Days,
    /// Either, with the step as it is written.
    Open(f64),
}

/// Tells days from seconds by the first stamps: numbers of our days that go up in steps which are a simple number of seconds only as
/// days.
pub(super) fn verdict(stamps: &[Stamp]) -> Verdict {
    let rises = stamps.windows(2).all(|pair| matches!(pair, [a, b] if b.t_s >= a.t_s));
    if !rises || !stamps.iter().all(|stamp| OUR_DAYS.contains(&stamp.t_s)) {
        return Verdict::Seconds;
    }
    let steps = || {
        stamps
            .windows(2)
            .filter_map(|pair| Some(pair.last()?.t_s - pair.first()?.t_s))
            .filter(|step| *step > 0.0)
    };
    let mut sorted: Vec<f64> = steps().collect();
    sorted.sort_by(f64::total_cmp);
    let Some(median) = sorted.get(sorted.len() / 2).copied().filter(|_| sorted.len() >= STEPS_MIN) else {
        return Verdict::Seconds;
    };
    // Over the steps of one sample the rounding of the stamps cancels.
    let (sum, count) = steps()
        .filter(|step| (0.5..1.5).contains(&(step / median)))
        .fold((0.0, 0.0), |(sum, n), step| (sum + step, n + 1.0));
    let step = sum / count;
    let decimals = stamps.iter().map(|stamp| stamp.decimals()).max().unwrap_or(0);
    let written_to = libm::pow(10.0, f64::from(-decimals)).max(OUR_DAYS.end * f64::EPSILON);
    let tolerance = written_to / count + 1e-9 * step;
    let (of_days, of_day_tolerance) = (step * DAY_S, tolerance * DAY_S);
    // A step of half a minute or more may be said in minutes.
    let units_s: &[f64] = if of_days < 30.0 { &[1.0] } else { &[1.0, 60.0] };
    let are_simple_days = of_days <= STEP_MAX_S + of_day_tolerance
        && units_s.iter().any(|unit| is_simple(of_days / unit, of_day_tolerance / unit));
    match (are_simple_days, is_simple(step, tolerance)) {
        (true, false) => Verdict::Days,
        (true, true) if step < SHORT => Verdict::Days,
        (false, false) if step < SHORT => Verdict::Open(step),
        _ => Verdict::Seconds,
    }
}

/// Whether a number of two digits lies within the tolerance.
fn is_simple(x: f64, tolerance: f64) -> bool {
    format!("{x:.1e}").parse::<f64>().is_ok_and(|near| (near - x).abs() <= tolerance)
}

/// A stamp in days as seconds since the first day.
pub(super) fn since(first: f64, stamp: Stamp) -> Stamp {
    // A day is 86 400 s: what is written to five decimals is known to a second.
    Stamp::written_to((stamp.t_s - first) * DAY_S, stamp.decimals().saturating_sub(5))
}

/// A serial day in seconds since 1970; `None` of what is no day of ours.
pub(super) fn since_1970_s(day: f64) -> Option<f64> {
    let millis = libm::round((day - FIRST_OF_1970) * DAY_S * 1e3);
    OUR_DAYS.contains(&day).then_some(millis * 1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stamps at these steps, with so many decimals.
    fn stamps(start: f64, step: f64, decimals: usize) -> Vec<Stamp> {
        (0..200)
            .filter_map(|k| Stamp::parse(format!("{:.decimals$}", start + f64::from(k) * step).as_bytes()))
            .collect()
    }

    #[test]
    fn days_are_told_from_seconds_by_their_steps() {
        for seconds in [0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0, 600.0, 900.0, 3600.0] {
            for decimals in [8, 10, 12] {
                assert_eq!(
                    verdict(&stamps(45_365.333_333, seconds / DAY_S, decimals)),
                    Verdict::Days,
                    "{seconds} s"
                );
            }
        }
        assert_eq!(verdict(&stamps(45_365.333_33, 5.0 / DAY_S, 5)), Verdict::Days);
        for (start, step, decimals) in [
            (45_365.0, 1.0, 0),
            (45_365.5, 0.5, 1),
            (45_365.33, 0.01, 2),
            (30_000.0, 0.001, 3),
            (30_000.0, 0.02, 2),
            (30_000.0, 0.066, 3),
            (30_000.0, 0.000_25, 6),
            (30_000.0, 10.0, 0),
            (19_000.0, 1.0 / DAY_S, 9),
            (79_999.0, 1.0, 0),
        ] {
            assert_eq!(verdict(&stamps(start, step, decimals)), Verdict::Seconds, "{start} + k {step}");
        }
        assert!(matches!(verdict(&stamps(45_365.0, 5.37 / DAY_S, 10)), Verdict::Open(_)));
        assert_eq!(verdict(&[]), Verdict::Seconds);
    }

    /// 14 March 2024 is 1710374400 s after 1970 (`date -u -d 2024-03-14 +%s`).
    #[test]
    fn a_serial_day_is_a_date() {
        assert_eq!(since_1970_s(45_365.0), Some(1_710_374_400.0));
        assert_eq!(since_1970_s(45_365.5), Some(1_710_417_600.0));
        assert_eq!(since_1970_s(1.0), None);
    }
}
