//! Arrow's arrays as the cells of a recording, meant as drift-sim's own readers of files mean them.

use datafusion::arrow::array::{Array, ArrayRef, AsArray};
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::{DataType, Float32Type, Float64Type, Int64Type, TimeUnit};
use datafusion::error::Result;
use drift_sim::recording::{Cells, DateUnit, Dates};

/// The cells of an array: numbers, dates and text; null is missing.
///
/// # Errors
/// The array holds something else: lists, structs, bytes.
pub fn cells(array: &ArrayRef) -> Result<Cells> {
    Ok(match array.data_type() {
        DataType::Null => Cells::Single(vec![f32::NAN; array.len()]),
        DataType::Float32 => {
            Cells::Single(array.as_primitive::<Float32Type>().iter().map(|x| x.unwrap_or(f32::NAN)).collect())
        }
        DataType::Timestamp(TimeUnit::Second, zone) => {
            let finer = cast(array, &DataType::Timestamp(TimeUnit::Millisecond, zone.clone()))?;
            dates(&finer, DateUnit::Milliseconds, zone.is_some())?
        }
        DataType::Timestamp(TimeUnit::Millisecond, zone) => {
            dates(array, DateUnit::Milliseconds, zone.is_some())?
        }
        DataType::Timestamp(TimeUnit::Microsecond, zone) => {
            dates(array, DateUnit::Microseconds, zone.is_some())?
        }
        DataType::Timestamp(TimeUnit::Nanosecond, zone) => {
            dates(array, DateUnit::Nanoseconds, zone.is_some())?
        }
        DataType::Date32 | DataType::Date64 => {
            let days = cast(&cast(array, &DataType::Date32)?, &DataType::Int32)?;
            dates(&days, DateUnit::Days, false)?
        }
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => text(array)?,
        DataType::Dictionary(_, of)
            if matches!(**of, DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View) =>
        {
            text(array)?
        }
        _ => {
            let numbers = cast(array, &DataType::Float64)?;
            let numbers = numbers.as_primitive::<Float64Type>();
            if numbers.null_count() == 0 {
                Cells::Double(numbers.values().to_vec())
            } else {
                Cells::Double(numbers.iter().map(|x| x.unwrap_or(f64::NAN)).collect())
            }
        }
    })
}

fn dates(array: &ArrayRef, unit: DateUnit, is_utc: bool) -> Result<Cells> {
    let counts = cast(array, &DataType::Int64)?;
    let since_1970 = counts.as_primitive::<Int64Type>().iter().collect();
    Ok(Cells::Dates(Dates { since_1970, unit, is_utc }))
}

fn text(array: &ArrayRef) -> Result<Cells> {
    let text = cast(array, &DataType::Utf8)?;
    Ok(Cells::Text(text.as_string::<i32>().iter().map(|x| x.map(str::to_owned)).collect()))
}

/// The name of the loop that these rows belong to.
///
/// # Errors
/// They have none.
pub fn loop_name(names: &ArrayRef) -> Result<String> {
    let name = text_at(names, 0)?;
    if name.is_empty() {
        return Err(crate::to_engine(
            drift_sim::Error::new("rows that name no loop").allowed("a name in every row of --loop-column"),
        ));
    }
    Ok(name)
}

/// The text in a row, whatever the array's type; empty where there is none.
///
/// # Errors
/// It can't be written as text.
pub fn text_at(array: &ArrayRef, row: usize) -> Result<String> {
    let one = cast(&array.slice(row, 1), &DataType::Utf8)?;
    let one = one.as_string::<i32>();
    Ok(if one.is_valid(0) { one.value(0).to_owned() } else { String::new() })
}
