//! A JSON file that is one object: its lists are columns, `{"t": [0, 1], "r": [5, 5]}`, as pandas writes them with `to_json`, by
//! column and row (`{"t": {"0": 0, "1": 1}}`) or as `columns` and `data`.

use std::io::{BufRead, BufReader, Read};

use serde_json::{Map, Value};

use super::ReadOptions;
use super::budget::Budget;
use super::json_objects::Scan;
use super::row::excerpt;
use super::table::{Cells, TableRows};
use crate::{Error, Result};

/// What a value takes in memory beside its text, for each byte of it at most: `1,` is one of 32 bytes.
const BYTES_A_BYTE: u64 = 16;
/// A list this short is no column.
const ROWS_MIN: usize = 2;

/// The beginning of a text: its first object, or all of it where that does not end; and whether nothing else follows.
pub(super) struct Beginning {
    /// What was read.
    pub text: Vec<u8>,
    /// Whether the text is one object and nothing else.
    pub is_whole: bool,
}

/// Reads up to the end of the first object.
///
/// # Errors
/// The source can't be read, or the object is larger than the budget.
pub(super) fn begin(source: &mut BufReader<impl Read>, budget: &Budget) -> Result<Beginning> {
    let (mut text, mut scan, mut is_closed) = (Vec::new(), Scan::default(), false);
    loop {
        let buffer = source.fill_buf().map_err(|e| Error::new(format!("can't be read: {e}")))?;
        if buffer.is_empty() {
            return Ok(Beginning { text, is_whole: is_closed });
        }
        let mut used = 0;
        for byte in buffer {
            used += 1;
            if is_closed && !byte.is_ascii_whitespace() {
                text.push(*byte);
                source.consume(used);
                return Ok(Beginning { text, is_whole: false });
            }
            budget.push(&mut text, *byte)?;
            if !is_closed {
                scan.pass(*byte);
                is_closed = scan.is_closed();
            }
        }
        source.consume(used);
    }
}

/// The rows of a text that is one object.
///
/// # Errors
/// It is no JSON, holds no lists, or lacks a column.
pub(super) fn rows(text: &[u8], budget: &Budget, options: &ReadOptions) -> Result<TableRows> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    budget.take(text.len() as u64 * BYTES_A_BYTE)?;
    let value: Value = serde_json::from_slice(text)
        .map_err(|e| Error::new(format!("no JSON: {e}")).at_line(e.line() as u64))?;
    let mut columns = Vec::new();
    if let Some(schema) =
        value.get("schema").and_then(Value::as_str).filter(|schema| schema.starts_with("drift."))
    {
        return Err(Error::new(format!("this is a result of drift ({}), no recording", excerpt(schema)))
            .allowed("the recording that it was made from"));
    }
    collect(&value, "", &mut columns);
    if columns.is_empty() {
        let keys: Vec<&str> = value.as_object().into_iter().flat_map(Map::keys).map(String::as_str).collect();
        let what = format!(
            "this is one JSON object without lists of values; its keys are {}",
            excerpt(&keys.join(", "))
        );
        return Err(
            Error::new(what).allowed("{\"t\": [0, 1], \"r\": [5, 5], ...}, or one object on each line")
        );
    }
    TableRows::new(columns, Vec::new(), options)
}

/// Every list of values, with its name.
fn collect(value: &Value, name: &str, columns: &mut Vec<(String, Cells)>) {
    let mut add = |name: String, values: &[&Value]| {
        if values.len() >= ROWS_MIN && values.iter().all(|value| is_scalar(value)) {
            columns.push((name, cells(values)));
        }
    };
    match value {
        Value::Array(values) => add(name.to_owned(), &values.iter().collect::<Vec<_>>()),
        Value::Object(fields) => {
            if let Some(split) = split(fields) {
                split.into_iter().for_each(|(name, values)| add(name, &values));
            } else if let Some(values) = by_row(fields) {
                add(name.to_owned(), &values);
            } else {
                for (key, value) in fields {
                    let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                    collect(value, &name, columns);
                }
            }
        }
        _ => {}
    }
}

fn is_scalar(value: &Value) -> bool {
    !matches!(value, Value::Array(_) | Value::Object(_))
}

/// The values of an object whose keys are the numbers of rows, in their order.
fn by_row(fields: &Map<String, Value>) -> Option<Vec<&Value>> {
    let numbered = fields.iter().map(|(key, value)| Some((key.parse::<u64>().ok()?, value)));
    let mut rows = numbered.collect::<Option<Vec<_>>>()?;
    rows.sort_by_key(|(number, _)| *number);
    Some(rows.into_iter().map(|(_, value)| value).collect())
}

/// The columns of `{"columns": ["t", "r"], "data": [[0, 5], [1, 5]]}`.
fn split(fields: &Map<String, Value>) -> Option<Vec<(String, Vec<&Value>)>> {
    let names = fields.get("columns")?.as_array()?;
    let rows = fields.get("data")?.as_array()?;
    let rows = rows.iter().map(Value::as_array).collect::<Option<Vec<_>>>()?;
    let column = |(place, name): (usize, &Value)| {
        Some((
            name.as_str()?.to_owned(),
            rows.iter().map(|row| row.get(place).unwrap_or(&Value::Null)).collect(),
        ))
    };
    names.iter().enumerate().map(column).collect()
}

/// Numbers, where there is nothing else; null is missing.
fn cells(values: &[&Value]) -> Cells {
    let number = |value: &&Value| match value {
        Value::Null => Some(f64::NAN),
        Value::Bool(switch) => Some(f64::from(u8::from(*switch))),
        other => other.as_f64(),
    };
    if let Some(numbers) = values.iter().map(number).collect() {
        return Cells::Double(numbers);
    }
    let text = |value: &&Value| match value {
        Value::Null => None,
        Value::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    };
    Cells::Text(values.iter().map(text).collect())
}
