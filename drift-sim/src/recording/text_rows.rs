//! Rows of numbers out of records of text: what every format of text has in common.

use super::cell_kind::FirstRows;
use super::choice::Choice;
use super::clock::{Clock, is_date_or_time};
use super::decimal::{DecimalMark, parse_number, with_point};
use super::left_out::{Heading, LeftOut, NoSample};
use super::records::{Record, Records};
use super::row::{Row, Rows, not_a_number, worse};
use super::stamp::TimeUnit;
use super::{Quality, ReadOptions, signal_units};
use crate::controller::Controller;
use crate::physics::Units;
use crate::{Error, Result};

/// Reads rows one after the other; memory stays that of one row.
pub(super) struct TextRows<R> {
    records: R,
    record: Record,
    names: Vec<String>,
    /// Of r, y and u, as the source states them.
    units: Units,
    choice: Choice,
    clock: Option<Clock>,
    mark: DecimalMark,
    /// Date and time of the day from two columns, put together.
    joined: Vec<u8>,
    heading: Heading,
    left_out: LeftOut,
}

/// What single rows have settled for those that follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Settled {
    pub mark: DecimalMark,
    pub unit: TimeUnit,
    /// How many further columns hold text.
    pub texts: usize,
}

/// The columns of a source of records.
pub(super) struct Header {
    pub names: Vec<String>,
    /// What stands below the names in a row of units; empty where there is none.
    pub units: Vec<String>,
    pub first_rows: FirstRows,
    pub mark: DecimalMark,
}

impl<R: Records> TextRows<R> {
    /// Chooses among the columns of a source.
    ///
    /// # Errors
    /// A column is missing, or two are called the same.
    pub fn new(records: R, header: Header, options: &ReadOptions) -> Result<Self> {
        let Header { names, units, first_rows, mark } = header;
        let choice = Choice::among(&names, &first_rows.kinds(), options)?;
        let clock = choice.t.map(|t| {
            let unit = units.get(t).filter(|unit| !unit.is_empty());
            let mut clock = Clock::of(&names[t], unit.map(String::as_str), options)?;
            clock.foresee(first_rows.column(choice.date.unwrap_or(t)))?;
            Ok(clock)
        });
        let clock = clock.transpose()?;
        let heading = Heading::of(&names, &units);
        let units = signal_units::of(&choice, &names, &units);
        Ok(Self {
            records,
            record: Record::default(),
            names,
            units,
            choice,
            clock,
            mark,
            joined: Vec::new(),
            heading,
            left_out: LeftOut::default(),
        })
    }

    /// Where the records come from.
    pub fn records_mut(&mut self) -> &mut R {
        &mut self.records
    }

    /// What the file's decimal mark and the unit of its times are, and how many further columns hold text, for a reader of rows
    /// that need no more than that; `None` where there are dates.
    pub fn settled(&self) -> Option<Settled> {
        let unit = match &self.clock {
            Some(clock) => clock.of_numbers()?,
            None => TimeUnit::of(0),
        };
        let texts = self.choice.extra.iter().filter(|extra| extra.text).count();
        Some(Settled { mark: self.mark, unit, texts })
    }

    fn parse(&mut self, row: &mut Row, quality: &mut Quality, line: u64) -> Result<()> {
        if let Some(error) = self.record.broken() {
            return Err(error.clone());
        }
        let width = self.names.len();
        if self.record.len() != width {
            // Spreadsheets end rows in commas: more fields are harmless as long as they hold nothing.
            let more_is_empty = self.record.iter().skip(width).all(<[u8]>::is_empty);
            if self.record.len() < width || !more_is_empty {
                let fields = plural(self.record.len(), "field");
                return Err(Error::new(format!("{fields} where the header has {width}")));
            }
        }
        row.line = line;
        self.read_stamp(row)?;
        let is_first = quality.rows == 0;
        row.r = self.signal(self.choice.r.column(), is_first, &mut quality.missing_r)?;
        row.y = self.signal(self.choice.y, is_first, &mut quality.missing_y)?;
        row.u = self.signal(self.choice.u, is_first, &mut quality.missing_u)?;
        self.read_status(row);
        row.mode = self.mode();
        row.extra.clear();
        for i in 0..self.choice.extra.len() {
            let value = self.extra_value(i)?;
            row.extra.push(value);
        }
        Ok(())
    }

    /// Why a record that breaks with `error` is no sample; `None` where it is one with a fault.
    ///
    /// # Errors
    /// It is another header.
    fn no_sample(&self, error: &Error) -> Result<Option<NoSample>> {
        let record = &self.record;
        if self.heading.comes_again(record) {
            return Ok(Some(NoSample::HeaderAgain));
        }
        if record.as_slice().contains(&0) {
            return Ok(Some(NoSample::Torn("cut off, with NULs behind it".into())));
        }
        if record.broken().is_some() {
            return Ok(Some(NoSample::Torn("cut off".into())));
        }
        let is_word = |cell: &[u8]| !cell.is_empty() && !is_number_or_date(cell);
        self.heading.check_other(record, is_word)?;
        let choice = &self.choice;
        let signals = [choice.t, choice.r.column(), choice.y, choice.u].into_iter().flatten();
        let has_numbers = signals.filter_map(|index| record.get(index)).any(is_number_or_date);
        let begins_as_number = |cell: &[u8]| cell.first().is_some_and(u8::is_ascii_digit) && is_word(cell);
        Ok(if !has_numbers && record.iter().any(is_word) {
            Some(NoSample::Words)
        } else if record.len() != self.names.len() {
            Some(NoSample::Torn(error.to_string()))
        } else if choice.t.and_then(|t| record.get(t)).is_some_and(begins_as_number) {
            // Two rows run into each other where the first was cut off.
            Some(NoSample::Torn("its time is none".into()))
        } else {
            None
        })
    }

    fn read_stamp(&mut self, row: &mut Row) -> Result<()> {
        let (Some(t), Some(clock)) = (self.choice.t, &mut self.clock) else { return Ok(()) };
        let mut cell = self.record.get(t).unwrap_or_default();
        // A date beside a number that counts seconds says nothing more.
        if let Some(date) = self.choice.date.filter(|_| cell.contains(&b':')) {
            self.joined.clear();
            self.joined.extend_from_slice(self.record.get(date).unwrap_or_default());
            self.joined.push(b' ');
            self.joined.extend_from_slice(cell);
            cell = &self.joined;
        }
        row.stamp = clock.read(cell, &mut self.mark)?;
        Ok(())
    }

    /// A signal that may be absent.
    fn signal(&mut self, index: Option<usize>, is_first: bool, missing: &mut u64) -> Result<f64> {
        index.map_or(Ok(f64::NAN), |index| self.number(index, is_first, missing))
    }

    /// The mode as a number, where it is one.
    fn mode(&self) -> f64 {
        let cell = self.choice.mode.and_then(|index| self.record.get(index));
        cell.and_then(parse_number).unwrap_or(f64::NAN)
    }

    fn read_status(&self, row: &mut Row) {
        (row.manual, row.good) = (false, None);
        for (index, when) in &self.choice.when {
            let cell = self.record.get(*index).unwrap_or_default();
            let plain = self.mark.plain(cell);
            let cell = plain.as_deref().unwrap_or(cell);
            row.manual |= !when.holds(cell);
            row.good = worse(row.good, when.is_good_code(cell));
        }
    }

    /// The value of a further column; text that nobody asked for makes the whole column one of text.
    fn extra_value(&mut self, i: usize) -> Result<f64> {
        let extra = &mut self.choice.extra[i];
        if extra.text {
            return Ok(f64::NAN);
        }
        let cell = self.record.get(extra.index).unwrap_or_default();
        match self.mark.number(cell) {
            Ok(Some(value)) => Ok(value),
            _ if !extra.asked_for => {
                extra.text = true;
                Ok(f64::NAN)
            }
            Ok(None) => Err(not_a_number(cell, &self.names[extra.index])),
            Err(error) => Err(error),
        }
    }

    fn number(&mut self, index: usize, is_first: bool, missing: &mut u64) -> Result<f64> {
        let cell = self.record.get(index).unwrap_or_default();
        let number = self.mark.number(cell)?.ok_or_else(|| {
            let error = not_a_number(cell, &self.names[index]);
            match with_point(cell) {
                Some(_) => error.allowed("a decimal point"),
                None if is_first => error.allowed(self.choice.instead_of(index, &self.names)),
                None => error,
            }
        })?;
        *missing += u64::from(number.is_nan());
        Ok(number)
    }
}

impl<R: Records> Rows for TextRows<R> {
    fn choice(&self) -> &Choice {
        &self.choice
    }

    fn names(&self) -> &[String] {
        &self.names
    }

    fn zero_s(&self) -> Option<f64> {
        self.clock.as_ref().and_then(Clock::zero_s)
    }

    fn stated_law(&self) -> Option<Controller> {
        self.records.stated_law()
    }

    fn is_restarted(&self) -> bool {
        self.records.is_restarted()
    }

    fn units(&self) -> Units {
        self.units.clone()
    }

    fn notes(&self) -> Vec<String> {
        let clock = self.clock.as_ref().and_then(Clock::note);
        let left_out = self.left_out.notes();
        self.records.notes().into_iter().chain(self.choice.told()).chain(clock).chain(left_out).collect()
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        loop {
            let Some(line) = self.records.next(&mut self.record, quality)? else {
                self.left_out.end(quality.rows)?;
                return Ok(false);
            };
            let missing = (quality.missing_r, quality.missing_y, quality.missing_u);
            let Err(error) = self.parse(row, quality, line) else {
                quality.rows += 1;
                return Ok(true);
            };
            let Some(why) = self.no_sample(&error).map_err(|e| e.at_line(line))? else {
                return Err(error.at_line(line));
            };
            (quality.missing_r, quality.missing_y, quality.missing_u) = missing;
            self.left_out.add(&why, line, error.at_line(line), quality.rows)?;
            quality.left_out = self.left_out.count();
            // Without time stamps a sample that was lost has to keep its place.
            if matches!(why, NoSample::Torn(_)) && self.choice.t.is_none() {
                *row = Row { line, r: f64::NAN, y: f64::NAN, u: f64::NAN, mode: f64::NAN, ..Row::default() };
                row.extra.resize(self.choice.extra.len(), f64::NAN);
                quality.rows += 1;
                return Ok(true);
            }
        }
    }
}

/// A value that is no word for nothing.
fn is_number_or_date(cell: &[u8]) -> bool {
    let number = parse_number(cell).or_else(|| parse_number(&with_point(cell)?));
    match number {
        Some(number) => !number.is_nan(),
        None => std::str::from_utf8(cell).is_ok_and(is_date_or_time),
    }
}

fn plural(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}
