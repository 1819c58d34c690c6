//! Parquet files: flat columns of numbers, flags, text and time stamps. Only the columns that are read are unpacked.

mod sizes;

use std::sync::Arc;

use ::parquet::basic::{LogicalType, TimeUnit};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::{ByteArray, DataType, Int96};
use ::parquet::file::reader::{ChunkReader, FileReader, Length, RowGroupReader, SerializedFileReader};
use ::parquet::schema::types::ColumnDescriptor;
use bytes::Bytes;
use jiff::Timestamp;
use jiff::tz::TimeZone;

use super::ReadOptions;
use super::budget::Budget;
use super::choice::Choice;
use super::contained::contained;
use super::format::Source;
use super::table::{Cells, TableRows};
use crate::{Error, Result};

const DAMAGED: &str = "the Parquet file is cut off or damaged";
/// Records unpacked at a time: a broken file can't ask for more memory than it has bytes to fill it.
const BATCH: usize = 1 << 14;
/// Rows of a file, at most.
const ROWS_MAX: i64 = 1 << 31;

/// The rows of a file that begins like one.
///
/// # Errors
/// The file is damaged or encrypted, has nested columns where signals belong, lacks a column, or takes more memory than
/// is allowed.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<TableRows> {
    let budget = source.budget.clone();
    match source.file.as_ref().and_then(|file| file.try_clone().ok()) {
        Some(file) => contained(DAMAGED, || unpack(file, &budget, options)),
        None => {
            let bytes = Bytes::from(source.bytes()?);
            contained(DAMAGED, || unpack(bytes, &budget, options))
        }
    }
}

fn unpack(file: impl ChunkReader + 'static, budget: &Budget, options: &ReadOptions) -> Result<TableRows> {
    let file = Arc::new(file);
    sizes::check_footer(file.as_ref(), budget)?;
    let reader = SerializedFileReader::new(Shared(Arc::clone(&file))).map_err(refused)?;
    let metadata = reader.metadata();
    let rows = metadata.file_metadata().num_rows();
    if !(0..=ROWS_MAX).contains(&rows) {
        return Err(Error::new(format!("the Parquet file says it has {rows} rows")).allowed("up to 2^31"));
    }
    let schema = metadata.file_metadata().schema_descr();
    // A nested or repeated column has another number of values than the file has rows.
    let flat: Vec<usize> =
        (0..schema.num_columns()).filter(|i| schema.column(*i).max_rep_level() == 0).collect();
    let names: Vec<String> = flat.iter().map(|i| schema.column(*i).path().parts().join(".")).collect();
    let used = Choice::of(&names, options)?.uses(names.len());
    let mut columns = Vec::with_capacity(names.len());
    for ((index, name), is_used) in flat.into_iter().zip(names).zip(used) {
        let mut column = Column::of(&schema.column(index), budget);
        if is_used {
            for group in 0..reader.num_row_groups() {
                let chunk = metadata.row_group(group).column(index);
                let held = sizes::check_chunk(file.as_ref(), chunk, budget)?;
                let group = reader.get_row_group(group).map_err(refused)?;
                column.read(group.as_ref(), index)?;
                budget.give_back(held);
            }
        }
        columns.push((name, column.cells));
    }
    TableRows::new(columns, Vec::new(), options)
}

/// One file for the library and for [`sizes`].
struct Shared<F>(Arc<F>);

impl<F: ChunkReader> Length for Shared<F> {
    fn len(&self) -> u64 {
        self.0.len()
    }
}

impl<F: ChunkReader> ChunkReader for Shared<F> {
    type T = F::T;

    fn get_read(&self, start: u64) -> ::parquet::errors::Result<Self::T> {
        self.0.get_read(start)
    }

    fn get_bytes(&self, start: u64, length: usize) -> ::parquet::errors::Result<Bytes> {
        self.0.get_bytes(start, length)
    }
}

fn refused(error: ::parquet::errors::ParquetError) -> Error {
    Error::new(format!("the Parquet file is cut off or damaged: {error}"))
}

/// One column while it is read.
struct Column<'a> {
    budget: &'a Budget,
    /// Nulls are where the definition level is lower.
    max_level: i16,
    meaning: Meaning,
    cells: Cells,
}

/// What a stored integer means.
#[derive(Clone, Copy)]
enum Meaning {
    Number,
    Unsigned,
    /// Decimal places.
    Decimal(i32),
    /// Nanoseconds in one; whether it is a point in time or what a clock showed.
    Instant(i64, bool),
    Days,
}

impl<'a> Column<'a> {
    fn of(descriptor: &ColumnDescriptor, budget: &'a Budget) -> Self {
        let meaning = match descriptor.logical_type_ref() {
            Some(LogicalType::Timestamp(stamp)) => {
                let nanoseconds = match stamp.unit {
                    TimeUnit::MILLIS => 1_000_000,
                    TimeUnit::MICROS => 1_000,
                    TimeUnit::NANOS => 1,
                };
                Meaning::Instant(nanoseconds, stamp.is_adjusted_to_u_t_c)
            }
            Some(LogicalType::Date) => Meaning::Days,
            Some(LogicalType::Decimal(decimal)) => Meaning::Decimal(decimal.scale),
            Some(LogicalType::Integer(integer)) if !integer.is_signed => Meaning::Unsigned,
            _ => Meaning::Number,
        };
        let is_text = matches!(meaning, Meaning::Instant(..) | Meaning::Days);
        let cells = match descriptor.physical_type() {
            ::parquet::basic::Type::FLOAT => Cells::Single(Vec::new()),
            ::parquet::basic::Type::BYTE_ARRAY
            | ::parquet::basic::Type::FIXED_LEN_BYTE_ARRAY
            | ::parquet::basic::Type::INT96 => Cells::Text(Vec::new()),
            _ if is_text => Cells::Text(Vec::new()),
            _ => Cells::Double(Vec::new()),
        };
        Self { budget, max_level: descriptor.max_def_level(), meaning, cells }
    }

    fn read(&mut self, group: &dyn RowGroupReader, index: usize) -> Result<()> {
        let budget = self.budget;
        let (max_level, meaning) = (self.max_level, self.meaning);
        let text = move |ticks: i64| meaning.date(ticks);
        match (group.get_column_reader(index).map_err(refused)?, &mut self.cells) {
            (ColumnReader::BoolColumnReader(r), Cells::Double(into)) => {
                each(r, max_level, |x| budget.push(into, x.map_or(f64::NAN, |x| f64::from(u8::from(*x)))))
            }
            (ColumnReader::Int32ColumnReader(r), Cells::Double(into)) => {
                let value = |x: &i32| match meaning {
                    Meaning::Unsigned => f64::from(x.cast_unsigned()),
                    _ => meaning.number(i64::from(*x)),
                };
                each(r, max_level, |x| budget.push(into, x.map_or(f64::NAN, value)))
            }
            (ColumnReader::Int64ColumnReader(r), Cells::Double(into)) => {
                each(r, max_level, |x| budget.push(into, x.map_or(f64::NAN, |x| meaning.number(*x))))
            }
            (ColumnReader::FloatColumnReader(r), Cells::Single(into)) => {
                each(r, max_level, |x| budget.push(into, x.copied().unwrap_or(f32::NAN)))
            }
            (ColumnReader::DoubleColumnReader(r), Cells::Double(into)) => {
                each(r, max_level, |x| budget.push(into, x.copied().unwrap_or(f64::NAN)))
            }
            (ColumnReader::Int32ColumnReader(r), Cells::Text(into)) => {
                each(r, max_level, |x| push_text(budget, into, x.and_then(|x| text(i64::from(*x)))))
            }
            (ColumnReader::Int64ColumnReader(r), Cells::Text(into)) => {
                each(r, max_level, |x| push_text(budget, into, x.and_then(|x| text(*x))))
            }
            (ColumnReader::Int96ColumnReader(r), Cells::Text(into)) => {
                let text = |x: &Int96| Meaning::Instant(1, false).date(x.to_nanos());
                each(r, max_level, |x| push_text(budget, into, x.and_then(text)))
            }
            (ColumnReader::ByteArrayColumnReader(r), Cells::Text(into)) => {
                let text = |x: &ByteArray| String::from_utf8_lossy(x.data()).into_owned();
                each(r, max_level, |x| push_text(budget, into, x.map(text)))
            }
            // Bytes of a fixed length are no signal; they count as text that is missing.
            (ColumnReader::FixedLenByteArrayColumnReader(r), Cells::Text(into)) => {
                each(r, max_level, |_| budget.push(into, None))
            }
            _ => Err(Error::new("the Parquet file is damaged: a column changes its type")),
        }
    }
}

/// Every value of a column chunk, `None` for null.
fn each<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    max_level: i16,
    mut take: impl FnMut(Option<&T::T>) -> Result<()>,
) -> Result<()> {
    loop {
        let (mut levels, mut values) = (Vec::new(), Vec::new());
        let (records, _, _) =
            reader.read_records(BATCH, Some(&mut levels), None, &mut values).map_err(refused)?;
        if records == 0 {
            return Ok(());
        }
        let mut values = values.iter();
        if max_level == 0 {
            values.try_for_each(|value| take(Some(value)))?;
        } else {
            levels
                .iter()
                .try_for_each(|level| take(if *level == max_level { values.next() } else { None }))?;
        }
    }
}

/// Adds a text, and counts its letters.
fn push_text(budget: &Budget, into: &mut Vec<Option<String>>, text: Option<String>) -> Result<()> {
    budget.take(text.as_ref().map_or(0, String::capacity) as u64)?;
    budget.push(into, text)
}

impl Meaning {
    fn number(self, stored: i64) -> f64 {
        match self {
            Self::Unsigned => stored.cast_unsigned() as f64,
            Self::Decimal(scale) => stored as f64 / libm::pow(10.0, f64::from(scale)),
            _ => stored as f64,
        }
    }

    /// As text, which the clock of a time column reads.
    fn date(self, stored: i64) -> Option<String> {
        let (nanoseconds, is_utc) = match self {
            Self::Instant(unit, is_utc) => (i128::from(stored) * i128::from(unit), is_utc),
            Self::Days => (i128::from(stored) * 86_400_000_000_000, false),
            _ => return None,
        };
        let at = Timestamp::from_nanosecond(nanoseconds).ok()?;
        Some(if is_utc { at.to_string() } else { TimeZone::UTC.to_datetime(at).to_string() })
    }
}
