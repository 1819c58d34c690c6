//! What the cells of a time column mean: numbers, in the unit that the column's name states, or dates ([`date`](super::date)).
//!
//! Numbers that are a time of our days when they count seconds, milliseconds ... since 1970 do so: loggers write these without
//! a unit.
//! Dates count from the recording's first, so that times stay short and exact; without a zone they are taken as they
//! stand. A clock that is put back shows as time that goes back, which is refused further on; a time of the day that
//! begins anew is the next day.

use jiff::Timestamp;
use jiff::tz::TimeZone;

use super::date::{DateOrder, Moment, Writing};
use super::decimal::{DecimalMark, parse_number};
use super::row::{excerpt, not_a_number};
use super::stamp::{Shortest, Stamp, TimeUnit};
use crate::{Error, Result};

pub(super) use super::date::is_date_or_time;

const DATE_EXAMPLE: &str =
    "like 2024-05-01 12:00:00.5, 2024-05-01T12:00:00Z, 01.05.2024 12:00:00, 5/1/2024 1:30 PM, 12:00:00";
const DAY_S: f64 = 86_400.0;
/// From 1990 to 2100, s since 1970.
const OUR_DAYS_S: std::ops::Range<f64> = 631_152_000.0..4_102_444_800.0;
/// From one row to the next at most, s: of two readings of a date the one is taken that is not further.
const STEP_MAX_S: f64 = 1.5 * DAY_S;

/// Reads the time stamps of one column.
#[derive(Debug, Clone)]
pub(super) struct Clock {
    column: String,
    /// What numbers count.
    unit: TimeUnit,
    /// Whether that is stated; else the first number may tell.
    is_stated: bool,
    /// Whether numbers count from 1970 on.
    since_1970: bool,
    /// Of numbers that come without their text.
    shortest: Shortest,
    kind: Kind,
    /// Which comes first where a date is written 5/1/2024.
    order: Option<DateOrder>,
    /// Time of the last row, s.
    last_s: f64,
    /// Midnights passed where only the time of the day is written.
    days: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    NotSeen,
    Numbers,
    Dates { origin: Moment, text: String },
}

impl Clock {
    /// The clock of a column; a unit counts: that of a row of units, or at the end of its name, `time_ms`, `t [us]`,
    /// `Time (s)`.
    ///
    /// # Errors
    /// A unit that is not s, ms, us or ns.
    pub fn of(column: &str, stated_unit: Option<&str>, order: Option<DateOrder>) -> Result<Self> {
        let stated =
            stated_unit.map(|unit| unit.trim_matches(['(', ')', '[', ']', '<', '>', ' ']).to_lowercase());
        let unit = stated.unwrap_or_else(|| unit(column));
        let exponent = exponent(&unit);
        match unit.as_str() {
            "min" | "minutes" | "h" | "hours" | "d" | "days" => {
                return Err(Error::new(format!("the time in column '{column}' is not in seconds"))
                    .allowed("s, ms, us, ns, or dates; --columns t= and --sample-time S ignore it"));
            }
            _ => {}
        }
        Ok(Self {
            column: column.to_owned(),
            unit: TimeUnit::of(exponent.unwrap_or(0)),
            is_stated: exponent.is_some(),
            since_1970: false,
            shortest: Shortest::default(),
            kind: Kind::NotSeen,
            order,
            last_s: 0.0,
            days: 0.0,
        })
    }

    /// The cells are numbers, of which this is the first.
    fn settle(&mut self, first: Stamp) {
        if self.kind != Kind::NotSeen {
            return;
        }
        self.kind = Kind::Numbers;
        let is_of_our_days = |unit: TimeUnit| OUR_DAYS_S.contains(&unit.scale(first).t_s);
        if !self.is_stated {
            let unit = [0, -3, -6, -9].into_iter().map(TimeUnit::of).find(|unit| is_of_our_days(*unit));
            self.unit = unit.unwrap_or(self.unit);
        }
        self.since_1970 = is_of_our_days(self.unit);
    }

    /// What the cells count, once they are known to be numbers.
    pub fn of_numbers(&self) -> Option<TimeUnit> {
        (self.kind == Kind::Numbers).then_some(self.unit)
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
                self.settle(stamp);
                return Ok(self.unit.scale(stamp));
            }
            if cell.is_empty() || parse_number(cell).is_some() {
                return Err(Error::new(format!("no time stamp in column '{}'", self.column)));
            }
            if self.kind == Kind::Numbers {
                return Err(not_a_number(cell, &self.column));
            }
        }
        let text = String::from_utf8_lossy(cell);
        match Moment::parse(&text) {
            Some(moment) => self.date(&moment, || text.clone().into_owned()),
            None => Err(self.refused(&text, "is neither a number nor a date", DATE_EXAMPLE)),
        }
    }

    /// The time that a number states, as the shortest text that reads back as it does; `None` where [`Self::read`] has to say
    /// what that text means.
    #[inline]
    pub fn number(&mut self, time: f64) -> Option<Stamp> {
        if matches!(self.kind, Kind::Dates { .. }) {
            return None;
        }
        let stamp = self.shortest.stamp(time)?;
        self.settle(stamp);
        Some(self.unit.scale(stamp))
    }

    /// The same of the numbers that come first, as long as none is written more finely than one before it: those stamps say
    /// nothing new about how finely stamps are written.
    #[inline]
    pub fn numbers<'a>(&'a self, times: &'a [f64]) -> impl Iterator<Item = Stamp> + 'a {
        let are_numbers = self.kind == Kind::Numbers;
        let times = if are_numbers { times } else { &[] };
        self.shortest.no_finer(times).map(|stamp| self.unit.scale(stamp))
    }

    /// The time of a date that reads as `text`, s.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn date(&mut self, moment: &Moment, text: impl Fn() -> String) -> Result<Stamp> {
        if self.order.is_none() {
            self.order = moment.order();
        }
        let origin = match &self.kind {
            Kind::Dates { origin, .. } => origin.clone(),
            Kind::NotSeen | Kind::Numbers => {
                self.kind = Kind::Dates { origin: moment.clone(), text: text() };
                moment.clone()
            }
        };
        if origin.writing != moment.writing {
            return Err(self.refused(&text(), "is not written like the dates before", DATE_EXAMPLE));
        }
        let mut t_s = self.since(&origin, moment, text)?;
        if moment.writing == Writing::TimeOfDay {
            self.days += f64::from(u8::from(t_s + self.days * DAY_S < self.last_s - 0.5 * DAY_S));
            t_s += self.days * DAY_S;
        }
        self.last_s = t_s;
        Ok(Stamp::written_to(t_s, moment.fraction_digits))
    }

    /// From the first date to this one, s. Where day and month could be either way round, the first change of the date
    /// decides: rows are not more than a day apart.
    fn since(&mut self, origin: &Moment, moment: &Moment, text: impl Fn() -> String) -> Result<f64> {
        let between = |order: DateOrder| Some(seconds(moment.at(order)?, origin.at(order)?));
        if moment.is_sure() || moment.is_same_day(origin) || self.order.is_some() {
            return between(self.order.unwrap_or(DateOrder::DayFirst))
                .ok_or_else(|| self.refused(&text(), "is no date", DATE_EXAMPLE));
        }
        let is_next = |t_s: &f64| *t_s > self.last_s && t_s - self.last_s <= STEP_MAX_S;
        let [day, month] = [DateOrder::DayFirst, DateOrder::MonthFirst];
        let (order, t_s) = match (between(day).filter(is_next), between(month).filter(is_next)) {
            (Some(t_s), None) => (day, t_s),
            (None, Some(t_s)) => (month, t_s),
            _ => {
                let what = "could have the day or the month first";
                return Err(self.refused(&text(), what, "--dates day-first or --dates month-first"));
            }
        };
        self.order = Some(order);
        Ok(t_s)
    }

    fn refused(&self, text: &str, what: &str, allowed: &str) -> Error {
        Error::new(format!("'{}' in column '{}' {what}", excerpt(text), self.column)).allowed(allowed)
    }

    /// The date at time 0 as it is written, without its zone: seconds since 1970; `None` of times of the day, and of numbers that
    /// count from elsewhere.
    pub fn zero_s(&self) -> Option<f64> {
        if self.since_1970 {
            return Some(0.0);
        }
        let Kind::Dates { origin, .. } = &self.kind else { return None };
        if origin.writing == Writing::TimeOfDay {
            return None;
        }
        let order = self.order.or(origin.is_sure().then_some(DateOrder::DayFirst))?;
        origin.at(order).map(|at| at.as_millisecond() as f64 * 1e-3)
    }

    /// What time 0 is, where the stamps are dates; or the unit, where it isn't the second.
    pub fn note(&self) -> Option<String> {
        let column = &self.column;
        match &self.kind {
            Kind::Dates { origin, text } => {
                let order = self.order.or(origin.is_sure().then_some(DateOrder::DayFirst));
                let at = order.and_then(|order| origin.at(order));
                let at = at.map_or_else(|| text.clone(), |at| shown(at, origin.writing));
                Some(format!("t counts from {at}"))
            }
            _ if self.since_1970 => {
                Some(format!("the times in '{column}' count {} since 1970", written(self.unit)))
            }
            _ if self.unit.exponent() != 0 => {
                Some(format!("the times in '{column}' are {}", written(self.unit)))
            }
            _ => None,
        }
    }
}

fn seconds(at: Timestamp, origin: Timestamp) -> f64 {
    let since = at.duration_since(origin);
    since.as_secs() as f64 + f64::from(since.subsec_nanos()) * 1e-9
}

fn shown(at: Timestamp, writing: Writing) -> String {
    match writing {
        Writing::Zoned => at.to_string(),
        Writing::TimeOfDay => TimeZone::UTC.to_datetime(at).time().to_string(),
        _ => TimeZone::UTC.to_datetime(at).to_string(),
    }
}

/// How a unit of time is called.
fn written(unit: TimeUnit) -> &'static str {
    match unit.exponent() {
        -3 => "ms",
        -6 => "us",
        -9 => "ns",
        _ => "s",
    }
}

/// Tens of seconds in a unit; `None` where it is none of these.
fn exponent(unit: &str) -> Option<i32> {
    match unit {
        "s" | "sec" | "secs" | "seconds" => Some(0),
        "ms" | "msec" | "millis" | "milliseconds" => Some(-3),
        "us" | "usec" | "\u{b5}s" | "\u{3bc}s" | "micros" | "microseconds" => Some(-6),
        "ns" | "nsec" | "nanos" | "nanoseconds" => Some(-9),
        _ => None,
    }
}

/// What a column's name says in brackets or behind its last underscore or blank, or behind the word for the time
/// (`TimeUS`), in lower case; the whole of a name that is a unit.
fn unit(column: &str) -> String {
    let name = column.trim_end_matches([')', ']', '>', ' ']).to_lowercase();
    if let Some(at) = name.rfind(['(', '[', '<', '_', ' ', '/']) {
        return name[at..].chars().skip(1).collect::<String>().trim().to_owned();
    }
    let behind = ["timestamp", "time"].into_iter().find_map(|word| name.strip_prefix(word)).unwrap_or(&name);
    if exponent(behind).is_some() { behind.to_owned() } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(column: &str, cells: &[&str]) -> Result<Vec<f64>> {
        let (mut clock, mut mark) = (Clock::of(column, None, None)?, DecimalMark::Open);
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
            ("23:59:59", "00:00:01", 2.0),
            ("05/13/2024 11:59:59 PM", "05/14/2024 12:00:01 AM", 2.0),
            ("13/05/2024 23:59:59", "14/05/2024 00:00:01", 2.0),
            ("13/05/24 23:59", "14/05/24 0:01", 120.0),
            // Two days later or two months: the file decides, because rows are not months apart.
            ("1/2/2024 23:59", "2/2/2024 0:01", 120.0),
            ("2/1/2024 23:59", "2/2/2024 0:01", 120.0),
            ("2024/05/31 23:59:59", "2024/06/01 00:00:01", 2.0),
            ("31-May-2024 23:59:59", "01-Jun-2024 00:00:01", 2.0),
            ("01/02/2024, 12:00:00", "01/02/2024, 12:00:01", 1.0),
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
            ("ms", 5e-3),
            ("TimeUS", 5e-6),
            ("timestamp_ns", 5e-9),
            ("times", 5.0),
            ("items", 5.0),
        ] {
            let t = read(column, &["5"]).unwrap()[0];
            assert!((t / expected - 1.0).abs() < 1e-12, "{column}: {t}");
        }
        assert!(read("t_min", &["5"]).unwrap_err().to_string().contains("not in seconds"));
    }

    #[test]
    fn numbers_of_our_days_count_from_1970() {
        for (column, first, start_s) in [
            ("Time", "1715587200", 1_715_587_200.0),
            ("Time", "1715587200000", 1_715_587_200.0),
            ("timestamp", "1715587200000000", 1_715_587_200.0),
            ("t", "1715587200000000000", 1_715_587_200.0),
            ("time_ms", "1715587200500", 1_715_587_200.5),
        ] {
            let (mut clock, mut mark) = (Clock::of(column, None, None).unwrap(), DecimalMark::Open);
            assert_eq!(clock.read(first.as_bytes(), &mut mark).unwrap().t_s, start_s, "{first}");
            assert_eq!(clock.zero_s(), Some(0.0), "{first}");
        }
        // A clock that began with the machine, and a unit that is stated.
        for (column, first, start_s) in
            [("Time", "5e8", 5e8), ("time_s", "1715587200000", 1_715_587_200_000.0)]
        {
            let (mut clock, mut mark) = (Clock::of(column, None, None).unwrap(), DecimalMark::Open);
            assert_eq!(clock.read(first.as_bytes(), &mut mark).unwrap().t_s, start_s, "{column}");
            assert_eq!(clock.zero_s(), None, "{column}");
        }
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for cells in [
            &["2024-13-01 12:00:00"][..],
            &["05/13/2024 12:00", "13/05/2024 12:01"],
            &["1/2/2024 12:00", "1/5/2024 12:00"],
            &["13/13/2024 12:00"],
            &["05/01/2024 13:00 PM"],
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
