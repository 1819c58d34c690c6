//! One row of data, and what every format's reader has in common: rows one after the other, each with its place.

use super::Quality;
use super::choice::Choice;
use super::stamp::Stamp;
use super::stretch::Stretch;
use crate::controller::Controller;
use crate::physics::Units;
use crate::{Error, Result};

/// One row of data: NaN is missing.
#[derive(Debug, Clone, Default)]
pub(super) struct Row {
    /// Its line in a text; in a table, which row it is (from 1).
    pub line: u64,
    pub stamp: Stamp,
    pub r: f64,
    pub y: f64,
    pub u: f64,
    pub manual: bool,
    /// The mode where it is written as a number.
    pub mode: f64,
    /// Whether the quality is good, where it is written as a code.
    pub good: Option<bool>,
    pub extra: Vec<f64>,
}

/// Of two codes of a quality the worse one.
#[inline]
pub(super) fn worse(one: Option<bool>, other: Option<bool>) -> Option<bool> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one && other),
        _ => one.or(other),
    }
}

impl Row {
    /// Whether it says the same as another, cell by cell.
    fn same_values(&self, other: &Self) -> bool {
        let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || a == b;
        same(self.r, other.r)
            && same(self.y, other.y)
            && same(self.u, other.u)
            && self.manual == other.manual
            && self.extra.len() == other.extra.len()
            && self.extra.iter().zip(&other.extra).all(|(a, b)| same(*a, *b))
    }
}

/// Checks that a row at the same time as the one before says the same: only then can it be dropped.
pub(super) fn repeats(before: &Row, row: &Row) -> Result<()> {
    if row.same_values(before) {
        return Ok(());
    }
    Err(Error::new(format!("the time {} s again, with other values", row.stamp.t_s))
        .allowed("--repeated first, last or mean")
        .at_line(row.line))
}

/// Rows of any format.
pub(super) trait Rows: Send {
    /// The columns that are read.
    fn choice(&self) -> &Choice;
    /// The names of all columns of the file, read or not.
    fn names(&self) -> &[String];
    /// Whether the rows have time stamps.
    fn has_time(&self) -> bool {
        self.choice().t.is_some()
    }
    /// The names of the further columns, in the order of [`Row::extra`].
    fn extra_names(&self) -> Vec<String> {
        self.choice().extra.iter().map(|e| e.name.clone()).collect()
    }
    /// Which of the further columns turned out to hold text.
    fn text_columns(&self) -> Vec<bool> {
        self.choice().extra.iter().map(|e| e.text).collect()
    }
    /// What was chosen on the way and a person should know, one line each.
    fn notes(&self) -> Vec<String>;
    /// The date at t = 0 as written, in seconds since 1970; `None` where there are no dates.
    fn zero_s(&self) -> Option<f64> {
        None
    }
    /// The control law that the file itself states; its limits with it.
    fn stated_law(&self) -> Option<Controller> {
        None
    }
    /// Whether the program that writes such files goes on in the same one when it is restarted: time may begin anew.
    fn is_restarted(&self) -> bool {
        false
    }
    /// The units of r, y and u that the file states.
    fn units(&self) -> Units {
        Units::default()
    }
    /// Reads the next row into `row`; false at the end.
    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool>;
    /// Adds the rows that come next to `stretch`, at most [`super::stretch::ROWS`], up to the first that isn't one of its kind: that one
    /// is [`Self::read`]'s, and whatever is wrong with it. Rows that can't be had side by side are all read one by one.
    fn read_ahead(&mut self, stretch: &mut Stretch, quality: &mut Quality) {
        let _ = (stretch, quality);
    }
}

/// Rows that are changed on their way: columns, names and dates stay those of their source.
pub(super) trait Filter: Send {
    fn source(&self) -> &dyn Rows;
    /// What was changed, in one line.
    fn note(&self) -> Option<String>;
    /// Reads the next row as [`Rows::read`] does.
    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool>;
}

impl<T: Filter> Rows for T {
    fn choice(&self) -> &Choice {
        self.source().choice()
    }

    fn names(&self) -> &[String] {
        self.source().names()
    }

    fn text_columns(&self) -> Vec<bool> {
        self.source().text_columns()
    }

    fn notes(&self) -> Vec<String> {
        self.source().notes().into_iter().chain(self.note()).collect()
    }

    fn zero_s(&self) -> Option<f64> {
        self.source().zero_s()
    }

    fn stated_law(&self) -> Option<Controller> {
        self.source().stated_law()
    }

    fn units(&self) -> Units {
        self.source().units()
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        Filter::read(self, row, quality)
    }
}

/// Enough of the input to find it by.
pub(super) fn excerpt(text: &str) -> String {
    const LONGEST: usize = 200;
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    text.chars().take(LONGEST).chain("...".chars()).collect()
}

pub(super) fn not_a_number(cell: &[u8], column: &str) -> Error {
    Error::new(format!("'{}' in column '{column}' is not a number", excerpt(&String::from_utf8_lossy(cell))))
}
