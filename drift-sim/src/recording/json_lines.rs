//! JSON lines (jsonlines.org): one object a line, `{"t": 0.1, "r": 1, "y": 0.98, "u": 3.2}`. The names are those of the
//! first objects; a value within an object or a list is a column `loop.y` or `y[0]`. What an object lacks is missing. A list
//! of objects over the whole file is read as well, however its lines are broken; a file that is one object is one of columns
//! ([`json_columns`]).

use std::collections::HashMap;
use std::io::{BufReader, Cursor, Read};

use serde_json::Value;

use super::cell_kind::FirstRows;
use super::decimal::DecimalMark;
use super::format::Source;
use super::json_columns;
use super::json_objects::Objects;
use super::long_table::LongTable;
use super::records::{Record, Records};
use super::row::{Rows, excerpt};
use super::text_rows::{Header, TextRows};
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// Objects that the names are taken from: signals may come at rates of their own.
const NAMING_OBJECTS: usize = 100;
/// Columns, at most.
const COLUMNS_MAX: usize = 10_000;
/// What is looked at to see whether the objects stand in a list.
const START_BYTES: u64 = 1 << 12;
/// Whether a text begins like one: with an object, on one line or cut off.
pub(super) fn is_json_lines(start: &[u8]) -> bool {
    let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start).trim_ascii_start();
    let text = text.strip_prefix(b"[").map_or(text, <[u8]>::trim_ascii_start);
    let inside = text.strip_prefix(b"{").map(<[u8]>::trim_ascii_start);
    inside.is_some_and(|inside| inside.starts_with(b"\"") || inside.starts_with(b"}"))
}

/// The rows of a text that begins so.
///
/// # Errors
/// A line is no object, or lacks a column.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<(Box<dyn Rows>, &'static str)> {
    let mut start = Vec::new();
    let mut reader = source.reader;
    let refused = |e: std::io::Error| Error::new(format!("can't be read: {e}"));
    reader.by_ref().take(START_BYTES).read_to_end(&mut start).map_err(refused)?;
    let is_list = start.iter().find(|byte| b"{[".contains(byte)) == Some(&b'[');
    let mut reader = BufReader::new(Cursor::new(start).chain(reader));
    let mut first = Vec::new();
    if !is_list {
        let beginning = json_columns::begin(&mut reader, &source.budget)?;
        if beginning.is_whole && is_document(&beginning.text) {
            let rows = json_columns::rows(&beginning.text, &source.budget, options)?;
            return Ok((Box::new(rows), "JSON"));
        }
        first = beginning.text;
    }
    let mut objects = Objects::of(Box::new(Cursor::new(first).chain(reader)), is_list);
    // A broken object is told when its turn comes.
    let first = objects.look(NAMING_OBJECTS)?;
    let first: Vec<Value> = first.filter_map(|(text, line)| object(text, line).ok().flatten()).collect();
    let (mut names, mut places) = (Vec::new(), HashMap::new());
    for value in &first {
        visit(value, "", &mut |name, _| {
            if !places.contains_key(name) && names.len() < COLUMNS_MAX {
                places.insert(name.to_owned(), names.len());
                names.push(name.to_owned());
            }
        });
    }
    let mut cells = vec![String::new(); names.len()];
    let rows: Vec<Vec<String>> = first
        .iter()
        .map(|object| {
            write_cells(object, &places, &mut cells);
            cells.clone()
        })
        .collect();
    let first_rows = FirstRows::of(rows);
    let records = JsonRecords { objects, places, cells };
    let header = Header { names, units: Vec::new(), first_rows, mark: DecimalMark::Point };
    match LongTable::of(&header, options) {
        Some(long) => Ok((Box::new(long.rows(records, header, options, &source.budget)?), FORMAT)),
        None => Ok((Box::new(TextRows::new(records, header, options)?), FORMAT)),
    }
}

/// What the format is called.
const FORMAT: &str = "JSON lines";

/// Whether one object is a file of columns, and not a file of lines that has one line so far: it holds others, or a list.
fn is_document(text: &[u8]) -> bool {
    let inside = text.iter().skip_while(|byte| **byte != b'{').skip(1);
    inside.into_iter().any(|byte| b"{[".contains(byte))
}

/// The values of an object, each in the cell of its name.
fn write_cells(object: &Value, places: &HashMap<String, usize>, cells: &mut [String]) {
    cells.iter_mut().for_each(String::clear);
    visit(object, "", &mut |name, value| {
        if let Some(cell) = places.get(name).and_then(|place| cells.get_mut(*place)) {
            write_cell(cell, value);
        }
    });
}

/// Objects, one after the other.
struct JsonRecords {
    objects: Objects,
    places: HashMap<String, usize>,
    cells: Vec<String>,
}

impl Records for JsonRecords {
    fn next(&mut self, record: &mut Record, quality: &mut Quality) -> Result<Option<u64>> {
        loop {
            let Some((text, line)) = self.objects.next()? else { return Ok(None) };
            let value = match object(&text, line) {
                Ok(Some(value)) => value,
                Ok(None) => {
                    quality.blank_lines += 1;
                    continue;
                }
                Err(error) => {
                    record.set_broken(error);
                    return Ok(Some(line));
                }
            };
            write_cells(&value, &self.places, &mut self.cells);
            record.clear();
            self.cells.iter().for_each(|cell| record.push(cell.as_bytes()));
            return Ok(Some(line));
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

/// The object of a line; `None` where the line is empty.
fn object(line: &[u8], number: u64) -> Result<Option<Value>> {
    let text = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line).trim_ascii();
    if text.is_empty() {
        return Ok(None);
    }
    match serde_json::from_slice::<Value>(text) {
        Ok(value @ Value::Object(_)) => Ok(Some(value)),
        Ok(_) => Err(open_error("no object").at_line(number)),
        Err(e) => {
            let what = format!("no JSON: '{}': {e}", excerpt(&String::from_utf8_lossy(text)));
            Err(open_error(&what).at_line(number))
        }
    }
}

/// What is wrong, with what is allowed.
pub(super) fn open_error(what: &str) -> Error {
    Error::new(what).allowed("one JSON object on each line, or a list of objects")
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
