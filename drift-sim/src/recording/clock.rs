//! What the cells of a time column mean: numbers, in the unit that the column's name states, or dates ([`date`](super::date)).
//!
//! Numbers that are a time of our days when they count seconds, milliseconds ... since 1970 do so: loggers write these without
//! a unit.
//! Dates count from the recording's first, so that times stay short and exact; without a zone they are taken as they
//! stand. A clock that is put back shows as time that goes back, which is refused further on; a time of the day that
//! begins anew is the next day. Which of day and month comes first is decided by a number above 12, or by rows that go on over midnight;
//! where neither is there, the user is asked.

use jiff::Timestamp;
use jiff::tz::TimeZone;

use super::ReadOptions;
use super::date::{DateOrder, Moment, Writing};
use super::decimal::{DecimalMark, parse_number, with_point};
use super::quality::short;
use super::row::{excerpt, not_a_number};
use super::serial_days::{self, DAY_S, TimeIn, Verdict};
use super::stamp::{Shortest, Stamp, TimeUnit};
use crate::{Error, Result};

pub(super) use super::date::is_date_or_time;

const DATE_EXAMPLE: &str =
    "like 2024-05-01 12:00:00.5, 2024-05-01T12:00:00Z, 01.05.2024 12:00:00, 5/1/2024 1:30 PM, 12:00:00";
/// From 1990 to 2100, s since 1970.
const OUR_DAYS_S: std::ops::Range<f64> = 631_152_000.0..4_102_444_800.0;
/// Rows that are not further apart go on over midnight, s: the other reading of the date is weeks away ...
const GOES_ON_S: f64 = 3600.0;
/// ... or not further than so many steps of the same day.
const GOES_ON_STEPS: f64 = 2.0;

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
    /// Whether that is stated or follows from a number, and not only from rows that go on over midnight.
    is_order_sure: bool,
    /// The date, as it is written, by which rows that go on over midnight have decided.
    decided_by: Option<(Moment, String)>,
    /// The date of the last row as it is written, where it could be either way round, and the step to that row on the same day.
    last_day: Option<(i8, i8, i16)>,
    step_s: f64,
    /// What was said of numbers.
    time_in: Option<TimeIn>,
    /// Time of the last row, s.
    last_s: f64,
    /// Midnights passed where only the time of the day is written.
    days: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    NotSeen,
    Numbers,
    /// Days as spreadsheets count them, the first of them.
    Days {
        first: f64,
    },
    Dates {
        origin: Moment,
        text: String,
    },
}

impl Clock {
    /// The clock of a column; a unit counts: that of a row of units, or at the end of its name, `time_ms`, `t [us]`,
    /// `Time (s)`.
    ///
    /// # Errors
    /// A unit that is not s, ms, us or ns.
    pub fn of(column: &str, stated_unit: Option<&str>, options: &ReadOptions) -> Result<Self> {
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
            order: options.date_order,
            is_order_sure: options.date_order.is_some(),
            decided_by: None,
            last_day: None,
            step_s: 0.0,
            time_in: options.time_in,
            last_s: 0.0,
            days: 0.0,
        })
    }

    /// Learns from the first cells what all of them mean: the order of day and month, and whether numbers are days.
    ///
    /// # Errors
    /// Numbers could be days or seconds.
    pub fn foresee<'a>(&mut self, cells: impl Iterator<Item = &'a str>) -> Result<()> {
        let mut stamps = Vec::new();
        for cell in cells {
            let point = with_point(cell.as_bytes());
            match Stamp::parse(point.as_deref().unwrap_or(cell.as_bytes())) {
                Some(stamp) => stamps.push(stamp),
                None if self.is_order_sure => {}
                None => self.learn_order(Moment::parse(cell).as_ref().and_then(Moment::order))?,
            }
        }
        self.foresee_numbers(&stamps)
    }

    /// The same of stamps that are numbers.
    ///
    /// # Errors
    /// As [`Self::foresee`].
    pub fn foresee_numbers(&mut self, stamps: &[Stamp]) -> Result<()> {
        if self.is_stated || self.time_in.is_some() {
            return Ok(());
        }
        match serial_days::verdict(stamps) {
            Verdict::Seconds => {}
            Verdict::Days => self.time_in = Some(TimeIn::Days),
            Verdict::Open(step) => {
                let [days, seconds] = [step * DAY_S, step].map(short);
                let what =
                    format!("the numbers in '{}' could be days of a spreadsheet or seconds", self.column);
                let allowed =
                    format!("--time-in days (every {days} s) or --time-in seconds (every {seconds} s)");
                return Err(Error::new(what).allowed(allowed));
            }
        }
        Ok(())
    }

    fn learn_order(&mut self, seen: Option<DateOrder>) -> Result<()> {
        let Some(seen) = seen.filter(|_| !self.is_order_sure) else { return Ok(()) };
        if self.order.is_some_and(|order| order != seen) {
            let what = format!("the dates in '{}' have the {} later on", self.column, seen.word());
            return Err(Error::new(what).allowed(format!("--dates {}", seen.word())));
        }
        (self.order, self.is_order_sure) = (Some(seen), true);
        Ok(())
    }

    /// The cells are numbers, of which this is the first.
    fn settle(&mut self, first: Stamp) {
        if self.kind != Kind::NotSeen {
            return;
        }
        if self.time_in == Some(TimeIn::Days) && !self.is_stated {
            self.kind = Kind::Days { first: first.t_s };
            return;
        }
        self.kind = Kind::Numbers;
        let is_of_our_days = |unit: TimeUnit| OUR_DAYS_S.contains(&unit.scale(first).t_s);
        if !self.is_stated && self.time_in.is_none() {
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
                return Ok(match self.kind {
                    Kind::Days { first } => serial_days::since(first, stamp),
                    _ => self.unit.scale(stamp),
                });
            }
            if cell.is_empty() || parse_number(cell).is_some() {
                return Err(Error::new(format!("no time stamp in column '{}'", self.column)));
            }
            if self.kind != Kind::NotSeen {
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
        match self.kind {
            Kind::Days { first } => Some(serial_days::since(first, stamp)),
            _ => Some(self.unit.scale(stamp)),
        }
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
        self.learn_order(moment.order())?;
        let origin = match &self.kind {
            Kind::Dates { origin, .. } => origin.clone(),
            Kind::NotSeen | Kind::Numbers | Kind::Days { .. } => {
                self.last_day = moment.open_day();
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

    /// From the first date to this one, s. Where day and month could be either way round, rows that go on over midnight decide, as long as
    /// they do so at every change of the date.
    fn since(&mut self, origin: &Moment, moment: &Moment, text: impl Fn() -> String) -> Result<f64> {
        let between = |order: DateOrder| Some(seconds(moment.at(order)?, origin.at(order)?));
        let day = moment.open_day();
        if day.is_none() || day == self.last_day || self.is_order_sure {
            let t_s = between(self.order.unwrap_or(DateOrder::DayFirst))
                .ok_or_else(|| self.refused(&text(), "is no date", DATE_EXAMPLE))?;
            self.step_s = t_s - self.last_s;
            return Ok(t_s);
        }
        let longest_s = GOES_ON_S.max(GOES_ON_STEPS * self.step_s);
        let goes_on = |t_s: &f64| *t_s > self.last_s && t_s - self.last_s <= longest_s;
        let open = DateOrder::ALL.into_iter().filter(|order| self.order.is_none_or(|taken| taken == *order));
        let going_on: Vec<(DateOrder, f64)> =
            open.filter_map(|order| Some((order, between(order).filter(goes_on)?))).collect();
        self.last_day = day;
        match going_on.as_slice() {
            [(order, t_s)] => {
                self.order = Some(*order);
                self.decided_by = Some((moment.clone(), text()));
                Ok(*t_s)
            }
            // 2/2/2024 is the same date either way.
            _ if self.order.is_none() && between(DateOrder::DayFirst) == between(DateOrder::MonthFirst) => {
                between(DateOrder::DayFirst).ok_or_else(|| self.refused(&text(), "is no date", DATE_EXAMPLE))
            }
            _ => {
                let (moment, text) = self.decided_by.clone().unwrap_or_else(|| (moment.clone(), text()));
                Err(self.asked(&moment, &text))
            }
        }
    }

    /// Asks which of day and month comes first, with both readings.
    fn asked(&self, moment: &Moment, text: &str) -> Error {
        let reading = |order: DateOrder| {
            let date =
                moment.at(order).map(|at| TimeZone::UTC.to_datetime(at).strftime("%-d %B %Y").to_string());
            format!("--dates {} ({})", order.word(), date.unwrap_or_else(|| "no date".into()))
        };
        self.refused(text, "could have the day or the month first", &DateOrder::ALL.map(reading).join(" or "))
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
        let origin = match &self.kind {
            Kind::Dates { origin, .. } => origin,
            Kind::Days { first } => return serial_days::since_1970_s(*first),
            Kind::NotSeen | Kind::Numbers => return None,
        };
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
                let order = order.filter(|_| !origin.is_sure());
                let order =
                    order.map_or_else(String::new, |order| format!("; its dates are {}", order.word()));
                Some(format!("t counts from {at}{order}"))
            }
            Kind::Days { first } => {
                let at = serial_days::since_1970_s(*first)
                    .and_then(|s| Timestamp::from_millisecond((s * 1e3) as i64).ok());
                let at = at.map_or_else(|| format!("day {first}"), |at| shown(at, Writing::Local));
                Some(format!(
                    "the numbers in '{column}' are days of a spreadsheet: t counts from {at} (--time-in seconds says otherwise)"
                ))
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
mod tests;
