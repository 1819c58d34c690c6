//! The CSV format: text in, rows of numbers out, each with the line it stands on.
//!
//! A header names the columns. Separators are commas, or semicolons or tabs where the header has no comma. Lines end
//! in LF or CRLF, fields may be quoted, a byte order mark and blank lines are passed over.

use std::io::{BufRead, BufReader, Read};

use ::csv::{ByteRecord, Reader, ReaderBuilder, Terminator};

use super::stamp::Stamp;
use super::{Quality, ReadOptions};
use crate::{Error, Result};

/// Bytes asked of the system at a time.
const BUFFER_BYTES: usize = 1 << 18;
/// A row longer than this is a quote that never closes, or no recording.
const ROW_BYTES_MAX: usize = 1 << 20;

/// One row of data: NaN is missing.
#[derive(Debug, Clone, Default)]
pub(super) struct Row {
    pub line: u64,
    pub stamp: Stamp,
    pub r: f64,
    pub y: f64,
    pub u: f64,
    pub manual: bool,
    pub extra: Vec<f64>,
}

impl Row {
    /// Whether it says the same as another, cell by cell.
    fn same_values(&self, other: &Self) -> bool {
        let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || a == b;
        same(self.r, other.r)
            && same(self.y, other.y)
            && same(self.u, other.u)
            && self.manual == other.manual
            && self.extra.len() == other.extra.len()
            && self.extra.iter().zip(&other.extra).all(|(a, b)| same(*a, *b))
    }
}

/// Checks that a row at the same time as the one before says the same: only then can it be dropped.
pub(super) fn repeats(before: &Row, row: &Row) -> Result<()> {
    if row.same_values(before) {
        return Ok(());
    }
    Err(Error::new(format!("the time {} s again, with other values", row.stamp.t_s)).at_line(row.line))
}

/// A further column that is read: its name, its place, and whether text in it is refused or makes it no number.
struct Extra {
    name: String,
    index: usize,
    asked_for: bool,
    text: bool,
}

/// Reads rows one after the other; memory stays that of one row.
pub(super) struct RowReader<R: Read> {
    reader: Reader<R>,
    record: ByteRecord,
    names: Vec<String>,
    t: Option<usize>,
    r: usize,
    y: usize,
    u: usize,
    extra: Vec<Extra>,
    when: Vec<(usize, super::When)>,
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

/// The number in a cell without blanks around it; NaN for the words that say there is none; `None` for other text.
pub(super) fn parse_number(cell: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(cell).ok()?;
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Some(x),
        Ok(_) => Some(f64::NAN),
        Err(_) => {
            let is_none =
                text.is_empty() || ["na", "n/a", "null", "none"].iter().any(|w| text.eq_ignore_ascii_case(w));
            is_none.then_some(f64::NAN)
        }
    }
}

/// Wraps a source that holds UTF-8 text, after a look at what it begins with.
pub(super) fn open<R: Read>(source: R, options: &ReadOptions) -> Result<RowReader<Ended<BufReader<R>>>> {
    let mut source = BufReader::with_capacity(BUFFER_BYTES, source);
    let start = source.fill_buf().map_err(|e| Error::new(format!("can't be read: {e}")))?;
    if start.starts_with(&[0xff, 0xfe]) || start.starts_with(&[0xfe, 0xff]) {
        return Err(Error::new("the text is UTF-16").allowed("UTF-8"));
    }
    let header = start.split(|b| *b == b'\n').next().unwrap_or_default();
    let delimiter = [b',', b';', b'\t'].into_iter().find(|d| header.contains(d)).unwrap_or(b',');
    RowReader::new(Ended { source, last: b'\n' }, delimiter, options)
}

impl<R: Read> RowReader<R> {
    fn new(source: R, delimiter: u8, options: &ReadOptions) -> Result<Self> {
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
            t: None,
            r: 0,
            y: 0,
            u: 0,
            extra: Vec::new(),
            when: Vec::new(),
            last_line: 0,
        };
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
        let map = &options.columns;
        self.t = match &map.t {
            Some(name) if map.t_is_named || options.sample_time_s.is_none() => Some(self.find(name, "t")?),
            Some(name) => self.names.iter().position(|n| n == name),
            None if options.sample_time_s.is_some() => None,
            None => return Err(Error::new("no column is t").allowed("name one, or give the sample time")),
        };
        self.r = self.find(&map.r, "r")?;
        self.y = self.find(&map.y, "y")?;
        self.u = self.find(&map.u, "u")?;
        for when in &options.when {
            self.when.push((self.find(&when.column, "a condition")?, when.clone()));
        }
        for name in &options.extra {
            let index = self.find(name, "a further signal")?;
            self.extra.push(Extra { name: name.clone(), index, asked_for: true, text: false });
        }
        if options.keep_extra {
            for (index, name) in self.names.iter().enumerate() {
                let taken = [self.t.unwrap_or(self.r), self.r, self.y, self.u].contains(&index)
                    || self.extra.iter().any(|e| e.index == index);
                if !taken && !name.is_empty() {
                    self.extra.push(Extra { name: name.clone(), index, asked_for: false, text: false });
                }
            }
        }
        Ok(())
    }

    fn find(&self, name: &str, what_for: &str) -> Result<usize> {
        self.names
            .iter()
            .position(|n| n == name)
            .ok_or_else(|| no_column(name, what_for, self.names.iter().map(String::as_str)))
    }

    /// Whether the rows have time stamps.
    pub fn has_time(&self) -> bool {
        self.t.is_some()
    }

    /// The names of the further columns, in the order of [`Row::extra`].
    pub fn extra_names(&self) -> Vec<String> {
        self.extra.iter().map(|e| e.name.clone()).collect()
    }

    /// Which of the further columns turned out to hold text.
    pub fn text_columns(&self) -> Vec<bool> {
        self.extra.iter().map(|e| e.text).collect()
    }

    /// How much of the file has been read.
    pub fn bytes_read(&self) -> u64 {
        self.reader.position().byte()
    }

    /// Reads the next row into `row`; false at the end.
    pub fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        let Some(line) = self.next_record(quality)? else { return Ok(false) };
        self.parse(row, quality, line).map_err(|e| e.at_line(line))?;
        quality.rows += 1;
        Ok(true)
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
        if let Some(t) = self.t {
            let cell = self.cell(t);
            row.stamp = Stamp::parse(cell).ok_or_else(|| {
                let name = &self.names[t];
                if cell.is_empty() || parse_number(cell).is_some() {
                    Error::new(format!("no time stamp in column '{name}'"))
                } else {
                    not_a_number(cell, name)
                }
            })?;
        }
        row.r = self.number(self.r, &mut quality.missing_r)?;
        row.y = self.number(self.y, &mut quality.missing_y)?;
        row.u = self.number(self.u, &mut quality.missing_u)?;
        row.manual = self.when.iter().any(|(index, when)| !when.holds(self.cell(*index)));
        row.extra.clear();
        for i in 0..self.extra.len() {
            let Extra { index, asked_for, text, .. } = self.extra[i];
            let cell = self.record.get(index).unwrap_or_default().trim_ascii();
            let value = if text { Some(f64::NAN) } else { parse_number(cell) };
            match value {
                Some(value) => row.extra.push(value),
                None if asked_for => return Err(not_a_number(cell, &self.names[index])),
                None => {
                    self.extra[i].text = true;
                    row.extra.push(f64::NAN);
                }
            }
        }
        Ok(())
    }

    fn cell(&self, index: usize) -> &[u8] {
        self.record.get(index).unwrap_or_default().trim_ascii()
    }

    fn number(&self, index: usize, missing: &mut u64) -> Result<f64> {
        let cell = self.cell(index);
        let number = parse_number(cell).ok_or_else(|| not_a_number(cell, &self.names[index]))?;
        *missing += u64::from(number.is_nan());
        Ok(number)
    }
}

fn not_a_number(cell: &[u8], column: &str) -> Error {
    let error = Error::new(format!(
        "'{}' in column '{column}' is not a number",
        excerpt(&String::from_utf8_lossy(cell))
    ));
    let decimal_comma = cell.iter().filter(|b| **b == b',').count() == 1
        && cell.iter().all(|b| b.is_ascii_digit() || b",+-eE".contains(b));
    if decimal_comma { error.allowed("a decimal point") } else { error }
}

pub(super) fn no_column<'a>(name: &str, what_for: &str, there: impl Iterator<Item = &'a str>) -> Error {
    let there: Vec<_> = there.collect();
    Error::new(format!("no column '{name}' for {what_for}"))
        .allowed(format!("the columns are {}", excerpt(&there.join(", "))))
}

fn plural(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Enough of the input to find it by.
fn excerpt(text: &str) -> String {
    const LONGEST: usize = 200;
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    text.chars().take(LONGEST).chain("...".chars()).collect()
}
