//! JSON lines (jsonlines.org): one object a line, `{"t": 0.1, "r": 1, "y": 0.98, "u": 3.2}`. The names are those of the
//! first objects; a value within an object or a list is a column `loop.y` or `y[0]`. What an object lacks is missing.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Cursor, Read};

use serde_json::Value;

use super::decimal::DecimalMark;
use super::records::{Record, Records};
use super::row::excerpt;
use super::text_rows::{Header, TextRows};
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// A line longer than this is no record.
const LINE_BYTES_MAX: u64 = 1 << 20;
/// Objects that the names are taken from: signals may come at rates of their own.
const NAMING_LINES: usize = 100;
/// Columns, at most.
const COLUMNS_MAX: usize = 10_000;
/// Bytes asked of the system at a time.
const BUFFER_BYTES: usize = 1 << 18;

/// Whether a text begins like one: with an object, on one line or cut off.
pub(super) fn is_json_lines(start: &[u8]) -> bool {
    let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start).trim_ascii_start();
    let inside = text.strip_prefix(b"{").map(<[u8]>::trim_ascii_start);
    inside.is_some_and(|inside| inside.starts_with(b"\"") || inside.starts_with(b"}"))
}

/// The rows of a text that begins so.
///
/// # Errors
/// A line is no object, or lacks a column.
pub(super) fn open(source: Box<dyn Read + Send>, options: &ReadOptions) -> Result<TextRows<JsonRecords>> {
    let mut source = BufReader::with_capacity(BUFFER_BYTES, source);
    let (mut head, mut names, mut places) = (Vec::new(), Vec::new(), HashMap::new());
    for number in 1..=NAMING_LINES {
        let Some(line) = next_line(&mut source, number as u64)? else { break };
        // A broken line is told when its turn comes.
        if let Ok(Some(value)) = object(&line, number as u64) {
            visit(&value, "", &mut |name, _| {
                if !places.contains_key(name) && names.len() < COLUMNS_MAX {
                    places.insert(name.to_owned(), names.len());
                    names.push(name.to_owned());
                }
            });
        }
        head.extend(line);
    }
    let source = Box::new(BufReader::with_capacity(BUFFER_BYTES, Cursor::new(head).chain(source)));
    let cells = vec![String::new(); names.len()];
    let records = JsonRecords { source, places, cells, line: 0 };
    TextRows::new(records, Header { names, units: Vec::new(), mark: DecimalMark::Point }, options)
}

/// Objects, one after the other.
pub(super) struct JsonRecords {
    source: Box<dyn BufRead + Send>,
    places: HashMap<String, usize>,
    cells: Vec<String>,
    line: u64,
}

impl Records for JsonRecords {
    fn next(&mut self, record: &mut Record, quality: &mut Quality) -> Result<Option<u64>> {
        loop {
            let Some(line) = next_line(&mut self.source, self.line + 1)? else { return Ok(None) };
            self.line += 1;
            let Some(value) = object(&line, self.line)? else {
                quality.blank_lines += 1;
                continue;
            };
            self.cells.iter_mut().for_each(String::clear);
            let (places, cells) = (&self.places, &mut self.cells);
            visit(&value, "", &mut |name, value| {
                if let Some(cell) = places.get(name).and_then(|place| cells.get_mut(*place)) {
                    write_cell(cell, value);
                }
            });
            record.clear();
            self.cells.iter().for_each(|cell| record.push(cell.as_bytes()));
            return Ok(Some(self.line));
        }
    }
}

fn write_cell(cell: &mut String, value: &Value) {
    match value {
        Value::Null => {}
        Value::Bool(switch) => cell.push(if *switch { '1' } else { '0' }),
        Value::String(text) => cell.push_str(text),
        other => cell.push_str(&other.to_string()),
    }
}

/// The next line with its end; `None` behind the last.
fn next_line(source: &mut impl BufRead, number: u64) -> Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    let read = source.by_ref().take(LINE_BYTES_MAX + 1).read_until(b'\n', &mut line);
    read.map_err(|e| Error::new(format!("can't be read: {e}")).at_line(number))?;
    if line.len() as u64 > LINE_BYTES_MAX {
        return Err(Error::new("a line of more than 1 MiB").at_line(number));
    }
    Ok((!line.is_empty()).then_some(line))
}

/// The object of a line; `None` where the line is empty.
fn object(line: &[u8], number: u64) -> Result<Option<Value>> {
    let text = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line).trim_ascii();
    if text.is_empty() {
        return Ok(None);
    }
    match serde_json::from_slice::<Value>(text) {
        Ok(value @ Value::Object(_)) => Ok(Some(value)),
        Ok(_) => Err(Error::new("no object").allowed("one JSON object on each line").at_line(number)),
        Err(e) => {
            let what = format!("no JSON: '{}': {e}", excerpt(&String::from_utf8_lossy(text)));
            Err(Error::new(what).allowed("one object on each line").at_line(number))
        }
    }
}

/// Every value that holds no others, with its name.
pub(super) fn visit(value: &Value, name: &str, tell: &mut dyn FnMut(&str, &Value)) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                visit(value, &name, tell);
            }
        }
        Value::Array(values) => {
            for (i, value) in values.iter().enumerate() {
                visit(value, &format!("{name}[{i}]"), tell);
            }
        }
        other => tell(name, other),
    }
}
