//! What is in a file, whatever is wrong with it: its rows as they stand, before anything is put on a grid.

use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use super::budget::{Budget, MEMORY_LIMIT_BYTES};
use super::format::{self, Source};
use super::quality::Jitter;
use super::repeated::merged;
use super::row::{Row, Rows};
use super::sampling::{jitter, median};
use super::{ColumnMap, Quality, ReadOptions, Recording, RecordingStream, mode_codes, parts, quality_codes};
use crate::{Error, Result};

/// An interval of so many usual ones is a gap.
const GAP_INTERVALS: f64 = 1.5;
/// u stays at its end for so many rows in a row where it is at a limit.
const LIMIT_ROWS: usize = 3;

/// A file as it is.
#[derive(Debug, Clone, Default)]
pub struct Overview {
    /// The path.
    pub name: String,
    /// What kind of file it is.
    pub format: &'static str,
    /// All columns.
    pub names: Vec<String>,
    /// Those that hold the signals.
    pub columns: ColumnMap,
    /// What was chosen on the way, a line each.
    pub notes: Vec<String>,
    /// What is missing, and how many rows there are.
    pub quality: Quality,
    /// Time of each row, s; where there are no stamps, from the sample time.
    pub t_s: Vec<f64>,
    /// The date at t = 0 as written, in seconds since 1970; `None` where there are no dates.
    pub zero_s: Option<f64>,
    /// Reference; NaN where it is missing.
    pub r: Vec<f64>,
    /// Measured output.
    pub y: Vec<f64>,
    /// Controller output.
    pub u: Vec<f64>,
    /// How unequal the intervals are; `None` where there are no stamps or all are the same.
    pub jitter: Option<Jitter>,
    /// Where rows are missing.
    pub gaps: Vec<Gap>,
    /// Rows at the time of the one before.
    pub repeated: u64,
    /// Stretches in which the loop is not closed.
    pub manual: Vec<Span>,
    /// Stretches in which u stays at its lowest, and at its highest value.
    pub at_limit: [Vec<Span>; 2],
    /// The signal that no column seems to be, and `--columns` as it could be for this file.
    pub lacks: Option<String>,
    /// The example alone; empty where nothing is missing.
    pub example: String,
    /// The sample time with which it can be read, or why it can't.
    pub sampling: Option<Result<f64>>,
}

/// A gap between two rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Time of the row before it, s.
    pub from_s: f64,
    /// To the row after it, s.
    pub length_s: f64,
}

/// Rows one after the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Time of the first, s.
    pub from_s: f64,
    /// Time of the last, s.
    pub to_s: f64,
    /// How many.
    pub rows: usize,
}

impl Overview {
    /// Reads a file of any format; `-` is standard input.
    ///
    /// # Errors
    /// It is in no format that is read, lacks a column or holds text where numbers belong. Uneven sampling is no error
    /// here.
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self> {
        let limit = options.memory_limit_bytes.unwrap_or(MEMORY_LIMIT_BYTES);
        if path == Path::new("-") {
            let name = "standard input";
            let bytes =
                Budget::of(limit).read_to_end(std::io::stdin().lock()).map_err(|e| e.in_file(name))?;
            return Self::from_reader(name, || Cursor::new(bytes.clone()), options);
        }
        let refused = |e: std::io::Error| Error::new(format!("can't be read: {e}")).in_file(path);
        let file = File::open(path).map_err(refused)?;
        let again = file.try_clone().ok().filter(|file| file.metadata().is_ok_and(|there| there.is_file()));
        let is_file = again.is_some();
        let mut overview = Self::of(&path.to_string_lossy(), Box::new(file), again, options)?;
        // A pipe can't be read twice.
        overview.sampling = is_file.then(|| sampling(RecordingStream::open(path, options)));
        Ok(overview)
    }

    /// Reads any format from anywhere; errors call it by `name`. `open` is called twice: for the rows as they are, and to see whether they
    /// can be put on a grid.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn from_reader<R: Read + Send + 'static>(
        name: &str,
        open: impl Fn() -> R,
        options: &ReadOptions,
    ) -> Result<Self> {
        let mut overview = Self::of(name, Box::new(open()), None, options)?;
        overview.sampling = Some(sampling(RecordingStream::from_reader(name, open(), options)));
        Ok(overview)
    }

    fn of(
        name: &str,
        reader: Box<dyn Read + Send>,
        file: Option<File>,
        options: &ReadOptions,
    ) -> Result<Self> {
        let budget = Budget::of(options.memory_limit_bytes.unwrap_or(MEMORY_LIMIT_BYTES));
        let read = || -> Result<Self> {
            let (rows, format) = format::open(Source { reader, file, budget: budget.clone() }, options)?;
            Self::of_rows(name, rows, format, &budget, options)
        };
        read().map_err(|e| e.in_file(name))
    }

    /// What is in these rows, wherever they are from.
    pub(super) fn of_rows(
        name: &str,
        rows: Box<dyn Rows>,
        format: &'static str,
        budget: &Budget,
        options: &ReadOptions,
    ) -> Result<Self> {
        let rows = parts::chosen(rows, options, budget);
        let mut rows = quality_codes::judged(mode_codes::judged(merged(rows, options)));
        let mut overview = Self { name: name.to_owned(), format, ..Self::default() };
        let manual = overview.collect(rows.as_mut(), budget, options)?;
        overview.names = rows.names().to_vec();
        overview.columns = rows.choice().columns.clone();
        overview.notes = rows.notes();
        overview.zero_s = rows.zero_s();
        if let Some(lack) = &rows.choice().lacks {
            (overview.lacks, overview.example) = (Some(lack.says.clone()), lack.example.clone());
        }
        overview.describe(&manual);
        Ok(overview)
    }

    fn collect(&mut self, rows: &mut dyn Rows, budget: &Budget, options: &ReadOptions) -> Result<Vec<bool>> {
        let (mut row, mut manual) = (Row::default(), Vec::new());
        let has_time = rows.has_time();
        while rows.read(&mut row, &mut self.quality)? {
            let given = self.t_s.len() as f64 * options.sample_time_s.unwrap_or(1.0);
            budget.push(&mut self.t_s, if has_time { row.stamp.t_s } else { given })?;
            budget.push(&mut self.r, row.r)?;
            budget.push(&mut self.y, row.y)?;
            budget.push(&mut self.u, row.u)?;
            budget.push(&mut manual, row.manual)?;
        }
        if self.t_s.is_empty() {
            return Err(Error::new("no rows of data, only a header"));
        }
        Ok(manual)
    }

    fn describe(&mut self, manual: &[bool]) {
        let steps: Vec<(u64, f64)> = (2..)
            .zip(self.t_s.windows(2))
            .filter_map(|(row, pair)| match pair {
                [before, after] => Some((row, after - before)),
                _ => None,
            })
            .collect();
        self.repeated = steps.iter().filter(|(_, step)| *step == 0.0).count() as u64;
        let forward: Vec<(u64, f64)> = steps.iter().copied().filter(|(_, step)| *step > 0.0).collect();
        let usual = median(&forward).unwrap_or(0.0);
        let long = forward.iter().filter(|(_, step)| *step > GAP_INTERVALS * usual);
        self.gaps = long
            .filter_map(|(row, step)| {
                Some(Gap { from_s: *self.t_s.get(*row as usize - 2)?, length_s: *step })
            })
            .collect();
        let within: Vec<(u64, f64)> =
            forward.iter().copied().filter(|(_, step)| *step <= GAP_INTERVALS * usual).collect();
        self.jitter = jitter(&within);
        self.manual = self.spans(|i| manual.get(i).copied().unwrap_or(false), 1);
        let ends = [f64::min, f64::max].map(|better: fn(f64, f64) -> f64| {
            self.u.iter().copied().filter(|u| !u.is_nan()).reduce(better).unwrap_or(f64::NAN)
        });
        #[expect(clippy::float_cmp, reason = "a limit is reached exactly")]
        let is_fixed = ends[0] == ends[1];
        #[expect(clippy::float_cmp, reason = "a limit is reached exactly")]
        let at = |end: f64| self.spans(|i| !is_fixed && self.u.get(i).is_some_and(|u| *u == end), LIMIT_ROWS);
        self.at_limit = ends.map(at);
    }

    /// Stretches of at least so many rows.
    fn spans(&self, holds: impl Fn(usize) -> bool, least: usize) -> Vec<Span> {
        let mut spans: Vec<Span> = Vec::new();
        let mut is_open = false;
        for (i, t_s) in self.t_s.iter().enumerate() {
            match spans.last_mut().filter(|_| is_open) {
                Some(span) if holds(i) => (span.to_s, span.rows) = (*t_s, span.rows + 1),
                None if holds(i) => spans.push(Span { from_s: *t_s, to_s: *t_s, rows: 1 }),
                _ => {}
            }
            is_open = holds(i);
        }
        spans.retain(|span| span.rows >= least);
        spans
    }
}

/// The sample time of a recording that can be read to its end.
pub(super) fn sampling(stream: Result<RecordingStream>) -> Result<f64> {
    Recording::collect(stream?).map(|recording| recording.sample_time_s)
}
