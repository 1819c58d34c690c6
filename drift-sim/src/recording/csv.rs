//! The CSV format: text in, rows of numbers out, each with the line it stands on.
//!
//! A header names the columns. Separators are commas, semicolons or tabs, whichever the header has most of; beside the
//! latter two numbers may have decimal commas. Lines end in LF or CRLF, fields may be quoted, a byte order mark, blank
//! lines and the `sep=;` of spreadsheets are passed over.

use std::io::{BufRead, BufReader, Read};

use ::csv::{ByteRecord, Reader, ReaderBuilder, Terminator};

use super::choice::Choice;
use super::clock::Clock;
use super::decimal::{DecimalMark, with_point};
use super::row::{Row, Rows, not_a_number};
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// Bytes asked of the system at a time.
const BUFFER_BYTES: usize = 1 << 18;
/// A row longer than this is a quote that never closes, or no recording.
const ROW_BYTES_MAX: usize = 1 << 20;

/// Reads rows one after the other; memory stays that of one row.
pub(super) struct CsvRows<R: Read> {
    reader: Reader<R>,
    record: ByteRecord,
    names: Vec<String>,
    choice: Choice,
    clock: Option<Clock>,
    mark: DecimalMark,
    /// Lines seen so far, to tell blank ones.
    last_line: u64,
}

/// Text whose last line ends like the others, so that the line behind a record is always one further.
pub(super) struct Ended<R> {
    source: R,
    last: u8,
}

impl<R: Read> Read for Ended<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.source.read(buffer)?;
        if let Some(last) = buffer[..count].last() {
            self.last = *last;
        } else if let Some(first) = buffer.first_mut().filter(|_| self.last != b'\n') {
            self.last = b'\n';
            *first = b'\n';
            return Ok(1);
        }
        Ok(count)
    }
}

/// Wraps a source that holds UTF-8 text, after a look at what it begins with.
pub(super) fn open<R: Read>(source: R, options: &ReadOptions) -> Result<CsvRows<Ended<BufReader<R>>>> {
    let refused = |e: std::io::Error| Error::new(format!("can't be read: {e}"));
    let mut source = BufReader::with_capacity(BUFFER_BYTES, source);
    let start = source.fill_buf().map_err(refused)?;
    if start.starts_with(&[0xff, 0xfe]) || start.starts_with(&[0xfe, 0xff]) {
        return Err(Error::new("the text is UTF-16").allowed("UTF-8"));
    }
    let mut lines = start.split(|b| *b == b'\n');
    let first = lines.find(|line| !line.trim_ascii().is_empty()).unwrap_or_default();
    let stated = stated_delimiter(first);
    let delimiter = stated.unwrap_or_else(|| likely_delimiter(first));
    CsvRows::new(Ended { source, last: b'\n' }, delimiter, stated.is_some(), options)
}

/// The separator that spreadsheets write on a line of its own before the header.
fn stated_delimiter(line: &[u8]) -> Option<u8> {
    let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
    match line.trim_ascii_end().strip_prefix(b"sep=")? {
        [delimiter @ (b',' | b';' | b'\t')] => Some(*delimiter),
        _ => None,
    }
}

/// The separator that the header has most of.
fn likely_delimiter(header: &[u8]) -> u8 {
    let count = |delimiter: u8| header.iter().filter(|b| **b == delimiter).count();
    // Of equally many the last is taken, which for none of them is the comma.
    [b'\t', b';', b','].into_iter().max_by_key(|d| count(*d)).unwrap_or(b',')
}

impl<R: Read> CsvRows<R> {
    fn new(source: R, delimiter: u8, is_stated: bool, options: &ReadOptions) -> Result<Self> {
        // Lines end at LF alone, so that a record never ends between CR and LF and its line is known; the CR goes
        // with the blanks around a cell.
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(delimiter)
            .terminator(Terminator::Any(b'\n'))
            .buffer_capacity(BUFFER_BYTES)
            .from_reader(source);
        let mut rows = Self {
            reader,
            record: ByteRecord::new(),
            names: Vec::new(),
            choice: Choice::default(),
            clock: None,
            mark: DecimalMark::beside(delimiter),
            last_line: 0,
        };
        if is_stated {
            rows.next_record(&mut Quality::default())?;
        }
        let Some(line) = rows.next_record(&mut Quality::default())? else {
            return Err(Error::new("the file is empty").allowed("a header and rows of numbers"));
        };
        rows.names =
            rows.record.iter().map(|n| String::from_utf8_lossy(n.trim_ascii()).into_owned()).collect();
        rows.find_columns(options).map_err(|e| e.at_line(line))?;
        Ok(rows)
    }

    fn find_columns(&mut self, options: &ReadOptions) -> Result<()> {
        if self.names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err(Error::new("the first line holds numbers").allowed("a header that names the columns"));
        }
        for (i, name) in self.names.iter().enumerate() {
            if !name.is_empty() && self.names[..i].contains(name) {
                return Err(Error::new(format!("two columns are called '{name}'")));
            }
        }
        self.choice = Choice::of(&self.names, options)?;
        self.clock = self.choice.t.map(|t| Clock::of(&self.names[t])).transpose()?;
        Ok(())
    }

    /// The next line that isn't blank, with its number.
    fn next_record(&mut self, quality: &mut Quality) -> Result<Option<u64>> {
        loop {
            let some = self.reader.read_byte_record(&mut self.record);
            let some = some.map_err(|e| {
                Error::new(format!("can't be read: {e}")).at_line(self.reader.position().line())
            })?;
            if !some {
                return Ok(None);
            }
            // The reader stands behind the line's end.
            let line = self.reader.position().line().saturating_sub(1);
            // The reader itself passes over empty lines; a field may hold line ends of its own.
            let passed = line.saturating_sub(self.last_line);
            if passed > 1 {
                quality.blank_lines += passed.saturating_sub(1 + self.line_ends_inside());
            }
            self.last_line = line;
            if self.record.as_slice().len() > ROW_BYTES_MAX {
                return Err(
                    Error::new("a row of more than 1 MiB, perhaps a quote that never closes").at_line(line)
                );
            }
            if self.record.as_slice().trim_ascii().is_empty() && self.record.len() <= 1 {
                quality.blank_lines += 1;
                continue;
            }
            return Ok(Some(line));
        }
    }

    fn line_ends_inside(&self) -> u64 {
        self.record.as_slice().iter().filter(|b| **b == b'\n').count() as u64
    }

    fn parse(&mut self, row: &mut Row, quality: &mut Quality, line: u64) -> Result<()> {
        let width = self.names.len();
        if self.record.len() != width {
            // Spreadsheets end rows in commas: more fields are harmless as long as they hold nothing.
            let more_is_empty = self.record.iter().skip(width).all(|cell| cell.trim_ascii().is_empty());
            if self.record.len() < width || !more_is_empty {
                let fields = plural(self.record.len(), "field");
                return Err(Error::new(format!("{fields} where the header has {width}")));
            }
        }
        row.line = line;
        if let (Some(t), Some(clock)) = (self.choice.t, &mut self.clock) {
            let cell = self.record.get(t).unwrap_or_default().trim_ascii();
            row.stamp = clock.read(cell, &mut self.mark)?;
        }
        row.r = self.number(self.choice.r, &mut quality.missing_r)?;
        row.y = self.number(self.choice.y, &mut quality.missing_y)?;
        row.u = self.number(self.choice.u, &mut quality.missing_u)?;
        row.manual = self.is_manual();
        row.extra.clear();
        for i in 0..self.choice.extra.len() {
            let value = self.extra_value(i)?;
            row.extra.push(value);
        }
        Ok(())
    }

    fn is_manual(&self) -> bool {
        self.choice.when.iter().any(|(index, when)| {
            let cell = self.cell(*index);
            !when.holds(self.mark.plain(cell).as_deref().unwrap_or(cell))
        })
    }

    /// The value of a further column; text that nobody asked for makes the whole column one of text.
    fn extra_value(&mut self, i: usize) -> Result<f64> {
        let extra = &mut self.choice.extra[i];
        if extra.text {
            return Ok(f64::NAN);
        }
        let cell = self.record.get(extra.index).unwrap_or_default().trim_ascii();
        match self.mark.number(cell) {
            Ok(Some(value)) => Ok(value),
            _ if !extra.asked_for => {
                extra.text = true;
                Ok(f64::NAN)
            }
            Ok(None) => Err(not_a_number(cell, &self.names[extra.index])),
            Err(error) => Err(error),
        }
    }

    fn cell(&self, index: usize) -> &[u8] {
        self.record.get(index).unwrap_or_default().trim_ascii()
    }

    fn number(&mut self, index: usize, missing: &mut u64) -> Result<f64> {
        let cell = self.record.get(index).unwrap_or_default().trim_ascii();
        let number = self.mark.number(cell)?.ok_or_else(|| {
            let error = not_a_number(cell, &self.names[index]);
            if with_point(cell).is_some() { error.allowed("a decimal point") } else { error }
        })?;
        *missing += u64::from(number.is_nan());
        Ok(number)
    }
}

impl<R: Read + Send> Rows for CsvRows<R> {
    fn choice(&self) -> &Choice {
        &self.choice
    }

    fn notes(&self) -> Vec<String> {
        let clock = self.clock.as_ref().and_then(Clock::note);
        self.choice.note.iter().cloned().chain(clock).collect()
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        let Some(line) = self.next_record(quality)? else { return Ok(false) };
        self.parse(row, quality, line).map_err(|e| e.at_line(line))?;
        quality.rows += 1;
        Ok(true)
    }
}

fn plural(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}
