//! Named columns in memory, as the binary formats hold them, read row by row like the lines of a text.
//!
//! A number in a time column is taken as the shortest text that reads back as it, so that times of two decimals are
//! known to be rounded to two decimals wherever they come from.

use super::choice::{Choice, Reference};
use super::clock::Clock;
use super::dates::Dates;
use super::decimal::DecimalMark;
use super::row::{Row, Rows, not_a_number, worse};
use super::stamp::{Shortest, Stamp};
use super::stretch::{self, Stretch};
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// Times of a table that the clock learns from.
const FORESEEN: usize = 10_000;

/// The cells of one column. NaN and `None` are missing.
#[derive(Debug, Clone)]
pub enum Cells {
    /// Numbers in double precision.
    Double(Vec<f64>),
    /// Numbers in single precision: in a time column their shortest text counts, 0.1 and not 0.10000000149.
    Single(Vec<f32>),
    /// Text: dates, modes, numbers as they are written.
    Text(Vec<Option<String>>),
    /// Dates as whole numbers.
    Dates(Dates),
}

impl Cells {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Double(values) => values.len(),
            Self::Single(values) => values.len(),
            Self::Text(values) => values.len(),
            Self::Dates(dates) => dates.len(),
        }
    }

    /// Takes all rows out; what they took stays for those to come.
    #[cfg(feature = "parquet")]
    pub(super) fn clear(&mut self) {
        match self {
            Self::Double(values) => values.clear(),
            Self::Single(values) => values.clear(),
            Self::Text(values) => values.clear(),
            Self::Dates(dates) => dates.since_1970.clear(),
        }
    }

    /// The number in a row; `None` where there is text.
    pub(super) fn number(&self, row: usize) -> Option<f64> {
        let number = match self {
            Self::Double(values) => values.get(row).copied(),
            Self::Single(values) => values.get(row).map(|x| f64::from(*x)),
            Self::Text(values) => match values.get(row) {
                Some(Some(_)) => return None,
                _ => None,
            },
            Self::Dates(dates) => match dates.written(row) {
                Some(_) => return None,
                None => None,
            },
        };
        Some(number.filter(|x| x.is_finite()).unwrap_or(f64::NAN))
    }

    fn text(&self, row: usize) -> String {
        match self {
            Self::Double(values) => values.get(row).map(|x| x.to_string()),
            Self::Single(values) => values.get(row).map(|x| x.to_string()),
            Self::Text(values) => values.get(row).cloned().flatten(),
            Self::Dates(dates) => dates.written(row),
        }
        .unwrap_or_default()
    }
}

/// Named columns that are unpacked one by one, when they are needed.
pub(super) trait Table {
    /// The names of all columns.
    fn names(&self) -> Vec<String>;
    /// How many values a column has.
    fn length(&self, index: usize) -> usize;
    /// Unpacks a column.
    ///
    /// # Errors
    /// It is damaged, or takes more memory than there is.
    fn cells(&mut self, index: usize) -> Result<Cells>;
}

/// Rows that come batch by batch, in the memory of one batch.
pub(super) trait Batches: Send {
    /// The cells of the columns that are read, by the indices of all columns, all of one length; `None` at the end, or as long as
    /// no more have come. What is left of the batch before is given back.
    ///
    /// # Errors
    /// The batch is damaged, or takes more memory than there is.
    fn next(&mut self, before: Vec<Option<Cells>>) -> Result<Option<Vec<Option<Cells>>>>;
}

/// Columns that are in memory already.
impl Table for Vec<(String, Cells)> {
    fn names(&self) -> Vec<String> {
        self.iter().map(|(name, _)| name.clone()).collect()
    }

    fn length(&self, index: usize) -> usize {
        self.get(index).map_or(0, |(_, cells)| cells.len())
    }

    fn cells(&mut self, index: usize) -> Result<Cells> {
        let cells = self.get_mut(index).map(|(_, cells)| std::mem::replace(cells, Cells::Single(Vec::new())));
        Ok(cells.unwrap_or(Cells::Single(Vec::new())))
    }
}

/// The columns that are read, of equal length.
pub(super) struct TableRows {
    /// Those of t, r, y, u, the conditions and the further columns, by the indices of `choice`.
    columns: Vec<Option<Cells>>,
    names: Vec<String>,
    choice: Choice,
    clock: Option<Clock>,
    notes: Vec<String>,
    /// The row of `columns` that comes next, and how many they hold.
    next: usize,
    count: usize,
    /// Rows read so far.
    line: u64,
    /// What comes after them.
    further: Option<Box<dyn Batches>>,
}

impl TableRows {
    /// Chooses columns of a table; those of another length than y are only passed over where nobody asked for them.
    ///
    /// # Errors
    /// A column isn't there, or is of another length.
    pub fn new(mut table: impl Table, notes: Vec<String>, options: &ReadOptions) -> Result<Self> {
        let names = table.names();
        let mut choice = Choice::of(&names, options)?;
        // Without a y, the longest column says how many rows there are.
        let longest = (0..names.len()).map(|index| table.length(index)).max().unwrap_or(0);
        let count = choice.y.or(choice.u).map_or(longest, |index| table.length(index));
        choice.extra.retain(|extra| extra.asked_for || table.length(extra.index) == count);
        let mut columns = Vec::with_capacity(names.len());
        for (index, is_used) in choice.uses(names.len()).into_iter().enumerate() {
            if is_used && table.length(index) != count {
                let y = choice.y.map_or("the longest", |y| names[y].as_str());
                let what =
                    format!("'{}' has {} values, '{y}' has {count}", names[index], table.length(index));
                let map = &choice.columns;
                let example = format!("--columns r={},y={},u={}", map.r, map.y, map.u);
                return Err(Error::new(what).allowed(format!("equally many; other columns by {example}")));
            }
            columns.push(if is_used { Some(table.cells(index)?) } else { None });
        }
        let mut rows = Self::of_batches(names, choice, None, options)?;
        (rows.columns, rows.count, rows.notes) = (columns, count, notes);
        rows.foresee()?;
        Ok(rows)
    }

    /// Rows that come batch by batch, of which these columns were chosen.
    ///
    /// # Errors
    /// The name of the column of time states a unit that is none.
    pub fn of_batches(
        names: Vec<String>,
        choice: Choice,
        further: Option<Box<dyn Batches>>,
        options: &ReadOptions,
    ) -> Result<Self> {
        let clock = choice.t.map(|t| Clock::of(&names[t], None, options)).transpose()?;
        let (columns, notes) = (Vec::new(), Vec::new());
        Ok(Self { columns, names, choice, clock, notes, next: 0, count: 0, line: 0, further })
    }

    /// The clock learns from the first times what all of them mean.
    fn foresee(&mut self) -> Result<()> {
        let (Some(t), Some(clock)) = (self.choice.t, &mut self.clock) else { return Ok(()) };
        match self.columns.get(self.choice.date.unwrap_or(t)).and_then(Option::as_ref) {
            Some(Cells::Double(times)) => {
                let mut shortest = Shortest::default();
                let stamps: Vec<Stamp> =
                    times.iter().take(FORESEEN).filter_map(|time| shortest.stamp(*time)).collect();
                clock.foresee_numbers(&stamps)
            }
            Some(Cells::Text(times)) => {
                clock.foresee(times.iter().take(FORESEEN).flatten().map(String::as_str))
            }
            _ => Ok(()),
        }
    }

    /// Goes to the next batch that holds rows; false at the end.
    fn advance(&mut self) -> Result<bool> {
        let Some(further) = &mut self.further else { return Ok(false) };
        loop {
            let Some(columns) = further.next(std::mem::take(&mut self.columns))? else { return Ok(false) };
            (self.columns, self.next) = (columns, 0);
            self.count = self.columns.iter().flatten().map(Cells::len).min().unwrap_or(0);
            if self.count > 0 {
                return Ok(true);
            }
        }
    }

    fn cells(&self, index: usize) -> Option<&Cells> {
        self.columns.get(index).and_then(Option::as_ref)
    }

    /// The number in a row; most columns hold nothing else.
    #[inline]
    fn number(&self, index: usize, row: usize) -> Result<f64> {
        match self.columns.get(index) {
            Some(Some(Cells::Double(values))) => {
                let number = values.get(row).copied().filter(|x| x.is_finite());
                Ok(number.unwrap_or(f64::NAN))
            }
            Some(Some(cells)) => self.number_or_text(cells, index, row),
            _ => Ok(f64::NAN),
        }
    }

    #[inline(never)]
    fn number_or_text(&self, cells: &Cells, index: usize, row: usize) -> Result<f64> {
        cells.number(row).ok_or_else(|| {
            let error = not_a_number(cells.text(row).as_bytes(), &self.names[index]);
            if row == 0 { error.allowed(self.choice.instead_of(index, &self.names)) } else { error }
        })
    }

    #[inline]
    fn signal(&self, index: usize, row: usize, missing: &mut u64) -> Result<f64> {
        let number = self.number(index, row)?;
        *missing += u64::from(number.is_nan());
        Ok(number)
    }

    fn text(&self, index: usize, row: usize) -> String {
        self.cells(index).map_or_else(String::new, |cells| cells.text(row))
    }

    /// The time in a row, which takes no text where it is a number or a date of its own.
    #[inline]
    fn stamp(&mut self, t: usize, at: usize) -> Result<Stamp> {
        let Some(clock) = &mut self.clock else { return Ok(Stamp::default()) };
        match self.columns.get(t).and_then(Option::as_ref) {
            Some(Cells::Double(times)) => {
                if let Some(stamp) = times.get(at).and_then(|time| clock.number(*time)) {
                    return Ok(stamp);
                }
            }
            Some(Cells::Dates(dates)) if self.choice.date.is_none() => {
                if let Some(moment) = dates.moment(at) {
                    return clock.date(&moment, || dates.written(at).unwrap_or_default());
                }
            }
            _ => {}
        }
        self.stamp_by_text(t, at)
    }

    #[inline(never)]
    fn stamp_by_text(&mut self, t: usize, at: usize) -> Result<Stamp> {
        let mut cell = self.text(t, at);
        if let Some(date) = self.choice.date.filter(|_| cell.contains(':')) {
            cell = format!("{} {cell}", self.text(date, at));
        }
        match &mut self.clock {
            Some(clock) => clock.read(cell.as_bytes(), &mut DecimalMark::Point),
            None => Ok(Stamp::default()),
        }
    }

    fn parse(&mut self, at: usize, row: &mut Row, quality: &mut Quality) -> Result<()> {
        if let Some(t) = self.choice.t {
            row.stamp = self.stamp(t, at)?;
        }
        row.r = match self.choice.r {
            Reference::Column(r) => self.signal(r, at, &mut quality.missing_r)?,
            Reference::Absent => f64::NAN,
        };
        let (y, u) = (self.choice.y, self.choice.u);
        row.y = y.map_or(Ok(f64::NAN), |y| self.signal(y, at, &mut quality.missing_y))?;
        row.u = u.map_or(Ok(f64::NAN), |u| self.signal(u, at, &mut quality.missing_u))?;
        let mode = self.choice.mode.and_then(|index| self.cells(index)?.number(at));
        row.mode = mode.unwrap_or(f64::NAN);
        self.read_status(at, row);
        row.extra.clear();
        for i in 0..self.choice.extra.len() {
            let (index, asked_for) = (self.choice.extra[i].index, self.choice.extra[i].asked_for);
            match self.number(index, at) {
                Ok(value) => row.extra.push(value),
                Err(error) if asked_for => return Err(error),
                Err(_) => {
                    self.choice.extra[i].text = true;
                    row.extra.push(f64::NAN);
                }
            }
        }
        Ok(())
    }
}

impl TableRows {
    fn read_status(&self, at: usize, row: &mut Row) {
        (row.manual, row.good) = (false, None);
        for (index, when) in &self.choice.when {
            let cell = self.text(*index, at);
            row.manual |= !when.holds(cell.as_bytes());
            row.good = worse(row.good, when.is_good_code(cell.as_bytes()));
        }
    }

    /// The columns of r, y and u, where they hold numbers in double precision and nothing else is read of a row but its time.
    fn numbers_alone(&self) -> Option<[&[f64]; 3]> {
        let choice = &self.choice;
        if !choice.is_signals_alone() {
            return None;
        }
        let Reference::Column(r) = choice.r else { return None };
        let column = |index: usize| match self.columns.get(index) {
            Some(Some(Cells::Double(values))) => values.get(self.next..self.count),
            _ => None,
        };
        Some([column(r)?, column(choice.y?)?, column(choice.u?)?])
    }

    /// Dates the rows that come next, at most so many, as long as their times are numbers that are written no more finely than those
    /// before; how many it were.
    fn date_numbers(&self, stretch: &mut Stretch, most: usize) -> usize {
        let (Some(t), Some(clock)) = (self.choice.t, &self.clock) else { return 0 };
        let Some(Cells::Double(times)) = self.cells(t) else { return 0 };
        let times = times.get(self.next..self.next + most).unwrap_or_default();
        stretch.date_all(self.line + 1, clock.numbers(times))
    }
}

/// How many of a stretch's numbers are finite before the first that isn't. All are looked at first: without a way out several are
/// compared at once.
fn finite_first(signal: &[f64]) -> usize {
    let signal = signal.get(..stretch::ROWS).unwrap_or(signal);
    if signal.iter().fold(true, |finite, x| finite & x.is_finite()) {
        return signal.len();
    }
    signal.iter().take_while(|x| x.is_finite()).count()
}

impl Rows for TableRows {
    fn choice(&self) -> &Choice {
        &self.choice
    }

    fn names(&self) -> &[String] {
        &self.names
    }

    fn zero_s(&self) -> Option<f64> {
        self.clock.as_ref().and_then(Clock::zero_s)
    }

    fn notes(&self) -> Vec<String> {
        let clock = self.clock.as_ref().and_then(Clock::note);
        self.choice.told().chain(self.notes.iter().cloned()).chain(clock).collect()
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        if self.next >= self.count && !self.advance()? {
            return Ok(false);
        }
        let at = self.next;
        self.next += 1;
        self.line += 1;
        row.line = self.line;
        self.parse(at, row, quality).map_err(|e| e.at_line(row.line))?;
        quality.rows += 1;
        Ok(true)
    }

    fn read_ahead(&mut self, stretch: &mut Stretch, quality: &mut Quality) {
        let Some([r, y, u]) = self.numbers_alone() else { return };
        let count = [r, y, u].into_iter().map(finite_first).min().unwrap_or(0);
        stretch.extend([r, y, u].map(|signal| signal.get(..count).unwrap_or_default()));
        while stretch.len() < count {
            let dated = self.date_numbers(stretch, count - stretch.len());
            (self.next, self.line) = (self.next + dated, self.line + dated as u64);
            if stretch.len() == count {
                break;
            }
            let stamp = self.choice.t.map_or(Ok(Stamp::default()), |t| self.stamp(t, self.next));
            let Ok(stamp) = stamp else { break };
            (self.next, self.line) = (self.next + 1, self.line + 1);
            stretch.date(self.line, stamp);
        }
        stretch.keep_dated();
        quality.rows += stretch.len() as u64;
    }
}
