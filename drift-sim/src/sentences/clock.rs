//! The recording's own clock: the same times on every axis and in every sentence.

use jiff::Timestamp;
use jiff::tz::TimeZone;

/// From this length on, times are in hours, and in seconds beside it.
const HOURS_FROM_S: f64 = 3.0 * 3600.0;
/// From this length on, in days.
const DAYS_FROM_S: f64 = 10.0 * 86_400.0;

/// How a recording counts its time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Clock {
    /// The date at t = 0 as written in the recording, in seconds since 1970 without any zone; `None` where it counts seconds.
    pub zero_s: Option<f64>,
    duration_s: f64,
}

impl Clock {
    /// The clock of a recording of this length.
    pub fn new(zero_s: Option<f64>, duration_s: f64) -> Self {
        Self { zero_s, duration_s }
    }

    /// A time in a sentence: `2024-05-01 15:20`, `842 s`, or `4.33 h (15 600 s)`.
    pub fn says(&self, t_s: f64) -> String {
        if let Some(date) = self.date(t_s) {
            return date;
        }
        let text = format!("{} {}", self.number(t_s), self.unit().0);
        match self.unit() {
            ("s", _) => text,
            _ if t_s == 0.0 => text,
            _ => format!("{text} ({} s)", super::plain(libm::round(t_s), 12)),
        }
    }

    /// A stretch of time: its two ends.
    pub fn span(&self, from_s: f64, to_s: f64) -> String {
        match self.zero_s {
            Some(_) => format!("{} to {}", self.says(from_s), self.says(to_s)),
            None => format!("{} to {} {}", self.number(from_s), self.number(to_s), self.unit().0),
        }
    }

    /// The time as a table shows it under [`Self::label`].
    pub fn cell(&self, t_s: f64) -> String {
        self.date(t_s).unwrap_or_else(|| self.number(t_s))
    }

    /// What stands under an axis over time, or over a column of times.
    pub fn label(&self) -> &'static str {
        match (self.zero_s, self.unit().0) {
            (Some(_), _) => "time",
            (None, "h") => "t / h",
            (None, "d") => "t / d",
            _ => "t / s",
        }
    }

    /// A time as an axis takes it: seconds since 1970 where the recording has dates, else in the unit of [`Self::label`].
    pub fn axis(&self, t_s: f64) -> f64 {
        self.zero_s.map_or(t_s / self.unit().1, |zero_s| zero_s + t_s)
    }

    /// A stretch of time on that axis.
    pub fn axis_length(&self, length_s: f64) -> f64 {
        if self.zero_s.is_some() { length_s } else { length_s / self.unit().1 }
    }

    /// No finer than a thousandth of the recording, or so.
    fn number(&self, t_s: f64) -> String {
        let per_unit = self.unit().1;
        let grid = 1e-3 * (self.duration_s / per_unit).max(1e-9);
        let decimals = (-libm::floor(libm::log10(grid))).clamp(0.0, 6.0);
        let scale = libm::pow(10.0, decimals);
        super::plain(libm::round(t_s / per_unit * scale) / scale, 12)
    }

    fn unit(&self) -> (&'static str, f64) {
        match self.duration_s {
            d if d >= DAYS_FROM_S => ("d", 86_400.0),
            d if d >= HOURS_FROM_S => ("h", 3600.0),
            _ => ("s", 1.0),
        }
    }

    fn date(&self, t_s: f64) -> Option<String> {
        let at = self.zero_s? + t_s;
        let time = Timestamp::from_millisecond(libm::round(1000.0 * at) as i64).ok()?.to_zoned(TimeZone::UTC);
        let format = match self.duration_s {
            d if d >= HOURS_FROM_S => "%Y-%m-%d %H:%M",
            d if d >= 60.0 => "%Y-%m-%d %H:%M:%S",
            _ => "%Y-%m-%d %H:%M:%S%.3f",
        };
        Some(time.strftime(format).to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_those_of_the_recording() {
        let clock = Clock::new(None, 43_200.0);
        assert_eq!(clock.says(15_600.0), "4.33 h (15\u{a0}600 s)");
        assert_eq!(clock.says(0.0), "0 h");
        assert_eq!(clock.span(15_600.0, 46_800.0), "4.33 to 13 h");
        assert_eq!((clock.label(), clock.axis(15_600.0)), ("t / h", 15_600.0 / 3600.0));
        assert_eq!(Clock::new(None, 24.8).says(1.234_567), "1.23 s");
        assert_eq!(Clock::new(None, 24.8).label(), "t / s");
    }

    #[test]
    fn dates_are_those_of_the_recording() {
        // 2024-05-01 12:00:00.
        let clock = Clock::new(Some(1_714_564_800.0), 43_200.0);
        assert_eq!(clock.says(12_000.0), "2024-05-01 15:20");
        assert_eq!(clock.axis(60.0), 1_714_564_860.0);
        assert_eq!(Clock::new(Some(1_714_564_800.0), 30.0).says(1.5), "2024-05-01 12:00:01.500");
    }
}
