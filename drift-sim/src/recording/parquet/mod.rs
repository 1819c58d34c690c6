//! Parquet files: flat columns of numbers, flags, text and time stamps. Only the columns that are read are unpacked, batch by
//! batch and side by side, so that a file of any length takes the memory of a few pages.

mod column;
mod file;
mod sizes;

use crate::cores::AcrossCores as _;
use ::parquet::errors::ParquetError;
use ::parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use bytes::Bytes;

use super::ReadOptions;
use super::budget::Budget;
use super::choice::Choice;
use super::contained::contained;
use super::format::Source;
use super::table::{Batches, Cells, TableRows};
use crate::{Error, Result};
use column::Column;
use file::Shared;

const DAMAGED: &str = "the Parquet file is cut off or damaged";
/// Rows of a file, at most.
const ROWS_MAX: i64 = 1 << 31;

/// The rows of a file that begins like one.
///
/// # Errors
/// The file is damaged or encrypted, has nested columns where signals belong, lacks a column, or takes more memory than
/// is allowed.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<TableRows> {
    let budget = source.budget.clone();
    let file = source.file.as_ref().and_then(|file| Shared::new(file.try_clone().ok()?).ok());
    match file {
        Some(file) => contained(DAMAGED, || rows(file, &budget, options)),
        None => {
            let bytes = Bytes::from(source.bytes()?);
            contained(DAMAGED, || rows(bytes, &budget, options))
        }
    }
}

fn rows<F>(file: F, budget: &Budget, options: &ReadOptions) -> Result<TableRows>
where
    F: ChunkReader + Clone + 'static,
{
    sizes::check_footer(&file, budget)?;
    let reader = SerializedFileReader::new(file.clone()).map_err(refused)?;
    let count = reader.metadata().file_metadata().num_rows();
    if !(0..=ROWS_MAX).contains(&count) {
        return Err(Error::new(format!("the Parquet file says it has {count} rows")).allowed("up to 2^31"));
    }
    let schema = reader.metadata().file_metadata().schema_descr();
    // A nested or repeated column has another number of values than the file has rows.
    let flat: Vec<usize> =
        (0..schema.num_columns()).filter(|i| schema.column(*i).max_rep_level() == 0).collect();
    let names: Vec<String> = flat.iter().map(|i| schema.column(*i).path().parts().join(".")).collect();
    let choice = Choice::of(&names, options)?;
    let is_used = choice.uses(names.len());
    let columns = flat.into_iter().zip(is_used);
    let columns = columns
        .map(|(index, is_used)| is_used.then(|| Column::new(index, &schema.column(index), budget)))
        .collect();
    let groups = Groups { file, reader, columns, budget: budget.clone(), next: 0, is_begun: false };
    TableRows::of_batches(names, choice, Some(Box::new(groups)), options)
}

fn refused(error: ParquetError) -> Error {
    Error::new(format!("{DAMAGED}: {error}"))
}

/// The row groups of a file, of which one is open.
struct Groups<F: ChunkReader> {
    file: F,
    reader: SerializedFileReader<F>,
    /// Those that are read, by their place among the flat ones.
    columns: Vec<Option<Column>>,
    budget: Budget,
    /// The row group that comes next.
    next: usize,
    /// Whether there is one open.
    is_begun: bool,
}

impl<F: ChunkReader + 'static> Groups<F> {
    /// Opens the next row group; false where there is none.
    fn begin(&mut self) -> Result<bool> {
        if self.next >= self.reader.num_row_groups() {
            return Ok(false);
        }
        let metadata = self.reader.metadata().row_group(self.next);
        let group = self.reader.get_row_group(self.next).map_err(refused)?;
        for column in self.columns.iter_mut().flatten() {
            let held_bytes = sizes::check_chunk(&self.file, metadata.column(column.index), &self.budget)?;
            column.begin(group.get_column_reader(column.index).map_err(refused)?, held_bytes);
        }
        (self.next, self.is_begun) = (self.next + 1, true);
        Ok(true)
    }

    /// The next rows of the open row group, none at its end.
    fn read(&mut self, before: Vec<Option<Cells>>) -> Result<Vec<Option<Cells>>> {
        let before = before.into_iter().chain(std::iter::repeat_with(|| None));
        let work: Vec<_> = self.columns.iter_mut().zip(before).collect();
        let read = work.into_par_iter().map(|(column, before)| {
            let column = column.as_mut()?;
            Some(contained(DAMAGED, || column.read(before)))
        });
        let read: Vec<Option<Result<Cells>>> = read.collect();
        let cells: Vec<Option<Cells>> = read.into_iter().map(Option::transpose).collect::<Result<_>>()?;
        let mut lengths = cells.iter().flatten().map(Cells::len);
        let first = lengths.next().unwrap_or(0);
        if lengths.any(|length| length != first) {
            return Err(Error::new("the Parquet file is damaged: its columns are of unequal length"));
        }
        Ok(cells)
    }
}

impl<F: ChunkReader + 'static> Batches for Groups<F> {
    fn next(&mut self, mut before: Vec<Option<Cells>>) -> Result<Option<Vec<Option<Cells>>>> {
        loop {
            if !self.is_begun && !contained(DAMAGED, || self.begin())? {
                return Ok(None);
            }
            let cells = self.read(before)?;
            if cells.iter().flatten().any(|cells| cells.len() > 0) {
                return Ok(Some(cells));
            }
            (before, self.is_begun) = (cells, false);
        }
    }
}
