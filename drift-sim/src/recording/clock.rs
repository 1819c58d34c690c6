//! What the cells of a time column mean: numbers, in the unit that the column's name states, or dates.
//!
//! Dates count from the recording's first, so that times stay short and exact; without a zone they are taken as they
//! stand. A clock that is put back shows as time that goes back, which is refused further on.

use jiff::Timestamp;
use jiff::civil::{Date, DateTime, Time};
use jiff::tz::TimeZone;

use super::decimal::{DecimalMark, parse_number};
use super::row::{excerpt, not_a_number};
use super::stamp::Stamp;
use crate::{Error, Result};

const DATE_EXAMPLE: &str = "like 2024-05-01 12:00:00.5, 2024-05-01T12:00:00Z, 01.05.2024 12:00:00, 12:00:00";

/// Reads the time stamps of one column.
#[derive(Debug, Clone)]
pub(super) struct Clock {
    column: String,
    /// Numbers are seconds times ten to this.
    exponent: i32,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    NotSeen,
    Numbers,
    Dates { origin: Timestamp, writing: Writing },
}

/// The ways that dates are written; one column keeps to one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Writing {
    /// With Z or an offset.
    Zoned,
    /// Date and time alone.
    Local,
    /// Day, month, year with points between.
    Dotted,
    /// A time of the day.
    TimeOfDay,
}

impl Clock {
    /// The clock of a column; a unit at the end of its name counts: `time_ms`, `t [us]`, `Time (s)`.
    ///
    /// # Errors
    /// A unit that is not s, ms, us or ns.
    pub fn of(column: &str) -> Result<Self> {
        let exponent = match unit(column).as_str() {
            "ms" | "msec" | "milliseconds" => -3,
            "us" | "usec" | "\u{b5}s" | "\u{3bc}s" | "microseconds" => -6,
            "ns" | "nsec" | "nanoseconds" => -9,
            "min" | "minutes" | "h" | "hours" | "d" | "days" => {
                return Err(Error::new(format!("the time in column '{column}' is not in seconds"))
                    .allowed("s, ms, us, ns, or dates; --columns t= and --sample-time S ignore it"));
            }
            _ => 0,
        };
        Ok(Self { column: column.to_owned(), exponent, kind: Kind::NotSeen })
    }

    /// The time in a cell without blanks around it, s.
    ///
    /// # Errors
    /// No time at all, or one of another kind than the first.
    pub fn read(&mut self, cell: &[u8], mark: &mut DecimalMark) -> Result<Stamp> {
        if !matches!(self.kind, Kind::Dates { .. }) {
            let plain = mark.plain(cell);
            if let Some(stamp) = Stamp::parse(plain.as_deref().unwrap_or(cell)) {
                if *mark != DecimalMark::Point {
                    mark.number(cell)?;
                }
                self.kind = Kind::Numbers;
                return Ok(stamp.scaled(self.exponent));
            }
            if cell.is_empty() || parse_number(cell).is_some() {
                return Err(Error::new(format!("no time stamp in column '{}'", self.column)));
            }
            if self.kind == Kind::Numbers {
                return Err(not_a_number(cell, &self.column));
            }
        }
        self.date(cell)
    }

    fn date(&mut self, cell: &[u8]) -> Result<Stamp> {
        let text = String::from_utf8_lossy(cell);
        let refused = |what: &str| {
            Error::new(format!("'{}' in column '{}' {what}", excerpt(&text), self.column))
                .allowed(DATE_EXAMPLE)
        };
        let Some((time, writing)) = parse_date(&text) else {
            return Err(refused("is neither a number nor a date"));
        };
        let origin = match self.kind {
            Kind::Dates { writing: first, .. } if first != writing => {
                return Err(refused("is not written like the dates before"));
            }
            Kind::Dates { origin, .. } => origin,
            _ => time,
        };
        self.kind = Kind::Dates { origin, writing };
        let since = time.duration_since(origin);
        let t_s = since.as_secs() as f64 + f64::from(since.subsec_nanos()) * 1e-9;
        Ok(Stamp::written_to(t_s, fraction_digits(&text)))
    }

    /// What time 0 is, where the stamps are dates; or the unit, where it isn't the second.
    pub fn note(&self) -> Option<String> {
        let column = &self.column;
        match self.kind {
            Kind::Dates { origin, writing: Writing::Zoned } => Some(format!("t counts from {origin}")),
            Kind::Dates { origin, writing } => {
                let at = TimeZone::UTC.to_datetime(origin);
                let at = if writing == Writing::TimeOfDay { at.time().to_string() } else { at.to_string() };
                Some(format!("t counts from {at}"))
            }
            _ if self.exponent != 0 => Some(format!("the times in '{column}' are 1e{} s", self.exponent)),
            _ => None,
        }
    }
}

/// What a column's name says in brackets or behind its last underscore or blank, in lower case.
fn unit(column: &str) -> String {
    let name = column.trim_end_matches([')', ']', '>', ' ']);
    let Some(at) = name.rfind(['(', '[', '<', '_', ' ', '/']) else { return String::new() };
    name[at..].chars().skip(1).collect::<String>().trim().to_lowercase()
}

fn parse_date(text: &str) -> Option<(Timestamp, Writing)> {
    let utc = |at: DateTime| TimeZone::UTC.to_timestamp(at).ok();
    if text.split(':').next().is_some_and(|hours| hours.len() <= 2) {
        let time = text.parse::<Time>().ok()?;
        return utc(Date::constant(1970, 1, 1).to_datetime(time)).map(|t| (t, Writing::TimeOfDay));
    }
    if let Ok(time) = text.parse::<Timestamp>() {
        return Some((time, Writing::Zoned));
    }
    if let Ok(time) = text.parse::<DateTime>() {
        return utc(time).map(|t| (t, Writing::Local));
    }
    let point = text.replace(',', ".");
    ["%d.%m.%Y %H:%M:%S%.f", "%d.%m.%Y %H:%M"]
        .into_iter()
        .find_map(|format| DateTime::strptime(format, &point).ok())
        .and_then(utc)
        .map(|t| (t, Writing::Dotted))
}

/// Digits behind the seconds; a zone may follow them.
fn fraction_digits(text: &str) -> i32 {
    let clock = text.find(':').and_then(|at| text.get(at..)).unwrap_or_default();
    let digits = clock.find(['.', ',']).and_then(|at| clock.get(at + 1..)).unwrap_or_default();
    digits.bytes().take_while(u8::is_ascii_digit).count().min(9) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(column: &str, cells: &[&str]) -> Result<Vec<f64>> {
        let (mut clock, mut mark) = (Clock::of(column)?, DecimalMark::Open);
        cells.iter().map(|cell| clock.read(cell.as_bytes(), &mut mark).map(|s| s.t_s)).collect()
    }

    #[test]
    fn every_way_to_write_a_date_counts_seconds_from_the_first() {
        for (first, second, seconds) in [
            ("2024-05-01 12:00:00", "2024-05-01 12:00:01", 1.0),
            ("2024-05-01T12:00:00", "2024-05-01T12:00:00.25", 0.25),
            ("2024-05-01T12:00", "2024-05-01T12:01", 60.0),
            ("2024-05-01T12:00:00Z", "2024-05-01T12:00:00.5Z", 0.5),
            ("2024-05-01 12:00:00+02:00", "2024-05-01 10:00:01Z", 1.0),
            ("2024-02-29 23:59:59,5", "2024-03-01 00:00:00,0", 0.5),
            ("2024-05-01", "2024-05-02", 86_400.0),
            ("31.12.2023 23:59:59", "01.01.2024 00:00:01", 2.0),
            ("31.12.2023 23:59", "01.01.2024 00:01", 120.0),
            ("09:59:59.9", "10:00:00.0", 0.1),
        ] {
            let times = read("t", &[first, second]).unwrap_or_else(|e| panic!("{first}: {e}"));
            assert_eq!(times[0], 0.0, "{first}");
            assert!((times[1] - seconds).abs() < 1e-12, "{first} to {second}: {}", times[1]);
        }
    }

    #[test]
    fn the_unit_is_read_off_the_name() {
        for (column, expected) in [
            ("t", 5.0),
            ("time_s", 5.0),
            ("t [ms]", 5e-3),
            ("time_us", 5e-6),
            ("Time (ns)", 5e-9),
            ("ms", 5.0),
        ] {
            let t = read(column, &["5"]).unwrap()[0];
            assert!((t / expected - 1.0).abs() < 1e-12, "{column}: {t}");
        }
        assert!(read("t_min", &["5"]).unwrap_err().to_string().contains("not in seconds"));
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for cells in [
            &["2024-13-01 12:00:00"][..],
            &["05/01/2024 12:00"],
            &["yesterday"],
            &["2024-05-01 12:00:00", "5"],
            &["2024-05-01 12:00:00", "2024-05-01T12:00:00Z"],
            &["5", "2024-05-01 12:00:00"],
            &[""],
            &["nan"],
        ] {
            read("t", cells).unwrap_err();
        }
    }
}
