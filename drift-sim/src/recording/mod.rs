//! Recordings of a loop: r, y and u at uniform times, read without believing anything about the file: CSV, gzip,
//! MATLAB, ULog, Parquet and more, told apart by how they begin. No file takes more memory than it is allowed ([`MEMORY_LIMIT_BYTES`]).
//!
//! [`RecordingStream`] reads sample by sample in constant memory; [`Recording::read`] collects what it yields, so
//! both find the same faults and say the same words. What can be mended is mended and counted in [`Quality`]; the
//! rest is one line with the number of the line it is about.

#[cfg(feature = "blackbox")]
mod blackbox;
mod budget;
mod cell_kind;
mod choice;
mod clock;
mod closed;
mod columns;
mod compressed;
#[cfg(any(feature = "parquet", feature = "matlab73", feature = "blackbox", feature = "mcap"))]
mod contained;
mod course;
mod csv;
mod date;
mod dates;
mod decimal;
mod fed;
mod format;
mod guess;
mod gzip;
mod json_columns;
mod json_lines;
mod json_objects;
mod klippy;
mod left_out;
mod long_table;
mod matlab;
mod matlab4;
#[cfg(feature = "matlab73")]
mod matlab73;
mod matlab_elements;
mod matlab_labels;
mod matlab_objects;
mod matlab_table;
mod matlab_unread;
#[cfg(feature = "mcap")]
mod mcap;
mod memory;
mod mode_codes;
mod overview;
mod pacing;
#[cfg(feature = "parquet")]
mod parquet;
mod parts;
mod quality;
mod quality_codes;
mod read_ahead;
mod records;
mod repeated;
mod resample;
mod row;
mod sampling;
mod serial_days;
mod signal_units;
mod stamp;
mod status;
mod stream;
mod stretch;
mod table;
mod text_rows;
mod ulog;
mod usual_names;
mod when;
mod write;

use std::io::Read;
use std::path::Path;

use crate::controller::Controller;
use crate::physics::Units;
use crate::sentences::{Clock, percent};
use crate::{Error, Result};
use budget::Budget;

pub use budget::{MEMORY_LIMIT_BYTES, SAMPLE_BYTES};
pub use columns::ColumnMap;
pub use date::DateOrder;
pub use dates::{DateUnit, Dates};
pub use fed::{FedRecording, Piece};
pub use overview::{Gap, Overview, Span};
pub use parts::Part;
pub use quality::{Jitter, Quality};
pub use repeated::Repeated;
pub use serial_days::TimeIn;
pub use stream::{RecordingStream, Sample};
pub use stretch::Samples;
pub use table::Cells;
pub use when::{Comparison, When};
pub use write::{csv_bytes, uniform_times_s, write_csv};

/// Whether a sample may enter a sum.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum RowState {
    /// All of r, y and u are there.
    #[default]
    Valid,
    /// One of them isn't, or the whole row is missing.
    Missing,
    /// A `when` condition does not hold: the loop is in manual.
    Manual,
}

/// How a recording is read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// Which column is which signal.
    pub columns: ColumnMap,
    /// The sample time, s, where there is no column of time stamps; where there is one, it must agree.
    pub sample_time_s: Option<f64>,
    /// Put rows at unequal intervals on a grid of this step, s: y linearly interpolated, all else held.
    pub resample_s: Option<f64>,
    /// Conditions that all must hold where the loop is closed; elsewhere samples are [`RowState::Manual`]. Without any,
    /// columns that are called MODE, AUTO, QUALITY and the like carry their own.
    pub when: Vec<When>,
    /// What becomes of rows that repeat a time stamp with other values.
    pub repeated: Repeated,
    /// Which comes first in dates like 5/1/2024, where the recording doesn't say it.
    pub date_order: Option<DateOrder>,
    /// What numbers in the time column count where its name states no unit; told by the numbers where nothing is said.
    pub time_in: Option<TimeIn>,
    /// Which part is read of a log in which time begins anew; without a word such a log is refused, but for the logs of programs that
    /// go on writing to the same file: of these the first part is read.
    pub part: Option<Part>,
    /// What reading it may take, bytes; [`MEMORY_LIMIT_BYTES`] where nothing is said.
    pub memory_limit_bytes: Option<u64>,
    /// What the work on each sample takes beside the recording itself, bytes: part of the same limit.
    pub work_bytes: u64,
    /// Further columns to read, in this order; text in them is an error.
    pub extra: Vec<String>,
    /// y or u may be missing: for a look at a file that nobody has named the columns of yet.
    pub incomplete: bool,
    /// Read all other columns as well; those that hold text are left out and counted.
    pub keep_extra: bool,
}

impl ReadOptions {
    fn check(&self) -> Result<()> {
        for (name, value) in [("sample time", self.sample_time_s), ("resampling step", self.resample_s)] {
            if let Some(s) = value.filter(|s| !(s.is_finite() && *s > 0.0)) {
                return Err(Error::new(format!("the {name} is {s} s")).allowed("a number above 0"));
            }
        }
        Ok(())
    }
}

/// A recording in memory. All columns are of one length; NaN is missing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    /// What errors and reports call it: the path.
    pub name: String,
    /// The names of the columns that the signals came from.
    pub columns: ColumnMap,
    /// From one sample to the next, s.
    pub sample_time_s: f64,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// The date at t = 0 as written, in seconds since 1970; `None` where the recording has no dates.
    pub zero_s: Option<f64>,
    /// Reference, in the loop's units.
    pub r: Vec<f64>,
    /// Measured output, in the loop's units.
    pub y: Vec<f64>,
    /// Controller output, in the loop's units.
    pub u: Vec<f64>,
    /// Whether each sample counts.
    pub state: Vec<RowState>,
    /// Further columns by name.
    pub extra: Vec<(String, Vec<f64>)>,
    /// The control law that the file itself states, as a printer's log does.
    pub stated_law: Option<Controller>,
    /// The units of r, y and u that the file states: below the names, in brackets behind them, or by its format.
    pub units: Units,
    /// What was found and done while reading.
    pub quality: Quality,
}

impl Recording {
    /// Reads a file of any format whole; `-` is standard input.
    ///
    /// # Errors
    /// The file can't be read, lacks a column, holds text where numbers belong, is not uniformly sampled (and no
    /// resampling is asked for), goes back in time or contradicts itself: one line with the line's number.
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self> {
        Self::collect(RecordingStream::open(path, options)?)
    }

    /// Reads any format from anywhere; errors call it by `name`.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn from_reader(
        name: &str,
        source: impl Read + Send + 'static,
        options: &ReadOptions,
    ) -> Result<Self> {
        Self::collect(RecordingStream::from_reader(name, source, options)?)
    }

    fn collect(mut stream: RecordingStream) -> Result<Self> {
        let budget = stream.budget().clone();
        let name = stream.name().to_owned();
        Self::collect_within(&mut stream, &budget).map_err(|e| e.in_file(name))
    }

    fn collect_within(stream: &mut RecordingStream, budget: &Budget) -> Result<Self> {
        let columns = stream.columns().clone();
        let mut recording = Self { name: stream.name().to_owned(), columns, ..Self::default() };
        recording.extra = stream.extra_names().into_iter().map(|name| (name, Vec::new())).collect();
        let work_bytes = stream.work_bytes();
        while let Some(sample) = stream.next()? {
            budget.check_work(work_bytes, recording.r.len() as u64 + 1)?;
            budget.push(&mut recording.r, sample.r)?;
            budget.push(&mut recording.y, sample.y)?;
            budget.push(&mut recording.u, sample.u)?;
            budget.push(&mut recording.state, sample.state)?;
            for ((_, values), value) in recording.extra.iter_mut().zip(sample.extra) {
                budget.push(values, *value)?;
            }
        }
        recording.sample_time_s = stream.whole_sample_time_s();
        recording.start_s = stream.start_s();
        recording.zero_s = stream.zero_s();
        recording.quality = stream.quality();
        recording.stated_law = stream.stated_law();
        recording.units = stream.units();
        let mut is_text = stream.text_columns().into_iter();
        let left_out = &mut recording.quality.text_columns;
        recording.extra.retain(|(name, _)| {
            let text = is_text.next().unwrap_or(false);
            if text {
                left_out.push(name.clone());
            }
            !text
        });
        recording.note_compression();
        Ok(recording)
    }

    fn note_compression(&mut self) {
        let Some(inside) = self.interpolated_y() else { return };
        let drawn = inside.iter().filter(|inside| **inside).count();
        let part = percent(100.0 * drawn as f64 / inside.len().max(1) as f64);
        self.quality.notes.push(format!(
            "{part} of y's samples lie on straight lines between others: an archive that keeps fewer has drawn \
             them; in a diagnosis they count as missing"
        ));
    }

    /// Which samples of y an archive has drawn between those that it kept; `None` where it kept all.
    pub fn interpolated_y(&self) -> Option<Vec<bool>> {
        compressed::interpolated(&self.y)
    }

    /// Number of samples, valid or not.
    pub fn len(&self) -> usize {
        self.r.len()
    }

    /// True where there is no sample, which a recording that was read never is.
    pub fn is_empty(&self) -> bool {
        self.r.is_empty()
    }

    /// Time of a sample, s.
    pub fn time_s(&self, index: usize) -> f64 {
        self.start_s + index as f64 * self.sample_time_s
    }

    /// How it tells the time.
    pub fn clock(&self) -> Clock {
        Clock::new(self.zero_s, self.duration_s())
    }

    /// From the first sample to one sample time after the last, s.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.sample_time_s
    }

    /// A signal or further column by name.
    ///
    /// # Errors
    /// There is none: the message lists those there are.
    pub fn column(&self, name: &str) -> Result<&[f64]> {
        match name {
            "r" => return Ok(&self.r),
            "y" => return Ok(&self.y),
            "u" => return Ok(&self.u),
            _ => {}
        }
        self.extra.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice()).ok_or_else(|| {
            let there = ["r", "y", "u"].into_iter().chain(self.extra.iter().map(|(n, _)| n.as_str()));
            let there: Vec<&str> = there.collect();
            choice::no_column(name, "a signal", &there).in_file(&self.name)
        })
    }
}
