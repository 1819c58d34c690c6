//! Named columns in memory, as the binary formats hold them, read row by row like the lines of a text.
//!
//! A number in a time column is taken as the shortest text that reads back as it, so that times of two decimals are
//! known to be rounded to two decimals wherever they come from.

use super::choice::{Choice, Reference};
use super::clock::Clock;
use super::decimal::DecimalMark;
use super::row::{Row, Rows, not_a_number};
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// The cells of one column. NaN and `None` are missing.
#[derive(Debug, Clone)]
pub enum Cells {
    /// Numbers in double precision.
    Double(Vec<f64>),
    /// Numbers in single precision: in a time column their shortest text counts, 0.1 and not 0.10000000149.
    Single(Vec<f32>),
    /// Text: dates, modes, numbers as they are written.
    Text(Vec<Option<String>>),
}

impl Cells {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Double(values) => values.len(),
            Self::Single(values) => values.len(),
            Self::Text(values) => values.len(),
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
        };
        Some(number.filter(|x| x.is_finite()).unwrap_or(f64::NAN))
    }

    fn text(&self, row: usize) -> String {
        match self {
            Self::Double(values) => values.get(row).map(|x| x.to_string()),
            Self::Single(values) => values.get(row).map(|x| x.to_string()),
            Self::Text(values) => values.get(row).cloned().flatten(),
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
    next: usize,
    count: usize,
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
        let clock = choice.t.map(|t| Clock::of(&names[t], None, options.date_order)).transpose()?;
        Ok(Self { columns, names, choice, clock, notes, next: 0, count })
    }

    fn cells(&self, index: usize) -> Option<&Cells> {
        self.columns.get(index).and_then(Option::as_ref)
    }

    fn number(&self, index: usize, row: usize) -> Result<f64> {
        let Some(cells) = self.cells(index) else { return Ok(f64::NAN) };
        cells.number(row).ok_or_else(|| {
            let error = not_a_number(cells.text(row).as_bytes(), &self.names[index]);
            if row == 0 { error.allowed(self.choice.instead_of(index, &self.names)) } else { error }
        })
    }

    fn signal(&self, index: usize, row: usize, missing: &mut u64) -> Result<f64> {
        let number = self.number(index, row)?;
        *missing += u64::from(number.is_nan());
        Ok(number)
    }

    fn text(&self, index: usize, row: usize) -> String {
        self.cells(index).map_or_else(String::new, |cells| cells.text(row))
    }

    fn parse(&mut self, at: usize, row: &mut Row, quality: &mut Quality) -> Result<()> {
        if let Some(t) = self.choice.t {
            let mut cell = self.text(t, at);
            if let Some(date) = self.choice.date.filter(|_| cell.contains(':')) {
                cell = format!("{} {cell}", self.text(date, at));
            }
            if let Some(clock) = &mut self.clock {
                row.stamp = clock.read(cell.as_bytes(), &mut DecimalMark::Point)?;
            }
        }
        row.r = match self.choice.r {
            Reference::Column(r) => self.signal(r, at, &mut quality.missing_r)?,
            Reference::Absent => f64::NAN,
        };
        let (y, u) = (self.choice.y, self.choice.u);
        row.y = y.map_or(Ok(f64::NAN), |y| self.signal(y, at, &mut quality.missing_y))?;
        row.u = u.map_or(Ok(f64::NAN), |u| self.signal(u, at, &mut quality.missing_u))?;
        let mode = self.choice.mode.as_ref().and_then(|(index, _)| self.cells(*index)?.number(at));
        row.mode = mode.unwrap_or(f64::NAN);
        row.manual =
            self.choice.when.iter().any(|(index, when)| !when.holds(self.text(*index, at).as_bytes()));
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
        self.choice.notes.iter().chain(&self.notes).cloned().chain(clock).collect()
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        let at = self.next;
        if at >= self.count {
            return Ok(false);
        }
        self.next += 1;
        row.line = self.next as u64;
        self.parse(at, row, quality).map_err(|e| e.at_line(row.line))?;
        quality.rows += 1;
        Ok(true)
    }
}
