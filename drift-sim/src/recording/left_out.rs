//! Rows of a text that are no samples: one that was cut off, a total or `End of file` behind the last sample, the header again where a
//! logger was restarted. They are left out and told, as long as they are few.

use super::records::Record;
use crate::{Error, Result};

/// Rows that may be no samples in any file: a file that is cut off has one of them, a table with a summary below it some. ...
const FEW: u64 = 10;
/// ... Of a longer file one row in so many: a logger that loses more has another fault, which its owner should hear of.
const ONE_IN: u64 = 100;
/// Rows that are told with their lines.
const SHOWN: usize = 3;

/// Why a row is no sample.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum NoSample {
    /// It says the same as the header, or as the units below it.
    HeaderAgain,
    /// It is only a part of a row, or more than one; in words.
    Torn(String),
    /// There are words in it and no numbers.
    Words,
}

impl NoSample {
    fn reason(&self) -> &str {
        match self {
            Self::HeaderAgain => "the header again",
            Self::Torn(what) => what,
            Self::Words => "words and no numbers",
        }
    }
}

/// The rows that were left out so far.
#[derive(Debug, Clone, Default)]
pub(super) struct LeftOut {
    count: u64,
    /// The first of them, each as `12 (why)`.
    shown: Vec<String>,
    first: Option<Error>,
    /// How often the header came again, and on which line first.
    headers: (u64, u64),
}

impl LeftOut {
    /// Leaves a row out that broke with `error`, behind so many good ones.
    ///
    /// # Errors
    /// There are too many of them.
    pub fn add(&mut self, why: &NoSample, line: u64, error: Error, rows: u64) -> Result<()> {
        if *why == NoSample::HeaderAgain {
            self.headers = (self.headers.0 + 1, if self.headers.0 == 0 { line } else { self.headers.1 });
            return Ok(());
        }
        self.count += 1;
        if self.shown.len() < SHOWN {
            self.shown.push(format!("{line} ({})", why.reason()));
        }
        let first = self.first.get_or_insert(error);
        if self.count <= FEW.max(rows / ONE_IN) {
            return Ok(());
        }
        // Where no row is a sample, the columns are at fault, and the first row says which.
        if rows == 0 {
            return Err(first.clone());
        }
        let what =
            format!("{} of {} rows are no samples; lines {}", self.count, self.count + rows, self.lines());
        Err(Error::new(what).allowed(format!("{FEW} of them, or one in {ONE_IN}")).at_line(line))
    }

    /// At the end of a file with so many good rows.
    ///
    /// # Errors
    /// So few of its rows are samples that it is not the table that it seemed to be.
    pub fn end(&mut self, rows: u64) -> Result<()> {
        if 2 * self.count <= rows {
            return Ok(());
        }
        self.first.take().map_or(Ok(()), Err)
    }

    /// How many there are, without headers.
    pub fn count(&self) -> u64 {
        self.count
    }

    fn lines(&self) -> String {
        let more = self.count.saturating_sub(self.shown.len() as u64);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{}{more}", self.shown.join(", "))
    }

    /// What a person should know of them.
    pub fn notes(&self) -> impl Iterator<Item = String> {
        let left_out = match self.count {
            0 => None,
            1 => Some(format!("one row is no sample and is left out: line {}", self.lines())),
            more => Some(format!("{more} rows are no samples and are left out: lines {}", self.lines())),
        };
        let again = match self.headers {
            (0, _) => None,
            (1, line) => Some(format!("the header comes again on line {line} and is passed over")),
            (more, line) => {
                Some(format!("the header comes again {more} times, first on line {line}, and is passed over"))
            }
        };
        left_out.into_iter().chain(again)
    }
}

/// What tells rows that are no samples from samples with a fault.
#[derive(Debug, Clone, Default)]
pub(super) struct Heading {
    names: Vec<String>,
    units: Vec<String>,
}

impl Heading {
    /// That of a table with these names, and what stands below them.
    pub fn of(names: &[String], units: &[String]) -> Self {
        let bare = |cells: &[String]| cells.iter().map(|cell| cell.trim().to_owned()).collect();
        Self { names: bare(names), units: bare(units) }
    }

    /// Whether the cells are these, but for empty ones at the end of the row.
    fn is(cells: &[String], record: &Record) -> bool {
        let same = |(cell, name): (&[u8], &String)| cell == name.as_bytes();
        !cells.is_empty()
            && record.len() >= cells.len()
            && record.iter().zip(cells).all(same)
            && record.iter().skip(cells.len()).all(<[u8]>::is_empty)
    }

    /// Whether a record is the header again, or what stands below it.
    pub fn comes_again(&self, record: &Record) -> bool {
        Self::is(&self.names, record) || Self::is(&self.units, record)
    }

    /// Refuses another header: words in every cell, as many as in the first or most of them the same.
    ///
    /// # Errors
    /// It is one.
    pub fn check_other(&self, record: &Record, is_word: impl Fn(&[u8]) -> bool) -> Result<()> {
        if record.len() < 2 || !record.iter().all(is_word) {
            return Ok(());
        }
        let is_known = |cell: &&[u8]| self.names.iter().any(|name| name.as_bytes() == *cell);
        let known = record.iter().filter(is_known).count();
        if record.len() != self.names.len() && 2 * known <= record.len() {
            return Ok(());
        }
        let cells: Vec<String> =
            record.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
        let what = format!(
            "the header comes again as '{}', before it was '{}'",
            excerpt(&cells),
            excerpt(&self.names)
        );
        Err(Error::new(what).allowed("one header; a file for each"))
    }
}

fn excerpt(cells: &[String]) -> String {
    super::row::excerpt(&cells.join(","))
}
