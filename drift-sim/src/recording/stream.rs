//! A recording of any length, sample by sample in constant memory: the sampling is established from the first rows
//! and every later one is checked as it comes.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::budget::{Budget, MEMORY_LIMIT_BYTES};
use super::choice::Reference;
use super::format::{self, Source};
use super::pacing::Pacing;
use super::repeated::merged;
use super::row::{Row, Rows, repeats};
use super::sampling::{HEAD_ROWS, Place};
use super::stretch::{Samples, Stretch};
use super::{ColumnMap, Quality, ReadOptions, RowState, mode_codes, parts, quality_codes};
use crate::controller::Controller;
use crate::physics::Units;
use crate::{Error, Result};

/// One sample of a loop. NaN is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<'a> {
    /// Its place on the uniform grid, from 0.
    pub index: u64,
    /// Time, s: the row's stamp; in gaps and without stamps, the grid's.
    pub t_s: f64,
    /// Reference; NaN where it is missing.
    pub r: f64,
    /// Measured output; NaN where it is missing.
    pub y: f64,
    /// Controller output; NaN where it is missing.
    pub u: f64,
    /// Whether the sample counts.
    pub state: RowState,
    /// The further columns, in the order of [`RecordingStream::extra_names`].
    pub extra: &'a [f64],
}

/// Reads a recording sample by sample.
pub struct RecordingStream {
    rows: Box<dyn Rows>,
    file: String,
    bytes_read: Arc<AtomicU64>,
    size_bytes: Option<u64>,
    /// Rows read ahead to find the sampling.
    head: VecDeque<Row>,
    /// Rows read ahead to hand them on together, behind those.
    stretch: Stretch,
    row: Row,
    /// The row before, to tell repeated ones.
    before: Row,
    pacing: Pacing,
    start_s: f64,
    missing_first: u64,
    index: u64,
    no_extra: Vec<f64>,
    quality: Quality,
    budget: Budget,
    work_bytes: u64,
    /// What r is taken to be as long as the recording holds none.
    assumed_r: Option<f64>,
}

impl RecordingStream {
    /// Opens a file of any format; `-` is standard input.
    ///
    /// # Errors
    /// The file can't be read, its header lacks a column, or its first rows are not uniformly sampled numbers.
    pub fn open(path: &Path, options: &ReadOptions) -> Result<Self> {
        if path == Path::new("-") {
            return Self::from_reader("standard input", std::io::stdin(), options);
        }
        let refused = |e: std::io::Error| Error::new(format!("can't be read: {e}")).in_file(path);
        let file = File::open(path).map_err(refused)?;
        let size_bytes = file.metadata().ok().filter(std::fs::Metadata::is_file).map(|m| m.len());
        let name = path.to_string_lossy();
        // A second handle, for formats of which only parts are read.
        let whole = file.try_clone().ok().filter(|_| size_bytes.is_some());
        let mut stream = Self::begin(&name, Box::new(file), whole, options).map_err(|e| e.in_file(path))?;
        stream.size_bytes = size_bytes;
        Ok(stream)
    }

    /// Reads any format from anywhere; errors call it by `name`.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn from_reader(
        name: &str,
        source: impl Read + Send + 'static,
        options: &ReadOptions,
    ) -> Result<Self> {
        Self::begin(name, Box::new(source), None, options).map_err(|e| e.in_file(name))
    }

    fn begin(
        name: &str,
        source: Box<dyn Read + Send>,
        file: Option<File>,
        options: &ReadOptions,
    ) -> Result<Self> {
        options.check()?;
        let bytes_read = Arc::new(AtomicU64::new(0));
        let reader = Counted { source, bytes: Arc::clone(&bytes_read) };
        let budget = Budget::of(options.memory_limit_bytes.unwrap_or(MEMORY_LIMIT_BYTES));
        let source = Source { reader: Box::new(reader), file, budget: budget.clone() };
        let rows = format::open(source, options)?.0;
        Self::of_rows(name, rows, budget, bytes_read, options)
    }

    /// A recording of these rows, wherever they are from.
    pub(super) fn of_rows(
        name: &str,
        rows: Box<dyn Rows>,
        budget: Budget,
        bytes_read: Arc<AtomicU64>,
        options: &ReadOptions,
    ) -> Result<Self> {
        let rows = parts::chosen(rows, options, &budget);
        let mut rows = quality_codes::judged(mode_codes::judged(merged(rows, options)));
        let mut quality = Quality::default();
        let (head, failed) = read_head(rows.as_mut(), &mut quality, &budget);
        // Where a row of the head is broken, an earlier fault of its time stamps is still the first to tell.
        let begun = Pacing::begin(rows.as_ref(), &head, options);
        let (pacing, start_s) = match (begun, failed) {
            (Err(error), Some(failure)) => {
                let earlier =
                    error.line().is_some_and(|line| failure.line().is_none_or(|other| line < other));
                return Err(if earlier { error } else { failure });
            }
            (_, Some(failure)) => return Err(failure),
            (begun, None) => begun?,
        };
        let assumed_r = assumed_reference(rows.as_ref(), &head);
        let mut stream = Self {
            budget,
            work_bytes: options.work_bytes,
            assumed_r,
            no_extra: vec![f64::NAN; rows.extra_names().len()],
            rows,
            file: name.to_owned(),
            bytes_read,
            size_bytes: None,
            head,
            stretch: Stretch::default(),
            row: Row::default(),
            before: Row::default(),
            pacing,
            start_s,
            missing_first: 0,
            index: 0,
            quality,
        };
        if matches!(stream.pacing, Pacing::Resampled(..)) {
            // The resampler stands on the first row already.
            stream.head.pop_front();
        }
        Ok(stream)
    }

    /// A recording that is on its grid already: one row, one sample, with what was found when it was read.
    pub(super) fn of_samples(
        name: &str,
        rows: Box<dyn Rows>,
        sample_time_s: f64,
        start_s: f64,
        quality: Quality,
    ) -> Self {
        Self {
            budget: Budget::of(MEMORY_LIMIT_BYTES),
            work_bytes: 0,
            assumed_r: None,
            no_extra: Vec::new(),
            rows,
            file: name.to_owned(),
            bytes_read: Arc::new(AtomicU64::new(0)),
            size_bytes: None,
            head: VecDeque::new(),
            stretch: Stretch::default(),
            row: Row::default(),
            before: Row::default(),
            pacing: Pacing::Given(sample_time_s),
            start_s,
            missing_first: 0,
            index: 0,
            // Counted anew while they come.
            quality: Quality { samples: 0, manual: 0, ..quality },
        }
    }

    /// The next sample, `None` at the end.
    ///
    /// # Errors
    /// A row that is broken, or a time stamp that is not on the grid.
    #[allow(clippy::should_implement_trait, reason = "a sample borrows from the stream, an Iterator's can't")]
    pub fn next(&mut self) -> Result<Option<Sample<'_>>> {
        let advanced = self.advance();
        let found = advanced.map_err(|e| e.in_file(&self.file))?;
        self.quality.samples = self.index + u64::from(found.is_some());
        let Some((t_s, is_missing, y)) = found else { return Ok(None) };
        let index = self.index;
        self.index += 1;
        if is_missing {
            let nan = f64::NAN;
            let state = RowState::Missing;
            return Ok(Some(Sample { index, t_s, r: nan, y: nan, u: nan, state, extra: &self.no_extra }));
        }
        let row = match &self.pacing {
            Pacing::Resampled(resampler, _) => resampler.held(),
            _ => &self.before,
        };
        let y = y.unwrap_or(row.y);
        if !row.r.is_nan() {
            self.assumed_r = None;
        }
        let r = self.assumed_r.unwrap_or(row.r);
        let state = if row.manual {
            self.quality.manual += 1;
            RowState::Manual
        } else if r.is_nan() || y.is_nan() || row.u.is_nan() {
            RowState::Missing
        } else {
            RowState::Valid
        };
        Ok(Some(Sample { index, t_s, r, y, u: row.u, state, extra: &row.extra }))
    }

    /// The next samples, as far as they can be handed on together: valid ones, each right after the one before, of a recording of
    /// which no further column is read. None where the next sample, or what is wrong with it, is for [`Self::next`] to tell.
    pub fn valid_samples(&mut self) -> Samples<'_> {
        self.stretch.t_s.clear();
        if self.head.is_empty() && self.missing_first == 0 && self.assumed_r.is_none() {
            self.take_valid();
        }
        self.stretch.taken()
    }

    fn take_valid(&mut self) {
        if self.stretch.is_used_up() && !matches!(self.pacing, Pacing::Resampled(..)) {
            self.stretch.clear();
            self.rows.read_ahead(&mut self.stretch, &mut self.quality);
        }
        let mut t_s = std::mem::take(&mut self.stretch.t_s);
        match &mut self.pacing {
            Pacing::Grid(grid) => {
                grid.follow(self.stretch.ahead(), &mut t_s);
                (self.quality.time_deviation_max_s, self.quality.time_deviation_max_line) =
                    grid.deviation_max();
            }
            Pacing::Given(sample_time_s) => {
                let (start_s, index) = (self.start_s, self.index);
                let later = |n: usize| start_s + (index + n as u64) as f64 * *sample_time_s;
                t_s.extend(self.stretch.ahead().enumerate().map(|(n, _)| later(n)));
            }
            Pacing::Resampled(..) => {}
        }
        self.index += t_s.len() as u64;
        self.quality.samples = self.index;
        self.stretch.t_s = t_s;
        self.stretch.take_timed(&mut self.before);
    }

    /// Moves to the next sample: its time, whether it is a missing one, and y where that isn't the row's own.
    fn advance(&mut self) -> Result<Option<(f64, bool, Option<f64>)>> {
        if let Pacing::Resampled(resampler, _) = &mut self.pacing {
            let (head, rows, quality) = (&mut self.head, &mut self.rows, &mut self.quality);
            let next = resampler.next(|row| next_row(head, rows.as_mut(), row, quality))?;
            quality.gaps = resampler.gaps;
            quality.gap_samples = resampler.gap_samples;
            quality.duplicates = resampler.duplicates;
            return Ok(next.map(|sample| (sample.t_s, sample.in_gap, Some(sample.y))));
        }
        if self.missing_first == 0 && !self.next_new_row()? {
            return Ok(None);
        }
        if self.missing_first > 1 {
            self.missing_first -= 1;
            let t_s = self.row.stamp.t_s - self.missing_first as f64 * self.sample_time_s();
            return Ok(Some((t_s, true, None)));
        }
        self.missing_first = 0;
        std::mem::swap(&mut self.row, &mut self.before);
        let t_s = match self.pacing {
            Pacing::Given(sample_time_s) => self.start_s + self.index as f64 * sample_time_s,
            _ => self.before.stamp.t_s,
        };
        Ok(Some((t_s, false, None)))
    }

    /// Reads the next row that isn't a repetition, and how many samples are missing before it.
    fn next_new_row(&mut self) -> Result<bool> {
        while self.stretch.take_one(&mut self.row)
            || next_row(&mut self.head, self.rows.as_mut(), &mut self.row, &mut self.quality)?
        {
            let Pacing::Grid(grid) = &mut self.pacing else { return Ok(true) };
            let place = grid.place(self.row.line, self.row.stamp)?;
            (self.quality.time_deviation_max_s, self.quality.time_deviation_max_line) = grid.deviation_max();
            match place {
                Place::Next => return Ok(true),
                Place::AfterGap(missing) => {
                    self.quality.gaps += 1;
                    self.quality.gap_samples += missing;
                    // One more: the row itself comes when only it is left.
                    self.missing_first = missing + 1;
                    return Ok(true);
                }
                Place::Repeated => {
                    repeats(&self.before, &self.row)?;
                    self.quality.duplicates += 1;
                }
            }
        }
        Ok(false)
    }

    /// From one sample to the next, s, as the first rows say.
    pub fn sample_time_s(&self) -> f64 {
        match &self.pacing {
            Pacing::Given(sample_time_s) | Pacing::Resampled(_, sample_time_s) => *sample_time_s,
            Pacing::Grid(grid) => grid.sample_time_s(),
        }
    }

    /// The same over all that was read so far.
    pub(super) fn whole_sample_time_s(&self) -> f64 {
        match &self.pacing {
            Pacing::Grid(grid) => grid.whole_sample_time_s(),
            _ => self.sample_time_s(),
        }
    }

    /// Time of the first sample, s.
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// The control law that the file itself states.
    pub(super) fn stated_law(&self) -> Option<Controller> {
        self.rows.stated_law()
    }

    /// The units of r, y and u that the file states.
    pub(super) fn units(&self) -> Units {
        self.rows.units()
    }

    /// The names of the further columns that were asked for.
    pub fn extra_names(&self) -> Vec<String> {
        self.rows.extra_names()
    }

    /// Which further columns hold text instead of numbers.
    pub(super) fn text_columns(&self) -> Vec<bool> {
        self.rows.text_columns()
    }

    /// The names of the columns that the signals are read from, those that were guessed among them.
    pub fn columns(&self) -> &ColumnMap {
        &self.rows.choice().columns
    }

    /// The date at t = 0 as written, in seconds since 1970; `None` where the recording has no dates.
    pub fn zero_s(&self) -> Option<f64> {
        self.rows.zero_s()
    }

    /// What was found so far; complete after the last sample. Cells of up to 10 000 rows that were read ahead are
    /// already counted.
    pub fn quality(&self) -> Quality {
        let mut quality = self.quality.clone();
        quality.notes = self.rows.notes();
        quality.notes.extend(self.assumed_r.map(|r| self.rest(r)));
        match &self.pacing {
            Pacing::Grid(grid) => quality.time_resolution_s = grid.resolution_s(),
            Pacing::Resampled(resampler, _) => quality.resampled = Some(resampler.jitter),
            Pacing::Given(_) => {}
        }
        quality
    }

    /// What is said of a recording without a reference.
    fn rest(&self, r: f64) -> String {
        let what = match self.rows.choice().r {
            Reference::Absent => "there is no column for r",
            Reference::Column(_) => "the column of r is empty",
        };
        let r = super::quality::short(r);
        format!(
            "{what}: the controller is taken to hold {r}, the median of y at the beginning (--columns r=NAME)"
        )
    }

    /// What the work on each sample takes, bytes.
    pub(super) fn work_bytes(&self) -> u64 {
        self.work_bytes
    }

    pub(super) fn budget(&self) -> &Budget {
        &self.budget
    }

    /// Bytes of the file read so far, for a progress bar.
    pub fn bytes_read(&self) -> u64 {
        self.bytes_read.load(Ordering::Relaxed)
    }

    /// Bytes of the whole file; `None` where that isn't known.
    pub fn size_bytes(&self) -> Option<u64> {
        self.size_bytes
    }

    /// What errors call the file.
    pub fn name(&self) -> &str {
        &self.file
    }
}

/// Counts what is read of the file itself, packed as it may be.
struct Counted<R> {
    source: R,
    bytes: Arc<AtomicU64>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.bytes.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

/// Reads the first rows, up to a broken one.
fn read_head(rows: &mut dyn Rows, quality: &mut Quality, budget: &Budget) -> (VecDeque<Row>, Option<Error>) {
    let mut head = VecDeque::new();
    while head.len() < HEAD_ROWS {
        let mut row = Row::default();
        match rows.read(&mut row, quality) {
            Ok(true) => {
                let bytes = size_of::<Row>() + row.extra.capacity() * size_of::<f64>();
                if let Err(error) = budget.take(bytes as u64) {
                    return (head, Some(error));
                }
                head.push_back(row);
            }
            Ok(false) => break,
            Err(error) => return (head, Some(error)),
        }
    }
    (head, None)
}

/// The median of y among the first rows, where none of them has a reference.
fn assumed_reference(rows: &dyn Rows, head: &VecDeque<Row>) -> Option<f64> {
    if rows.choice().r != Reference::Absent && head.iter().any(|row| !row.r.is_nan()) {
        return None;
    }
    let mut y: Vec<f64> = head.iter().map(|row| row.y).filter(|y| !y.is_nan()).collect();
    y.sort_by(f64::total_cmp);
    y.get(y.len() / 2).copied()
}

/// The next row: of those read ahead, then of the file.
fn next_row(
    head: &mut VecDeque<Row>,
    rows: &mut dyn Rows,
    row: &mut Row,
    quality: &mut Quality,
) -> Result<bool> {
    match head.pop_front() {
        Some(read_ahead) => {
            *row = read_ahead;
            Ok(true)
        }
        None => rows.read(row, quality),
    }
}
