//! One column while it is read, a batch at a time.

use ::parquet::basic::{LogicalType, TimeUnit, Type};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::{ByteArray, DataType, DoubleType, Int96};
use ::parquet::schema::types::ColumnDescriptor;

use super::refused;
use crate::recording::budget::Budget;
use crate::recording::dates::{DateUnit, Dates};
use crate::recording::table::Cells;
use crate::{Error, Result};

/// Rows of a batch: what a column takes of it stays in the processor's cache.
const BATCH_ROWS: usize = 1 << 14;

/// A column of a file that is read.
pub(super) struct Column {
    /// Its place among the file's columns.
    pub index: usize,
    /// Nulls are where the definition level is lower.
    max_level: i16,
    meaning: Meaning,
    budget: Budget,
    /// Its values in the current row group.
    values: Option<ColumnReader>,
    /// What the budget is owed for them.
    held_bytes: u64,
    /// The same for the texts of the batch before.
    text_bytes: u64,
}

/// What a stored value means.
#[derive(Debug, Clone, Copy)]
enum Meaning {
    Number,
    Unsigned,
    /// So many to one.
    Decimal(f64),
    /// A date, and whether it is a point in time or what a clock showed.
    Date(DateUnit, bool),
    Single,
    Text,
}

impl Column {
    pub fn new(index: usize, descriptor: &ColumnDescriptor, budget: &Budget) -> Self {
        let meaning = Meaning::of(descriptor);
        let (max_level, budget) = (descriptor.max_def_level(), budget.clone());
        Self { index, max_level, meaning, budget, values: None, held_bytes: 0, text_bytes: 0 }
    }

    /// Goes on to the values of a row group, of which reading takes so many bytes.
    pub fn begin(&mut self, values: ColumnReader, held_bytes: u64) {
        self.budget.give_back(std::mem::replace(&mut self.held_bytes, held_bytes));
        self.values = Some(values);
    }

    /// The next rows of the row group; none at its end. `before` is the batch before, whose memory is used again.
    pub fn read(&mut self, before: Option<Cells>) -> Result<Cells> {
        self.budget.give_back(std::mem::take(&mut self.text_bytes));
        let mut cells = match before {
            Some(cells) => cells,
            None => self.meaning.cells(&self.budget)?,
        };
        cells.clear();
        let Some(values) = &mut self.values else { return Ok(cells) };
        let (level, meaning) = (self.max_level, self.meaning);
        match (values, &mut cells) {
            (ColumnReader::BoolColumnReader(r), Cells::Double(into)) => {
                let number = |x: &bool| f64::from(u8::from(*x));
                each(r, level, |x| into.push(x.map_or(f64::NAN, number)))
            }
            (ColumnReader::Int32ColumnReader(r), Cells::Double(into)) => {
                each(r, level, |x| into.push(x.map_or(f64::NAN, |x| meaning.number_32(*x))))
            }
            (ColumnReader::Int64ColumnReader(r), Cells::Double(into)) => {
                each(r, level, |x| into.push(x.map_or(f64::NAN, |x| meaning.number(*x))))
            }
            (ColumnReader::FloatColumnReader(r), Cells::Single(into)) => {
                each(r, level, |x| into.push(x.copied().unwrap_or(f32::NAN)))
            }
            (ColumnReader::DoubleColumnReader(r), Cells::Double(into)) => doubles(r, level, into),
            (ColumnReader::Int32ColumnReader(r), Cells::Dates(into)) => {
                each(r, level, |x| into.since_1970.push(x.map(|x| i64::from(*x))))
            }
            (ColumnReader::Int64ColumnReader(r), Cells::Dates(into)) => {
                each(r, level, |x| into.since_1970.push(x.copied()))
            }
            (ColumnReader::Int96ColumnReader(r), Cells::Dates(into)) => {
                each(r, level, |x| into.since_1970.push(x.map(Int96::to_nanos)))
            }
            (ColumnReader::ByteArrayColumnReader(r), Cells::Text(into)) => {
                let text = |x: &ByteArray| String::from_utf8_lossy(x.data()).into_owned();
                each(r, level, |x| into.push(x.map(text)))?;
                let bytes = into.iter().flatten().map(|text| text.capacity() as u64).sum();
                self.budget.take(bytes)?;
                self.text_bytes = bytes;
                Ok(())
            }
            // Bytes of a fixed length are no signal; they count as text that is missing.
            (ColumnReader::FixedLenByteArrayColumnReader(r), Cells::Text(into)) => {
                each(r, level, |_| into.push(None))
            }
            _ => Err(Error::new("the Parquet file is damaged: a column changes its type")),
        }?;
        Ok(cells)
    }
}

/// Every value of the next rows, `None` for null.
fn each<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    max_level: i16,
    mut take: impl FnMut(Option<&T::T>),
) -> Result<()> {
    let (mut levels, mut values) = (Vec::new(), Vec::with_capacity(BATCH_ROWS));
    reader.read_records(BATCH_ROWS, Some(&mut levels), None, &mut values).map_err(refused)?;
    if max_level == 0 || values.len() == levels.len() {
        values.iter().for_each(|value| take(Some(value)));
    } else {
        let mut values = values.iter();
        levels.iter().for_each(|level| take(if *level == max_level { values.next() } else { None }));
    }
    Ok(())
}

/// The next numbers, NaN for null. They are read to where they stay; nulls move them to their places afterwards.
fn doubles(reader: &mut ColumnReaderImpl<DoubleType>, max_level: i16, into: &mut Vec<f64>) -> Result<()> {
    let mut levels = Vec::with_capacity(if max_level > 0 { BATCH_ROWS } else { 0 });
    reader.read_records(BATCH_ROWS, Some(&mut levels), None, into).map_err(refused)?;
    let mut from = into.len();
    if max_level == 0 || from == levels.len() {
        return Ok(());
    }
    into.resize(levels.len(), f64::NAN);
    for (at, level) in levels.iter().enumerate().rev() {
        let is_there = *level == max_level && from > 0;
        from -= usize::from(is_there);
        let value = if is_there { into.get(from).copied() } else { None };
        if let Some(place) = into.get_mut(at) {
            *place = value.unwrap_or(f64::NAN);
        }
    }
    Ok(())
}

impl Meaning {
    fn of(descriptor: &ColumnDescriptor) -> Self {
        match (descriptor.physical_type(), descriptor.logical_type_ref()) {
            (Type::FLOAT, _) => Self::Single,
            (Type::INT96, _) => Self::Date(DateUnit::Nanoseconds, false),
            (Type::BYTE_ARRAY | Type::FIXED_LEN_BYTE_ARRAY, _) => Self::Text,
            (_, Some(LogicalType::Timestamp(stamp))) => {
                let unit = match stamp.unit {
                    TimeUnit::MILLIS => DateUnit::Milliseconds,
                    TimeUnit::MICROS => DateUnit::Microseconds,
                    TimeUnit::NANOS => DateUnit::Nanoseconds,
                };
                Self::Date(unit, stamp.is_adjusted_to_u_t_c)
            }
            (_, Some(LogicalType::Date)) => Self::Date(DateUnit::Days, false),
            (_, Some(LogicalType::Decimal(decimal))) => {
                Self::Decimal(libm::pow(10.0, f64::from(decimal.scale)))
            }
            (_, Some(LogicalType::Integer(integer))) if !integer.is_signed => Self::Unsigned,
            _ => Self::Number,
        }
    }

    /// Room for a batch.
    fn cells(self, budget: &Budget) -> Result<Cells> {
        fn room<T>(budget: &Budget) -> Result<Vec<T>> {
            budget.take((BATCH_ROWS * size_of::<T>()) as u64)?;
            Ok(Vec::with_capacity(BATCH_ROWS))
        }
        Ok(match self {
            Self::Number | Self::Unsigned | Self::Decimal(_) => Cells::Double(room(budget)?),
            Self::Single => Cells::Single(room(budget)?),
            Self::Text => Cells::Text(room(budget)?),
            Self::Date(unit, is_utc) => Cells::Dates(Dates { since_1970: room(budget)?, unit, is_utc }),
        })
    }

    fn number(self, stored: i64) -> f64 {
        match self {
            Self::Unsigned => stored.cast_unsigned() as f64,
            Self::Decimal(to_one) => stored as f64 / to_one,
            _ => stored as f64,
        }
    }

    fn number_32(self, stored: i32) -> f64 {
        match self {
            Self::Unsigned => f64::from(stored.cast_unsigned()),
            _ => self.number(i64::from(stored)),
        }
    }
}
