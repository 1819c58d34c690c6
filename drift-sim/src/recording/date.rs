//! Dates as loggers, spreadsheets and people write them.

use std::str::FromStr;

use jiff::Timestamp;
use jiff::civil::{Date, DateTime, Time};
use jiff::tz::TimeZone;

use crate::{Error, Result};

/// Which comes first in 5/1/2024.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DateOrder {
    /// 5 January.
    DayFirst,
    /// 1 May.
    MonthFirst,
}

impl DateOrder {
    /// Both.
    pub(super) const ALL: [Self; 2] = [Self::DayFirst, Self::MonthFirst];

    /// As `--dates` takes it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::DayFirst => "day-first",
            Self::MonthFirst => "month-first",
        }
    }
}

impl FromStr for DateOrder {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "day-first" => Ok(Self::DayFirst),
            "month-first" => Ok(Self::MonthFirst),
            _ => Err(Error::new(format!("dates: '{text}'")).allowed("day-first, month-first")),
        }
    }
}

/// The ways that dates are written; one column keeps to one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Writing {
    /// With Z or an offset.
    Zoned,
    /// The year first, without a zone.
    Local,
    /// Day, month, year with points or with the month's name.
    DayFirst,
    /// Numbers with strokes or hyphens between them, the year last.
    Slashed,
    /// A time of the day.
    TimeOfDay,
}

/// A point in time as it is written.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moment {
    pub writing: Writing,
    /// Digits behind the seconds.
    pub fraction_digits: i32,
    when: When,
}

#[derive(Debug, Clone, PartialEq)]
enum When {
    At(Timestamp),
    /// Day and month could be either way round.
    Open {
        first: i8,
        second: i8,
        year: i16,
        time: Time,
    },
}

/// Months as MATLAB and many loggers write them.
const MONTHS: [&str; 12] =
    ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];

impl Moment {
    /// A point in time that is written with the year first and so many digits behind the seconds: with Z, or without a zone.
    pub fn year_first(at: Timestamp, is_utc: bool, fraction_digits: i32) -> Self {
        let writing = if is_utc { Writing::Zoned } else { Writing::Local };
        Self { writing, fraction_digits, when: When::At(at) }
    }

    /// `None` for what is no date and no time of the day.
    pub fn parse(text: &str) -> Option<Self> {
        // Every one has two or more signs between digits: most other text is told by a glance.
        if !text.starts_with(|c: char| c.is_ascii_digit()) || text.len() > 64 {
            return None;
        }
        let moment = |writing, when| Some(Self { writing, fraction_digits: fraction_digits(text), when });
        if text.split(':').next().is_some_and(|hours| hours.len() <= 2) {
            let at = utc(Date::constant(1970, 1, 1).to_datetime(time_of_day(text)?))?;
            return moment(Writing::TimeOfDay, When::At(at));
        }
        if let Ok(at) = text.parse::<Timestamp>() {
            return moment(Writing::Zoned, When::At(at));
        }
        let is_year_first = text.bytes().take_while(u8::is_ascii_digit).count() == 4;
        if is_year_first && let Ok(at) = text.replace('/', "-").parse::<DateTime>() {
            return moment(Writing::Local, When::At(utc(at)?));
        }
        let (date, time) = text.split_once([' ', 'T', ',']).unwrap_or((text, ""));
        let time = time_of_day(time.trim_start())?;
        let sign = date.chars().find(|c| matches!(c, '.' | '/' | '-'))?;
        let parts: Vec<&str> = date.split(sign).collect();
        let [first, second, third] = parts.as_slice() else { return None };
        let at = |day: i8, month: i8| utc(Date::new(year(third)?, month, day).ok()?.to_datetime(time));
        if is_year_first {
            let date = Date::new(first.parse().ok()?, second.parse().ok()?, third.parse().ok()?).ok()?;
            return moment(Writing::Local, When::At(utc(date.to_datetime(time))?));
        }
        let day: i8 = first.parse().ok()?;
        if let Some(month) = MONTHS.iter().position(|name| second.to_lowercase().starts_with(name)) {
            return moment(Writing::DayFirst, When::At(at(day, month as i8 + 1)?));
        }
        let second: i8 = second.parse().ok()?;
        if sign == '.' {
            return moment(Writing::DayFirst, When::At(at(day, second)?));
        }
        moment(Writing::Slashed, When::Open { first: day, second, year: year(third)?, time })
            .filter(Self::is_possible)
    }

    fn is_possible(&self) -> bool {
        self.at(DateOrder::DayFirst).is_some() || self.at(DateOrder::MonthFirst).is_some()
    }

    /// Whether it can be read in one way only, whatever the order.
    pub fn is_sure(&self) -> bool {
        matches!(self.when, When::At(_))
    }

    /// The order, where the numbers leave one.
    pub fn order(&self) -> Option<DateOrder> {
        match self.when {
            When::Open { first, .. } if first > 12 => Some(DateOrder::DayFirst),
            When::Open { second, .. } if second > 12 => Some(DateOrder::MonthFirst),
            _ => None,
        }
    }

    /// The date as it is written, where it could be either way round.
    pub fn open_day(&self) -> Option<(i8, i8, i16)> {
        match self.when {
            When::Open { first, second, year, .. } => Some((first, second, year)),
            When::At(_) => None,
        }
    }

    /// The point in time, with day and month in this order where they could be either way round.
    pub fn at(&self, order: DateOrder) -> Option<Timestamp> {
        match self.when {
            When::At(at) => Some(at),
            When::Open { first, second, year, time } => {
                let (day, month) =
                    if order == DateOrder::DayFirst { (first, second) } else { (second, first) };
                utc(Date::new(year, month, day).ok()?.to_datetime(time))
            }
        }
    }
}

/// Whether a cell is a date or a time of the day.
pub(super) fn is_date_or_time(cell: &str) -> bool {
    Moment::parse(cell).is_some()
}

fn utc(at: DateTime) -> Option<Timestamp> {
    TimeZone::UTC.to_timestamp(at).ok()
}

/// Of two digits, those from 70 on are of the last century.
fn year(text: &str) -> Option<i16> {
    let year: i16 = text.parse().ok()?;
    match text.len() {
        4 => Some(year),
        2 => Some(year + if year < 70 { 2000 } else { 1900 }),
        _ => None,
    }
}

/// Hours, minutes and, mostly, seconds; AM or PM behind; nothing is midnight.
fn time_of_day(text: &str) -> Option<Time> {
    if text.is_empty() {
        return Some(Time::midnight());
    }
    let lower =
        text.to_lowercase().replace([' ', '\u{202f}'], "").replace("a.m.", "am").replace("p.m.", "pm");
    let (clock, half) = match (lower.strip_suffix("am"), lower.strip_suffix("pm")) {
        (Some(clock), _) => (clock, Some(0)),
        (_, Some(clock)) => (clock, Some(12)),
        _ => (lower.as_str(), None),
    };
    let mut parts = clock.split(':');
    let (hours, minutes) = (parts.next()?, parts.next()?);
    let seconds = parts.next().unwrap_or("0");
    let is_number = |text: &str| (1..=2).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    let (whole, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, ""));
    let is_fraction = fraction.bytes().all(|b| b.is_ascii_digit());
    if parts.next().is_some() || ![hours, minutes, whole].into_iter().all(is_number) || !is_fraction {
        return None;
    }
    let hours: i8 = hours.parse().ok()?;
    let hours = match half {
        Some(half) if (1..=12).contains(&hours) => hours % 12 + half,
        Some(_) => return None,
        None => hours,
    };
    let nanoseconds = format!("{fraction:0<9}").get(..9)?.parse().ok()?;
    // A leap second is the last of its minute.
    let seconds = whole.parse::<i8>().ok()?.min(if whole == "60" { 59 } else { i8::MAX });
    Time::new(hours, minutes.parse().ok()?, seconds, nanoseconds).ok()
}

/// Digits behind the seconds; a zone may follow them.
fn fraction_digits(text: &str) -> i32 {
    let clock = text.find(':').and_then(|at| text.get(at..)).unwrap_or_default();
    let digits = clock.find(['.', ',']).and_then(|at| clock.get(at + 1..)).unwrap_or_default();
    digits.bytes().take_while(u8::is_ascii_digit).count().min(9) as i32
}
