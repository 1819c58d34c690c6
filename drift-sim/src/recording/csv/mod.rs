//! The CSV format: text in, records out, each with the line it stands on.
//!
//! What a file looks like is found from its beginning ([`layout`]): its encoding, its separator (comma, semicolon, tab, bar
//! or blanks), lines before the header, a row of units, comments, no header at all. Beside a separator that is no comma
//! numbers may have decimal commas. Lines end in LF, CRLF or CR, fields may be quoted, a byte order mark, blank lines and the
//! `sep=;` of spreadsheets are passed over. Lines of `name:value` pairs ([`labels`]) and tables with a row for each value are read
//! as well.

mod blanks;
mod blocks;
mod encoding;
mod labels;
mod layout;
mod nuls;
mod plain;
mod rows;
mod units_row;

use std::io::{Cursor, Read};

use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};

use super::decimal::DecimalMark;
use super::format::Source;
use super::long_table::LongTable;
use super::records::{Record, Records};
use super::row::{Row, Rows};
use super::stretch::{self, Stretch};
use super::text_rows::{Header, TextRows};
use super::{Quality, ReadOptions};
use crate::{Error, Result};
use blocks::Blocks;
use layout::{Layout, Separator};
use plain::{Delimiters, Plan};
use rows::CsvRows;

/// Text that the layout is found from ...
const HEAD_BYTES: usize = 1 << 16;
/// ... and so much where no row of data begins in that: lines that are passed over before the header take no more. That is about 20 000 of
/// them; an export states some hundred settings at most.
const PREAMBLE_BYTES_MAX: usize = 1 << 20;
/// Runs of NULs in that text, at most: a power cut leaves one, other files are full of them.
const NULS_IN_HEAD_MAX: usize = 3;
/// A row longer than this is a quote that never closes, or no recording.
const ROW_BYTES_MAX: usize = 1 << 20;
/// Fields of one row, at most.
const FIELDS_MAX: usize = 1 << 18;

/// Records of delimited text, in the memory of one of them.
pub(super) struct CsvRecords {
    source: Blocks,
    parser: Reader,
    delimiters: Delimiters,
    /// Lines seen so far, to tell blank ones.
    last_line: u64,
    notes: Vec<String>,
}

/// The rows of a text, after a look at what it begins with.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<Box<dyn Rows>> {
    let budget = source.budget.clone();
    let refused = |e: std::io::Error| Error::new(format!("can't be read: {e}"));
    let is_file = source.file.is_some();
    let decoded = encoding::decoded(source.reader).map_err(refused)?;
    let mut source = nuls::shortened(not_begun_by_nuls(decoded)?);
    let mut head = Vec::with_capacity(HEAD_BYTES);
    source.by_ref().take(HEAD_BYTES as u64).read_to_end(&mut head).map_err(refused)?;
    if head.iter().all(u8::is_ascii_whitespace) && head.len() < HEAD_BYTES {
        return Err(Error::new("the file is empty").allowed("a header and rows of numbers"));
    }
    if head.iter().filter(|byte| **byte == 0).count() > NULS_IN_HEAD_MAX {
        return Err(no_text());
    }
    let layout = match Layout::found(&head) {
        Ok(layout) => layout,
        Err(layout) if head.len() < HEAD_BYTES => *layout,
        Err(_) => {
            let more = (PREAMBLE_BYTES_MAX - HEAD_BYTES) as u64;
            source.by_ref().take(more).read_to_end(&mut head).map_err(refused)?;
            Layout::of(&head)
        }
    };
    let body = head.split_off(layout.body_from.min(head.len()));
    let whole: Box<dyn Read + Send> = Box::new(Cursor::new(body).chain(source));
    let whole: Box<dyn Read + Send> = match &layout.labels {
        Some(labels) => Box::new(labels::removed(whole, labels.clone())),
        None if layout.separator == Separator::Blanks => Box::new(blanks::collapsed(whole)),
        None => whole,
    };
    let mut records = CsvRecords::new(whole, &layout, is_file);
    let (header, line) = records.header(layout, options)?;
    match LongTable::of(&header, options) {
        Some(long) => {
            Ok(Box::new(long.rows(records, header, options, &budget).map_err(|e| e.at_line(line))?))
        }
        None => {
            let rows = TextRows::new(records, header, options).map_err(|e| e.at_line(line))?;
            Ok(Box::new(CsvRows::new(rows)))
        }
    }
}

/// The source, where it does not begin with what no text does.
fn not_begun_by_nuls(mut source: impl Read) -> Result<impl Read> {
    let mut first = Vec::new();
    source.by_ref().take(1).read_to_end(&mut first).map_err(|e| Error::new(format!("can't be read: {e}")))?;
    if first.contains(&0) { Err(no_text()) } else { Ok(Cursor::new(first).chain(source)) }
}

fn no_text() -> Error {
    Error::new("this is neither text nor a format that is read").allowed(super::format::ALL)
}

impl CsvRecords {
    fn new(source: Box<dyn Read + Send>, layout: &Layout, is_file: bool) -> Self {
        // Lines end at LF alone, so that a record never ends between CR and LF and its line is known; the CR goes
        // with the blanks around a cell.
        let mut parser = ReaderBuilder::new();
        parser.delimiter(layout.separator.byte()).terminator(Terminator::Any(b'\n'));
        parser.comment(layout.comment);
        let mut parser = parser.build();
        parser.set_line(layout.body_line);
        let delimiters = Delimiters { separator: layout.separator.byte(), comment: layout.comment };
        let source = Blocks::new(source, layout.body_line, is_file);
        let last_line = layout.body_line.saturating_sub(1);
        Self { source, parser, delimiters, last_line, notes: layout.notes() }
    }

    /// The next row into `row` where it is a plain one; false where it takes the parser, and at the end.
    #[inline]
    fn plain(&mut self, plan: &Plan, row: &mut Row, quality: &mut Quality) -> bool {
        let Some((index, line)) = self.source.plain(plan) else { return false };
        self.source.rows().write(index, row);
        row.line = line;
        self.pass(1, line, quality);
        true
    }

    /// The plain rows that come next, as long as they are samples of a closed loop.
    fn samples(&mut self, plan: &Plan, stretch: &mut Stretch, quality: &mut Quality) {
        while stretch.len() < stretch::ROWS {
            let (rows, line) = self.source.samples(plan, stretch::ROWS - stretch.len());
            let Some(last) = rows.last() else { return };
            let (count, last) = (rows.len() as u64, line + u64::from(last.line));
            stretch
                .extend_rows(rows.iter().map(|row| (line + u64::from(row.line), row.stamp, row.signals())));
            self.pass(count, last, quality);
        }
    }

    /// Goes on behind so many rows that the parser has not seen, the last of which is on this line.
    #[inline]
    fn pass(&mut self, rows: u64, line: u64, quality: &mut Quality) {
        quality.blank_lines += line.saturating_sub(self.last_line + rows);
        self.last_line = line;
        self.parser.set_line(line + 1);
    }

    /// The header, and its line.
    fn header(&mut self, layout: Layout, options: &ReadOptions) -> Result<(Header, u64)> {
        let mut record = Record::default();
        let mut quality = Quality::default();
        let text = |record: &Record| -> Vec<String> {
            record.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect()
        };
        let (names, line) = match layout.names.clone() {
            Some(names) => (names, layout.body_line),
            None => match self.next(&mut record, &mut quality)? {
                Some(line) => (layout.with_date(text(&record)), line),
                None => return Err(Error::new("the file is empty").allowed("a header and rows of numbers")),
            },
        };
        let mut units = Vec::new();
        for _ in 0..layout.rows_below {
            if self.next(&mut record, &mut quality)?.is_some() && units.is_empty() {
                units = text(&record);
            }
        }
        let mark = DecimalMark::beside(layout.separator.byte());
        layout.check_header(options).map_err(|e| e.at_line(line))?;
        Ok((Header { names, units, first_rows: layout.first_rows, mark }, line))
    }

    fn line_ends_inside(record: &Record) -> u64 {
        record.as_slice().iter().filter(|b| **b == b'\n').count() as u64
    }

    /// The next record, empty ones not counted; its line.
    fn parse(&mut self, record: &mut Record) -> Result<Option<u64>> {
        let (bytes, ends) = record.buffers();
        bytes.resize(bytes.len().max(1 << 10), 0);
        ends.resize(ends.len().max(1 << 6), 0);
        let (mut used, mut count) = (0, 0);
        loop {
            let input = self
                .source
                .fill()
                .map_err(|e| Error::new(format!("can't be read: {e}")).at_line(self.parser.line()))?;
            let is_over = input.is_empty();
            let (result, read, written, ended) =
                self.parser.read_record(input, &mut bytes[used..], &mut ends[count..]);
            self.source.consume(read);
            used += written;
            count += ended;
            match result {
                ReadRecordResult::InputEmpty => {}
                ReadRecordResult::OutputFull if bytes.len() >= ROW_BYTES_MAX => {
                    let what = "a row of more than 1 MiB, perhaps a quote that never closes";
                    return Err(Error::new(what).at_line(self.parser.line()));
                }
                ReadRecordResult::OutputFull => bytes.resize(bytes.len() * 2, 0),
                ReadRecordResult::OutputEndsFull if ends.len() >= FIELDS_MAX => {
                    let what = format!("a row of more than {FIELDS_MAX} fields");
                    return Err(Error::new(what).at_line(self.parser.line()));
                }
                ReadRecordResult::OutputEndsFull => ends.resize(ends.len() * 2, 0),
                ReadRecordResult::Record => {
                    record.filled(used, count);
                    // The parser stands behind the line's end, which the last line of a file may lack.
                    return Ok(Some(self.parser.line().saturating_sub(u64::from(!is_over))));
                }
                ReadRecordResult::End => return Ok(None),
            }
        }
    }
}

impl Records for CsvRecords {
    fn next(&mut self, record: &mut Record, quality: &mut Quality) -> Result<Option<u64>> {
        loop {
            let Some(line) = self.parse(record)? else { return Ok(None) };
            // The parser itself passes over empty lines; a field may hold line ends of its own.
            let passed = line.saturating_sub(self.last_line);
            if passed > 1 {
                quality.blank_lines += passed.saturating_sub(1 + Self::line_ends_inside(record));
            }
            self.last_line = line;
            if record.len() <= 1 && record.as_slice().trim_ascii().is_empty() {
                quality.blank_lines += 1;
                continue;
            }
            return Ok(Some(line));
        }
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }
}
