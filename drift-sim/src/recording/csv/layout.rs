//! What a text looks like, from its beginning: which separator, where the header is, what stands before and below it.
//!
//! The rows of data say it: of all separators the one that splits most lines into the same number of cells of which at least
//! half are numbers or dates; one with a header above them is preferred. The header is one of the lines of words directly above
//! them: the one that units stand below, else the one that names most signals, else the last. Lines between header and data hold units
//! or descriptions, lines before it are no part of the table.

use super::blanks;
use super::labels::{self, Labels};
use super::units_row;
use crate::recording::ReadOptions;
use crate::recording::cell_kind::FirstRows;
use crate::recording::clock::is_date_or_time;
use crate::recording::decimal::{parse_number, with_point};
use crate::recording::guess::signals_named;
use crate::{Error, Result};

/// Cells of a line that are looked at.
const CELLS_MAX: usize = 4096;
/// Rows of units and descriptions below a header, at most.
const BELOW_MAX: usize = 3;
/// A separator that splits this part of as many lines as the best does, and stands before it in the list, is taken:
/// within cells commas and blanks are common, tabs and semicolons are not.
const NEARLY: f64 = 0.8;
/// Rows below a header that are so many times as many as all rows before it are the table; those before describe it.
const MANY_TIMES: usize = 10;

/// What stands between the cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    Byte(u8),
    /// Runs of blanks and tabs.
    Blanks,
}

/// In the order in which they are preferred.
const SEPARATORS: [Separator; 5] = [
    Separator::Byte(b'\t'),
    Separator::Byte(b';'),
    Separator::Byte(b'|'),
    Separator::Byte(b','),
    Separator::Blanks,
];

/// Signs that begin a comment.
const COMMENTS: [&str; 4] = ["#", "%", "//", "!"];

impl Separator {
    /// The byte between the cells after [`blanks`] have been collapsed.
    pub fn byte(self) -> u8 {
        match self {
            Self::Byte(byte) => byte,
            Self::Blanks => blanks::SEPARATOR,
        }
    }

    fn separates(self, c: char) -> bool {
        match self {
            Self::Byte(byte) => c == char::from(byte),
            Self::Blanks => c.is_whitespace(),
        }
    }

    /// The cells of a line without blanks and quotes around them.
    pub fn cells(self, line: &str) -> Vec<&str> {
        let bare =
            |from: usize, to: usize| line.get(from..to).unwrap_or_default().trim().trim_matches('"').trim();
        let (mut cells, mut from, mut quoted) = (Vec::new(), 0, false);
        for (at, c) in line.char_indices() {
            quoted ^= c == '"';
            if !quoted && self.separates(c) && cells.len() < CELLS_MAX {
                cells.push(bare(from, at));
                from = at + c.len_utf8();
            }
        }
        cells.push(bare(from, line.len()));
        if self == Self::Blanks {
            cells.retain(|cell| !cell.is_empty());
        }
        cells
    }
}

/// What a text looks like.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub separator: Separator,
    /// The names, where the header isn't the first line of the body: it is a comment, or there is none.
    pub names: Option<Vec<String>>,
    /// There is no header: the names are numbers.
    pub is_headerless: bool,
    /// Where header and data begin: byte and line.
    pub body_from: usize,
    pub body_line: u64,
    /// Lines between the header and the data.
    pub rows_below: usize,
    /// The sign that begins comments.
    pub comment: Option<u8>,
    /// The names that stand before every value.
    pub labels: Option<Labels>,
    /// The first rows of data.
    pub first_rows: FirstRows,
    /// Lines before the header that are no part of the table.
    lines_before: usize,
    /// A date and a time under one name.
    splits_date: bool,
}

/// A line that holds something.
struct Line<'a> {
    text: &'a str,
    from: usize,
    number: u64,
    comment: Option<&'static str>,
}

impl<'a> Line<'a> {
    /// The text behind the sign of a comment.
    fn uncommented(&self) -> &'a str {
        let sign = self.comment.unwrap_or_default();
        self.text.trim_start().trim_start_matches(sign).trim_start()
    }
}

impl Layout {
    /// The layout of a text that begins so; where there is no row of data in it, the first line is the header.
    pub fn of(head: &[u8]) -> Self {
        Self::found(head).unwrap_or_else(|first| *first)
    }

    /// The layout of a text in whose beginning there are rows of data; else that in which the first line is the header.
    pub fn found(head: &[u8]) -> std::result::Result<Self, Box<Self>> {
        let text = String::from_utf8_lossy(head);
        // Where the text was cut inside a letter, offsets would be off: nothing is found behind that place.
        let text = text.get(..text.rfind('\n').map_or(text.len(), |end| end + 1)).unwrap_or_default();
        let mut lines = lines(text);
        let stated = lines.first().and_then(|line| stated_separator(line.text));
        if stated.is_some() {
            lines.remove(0);
        }
        if stated.is_none()
            && let Some(layout) = Self::labelled(&lines)
        {
            return Ok(layout);
        }
        let table = match stated {
            Some(separator) => Table::found(separator, &lines),
            None => Table::likely(&lines),
        };
        let first = lines.first().map_or((0, 1), |line| (line.from, line.number));
        let Some(table) = table else { return Err(Box::new(Self::plain(&lines, stated, first))) };
        Ok(table.layout(&lines))
    }

    /// Lines in which a name stands before each value.
    fn labelled(lines: &[Line]) -> Option<Self> {
        let texts: Vec<&str> = lines.iter().map(|line| line.text).collect();
        let (labels, first) = Labels::of(&texts)?;
        let line = lines.get(first)?;
        let layout = Self::plain(&[], Some(Separator::Byte(labels::SEPARATOR)), (line.from, line.number));
        let names = Some(labels.names.clone());
        Some(Self { names, lines_before: first, labels: Some(labels), ..layout })
    }

    /// No row of data was found: the first line is the header.
    fn plain(lines: &[Line], stated: Option<Separator>, (body_from, body_line): (usize, u64)) -> Self {
        let first = lines.first().map_or("", |line| line.text);
        let separator = stated.unwrap_or_else(|| {
            let count = |separator: &Separator| first.chars().filter(|c| separator.separates(*c)).count();
            // Of equally many the last is taken, which for none of them is the comma.
            let bytes = SEPARATORS.into_iter().filter(|s| *s != Separator::Blanks);
            bytes.max_by_key(count).unwrap_or(Separator::Byte(b','))
        });
        Self {
            separator,
            names: None,
            is_headerless: false,
            body_from,
            body_line,
            rows_below: 0,
            comment: None,
            labels: None,
            first_rows: FirstRows::default(),
            lines_before: 0,
            splits_date: false,
        }
    }

    /// Refuses a table without names where the columns are not given by their numbers.
    pub fn check_header(&self, options: &ReadOptions) -> Result<()> {
        if !self.is_headerless || options.columns.is_by_number() {
            return Ok(());
        }
        let width = self.names.as_ref().map_or(0, Vec::len);
        let example = if width > 3 { "t=1,r=2,y=3,u=4" } else { "t=1,y=2,u=3" };
        Err(Error::new("the first line holds numbers")
            .allowed(format!("a header that names the columns, or --columns {example}")))
    }

    /// The names of a header, with one for the date where a date and a time stand under one.
    pub fn with_date(&self, mut names: Vec<String>) -> Vec<String> {
        if self.splits_date {
            names.insert(0, "Date".into());
        }
        names
    }

    /// What was passed over.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for (count, what) in [(self.lines_before, "before the header"), (self.rows_below, "below the header")]
        {
            match count {
                0 => {}
                1 => notes.push(format!("one line {what} is passed over")),
                more => notes.push(format!("{more} lines {what} are passed over")),
            }
        }
        if self.is_headerless {
            notes.push("there is no header: columns go by their numbers".into());
        }
        notes
    }
}

/// Rows of data as one separator sees them.
struct Table {
    separator: Separator,
    width: usize,
    /// How many of the lines are such rows.
    rows: usize,
    /// The first of them, by its place among the lines.
    first: usize,
}

impl Table {
    /// What most separators agree on.
    fn likely(lines: &[Line]) -> Option<Self> {
        let tables: Vec<Self> = SEPARATORS.into_iter().filter_map(|s| Self::found(s, lines)).collect();
        let most = tables.iter().map(|table| table.rows).max()?;
        let likely = || tables.iter().filter(|table| table.rows as f64 >= NEARLY * most as f64);
        let found = likely().find(|table| table.has_full_header(lines)).or_else(|| likely().next())?;
        Some(Self { ..*found })
    }

    /// Whether the header has as many cells as the rows.
    fn has_full_header(&self, lines: &[Line]) -> bool {
        let header = self.header(lines).and_then(|place| lines.get(place));
        header.is_some_and(|line| self.separator.cells(line.text).len() == self.width)
    }

    fn found(separator: Separator, lines: &[Line]) -> Option<Self> {
        // (width, the places of its lines), in the order in which they appear.
        let mut widths: Vec<(usize, Vec<usize>)> = Vec::new();
        for (place, line) in lines.iter().enumerate().filter(|(_, line)| line.comment.is_none()) {
            let cells = separator.cells(line.text);
            if cells.len() < 2 || !is_data(&cells) {
                continue;
            }
            match widths.iter_mut().find(|(width, _)| *width == cells.len()) {
                Some((_, places)) => places.push(place),
                None => widths.push((cells.len(), vec![place])),
            }
        }
        // Of equally many the first counts.
        let most = widths.iter().map(|(_, places)| places.len()).max()?;
        let (width, places) = widths.into_iter().find(|(_, places)| places.len() == most)?;
        let first = Self::first_row(separator, lines, &places)?;
        Some(Self { separator, width, rows: most, first })
    }

    /// Where the rows begin. Rows that come before a header and are few beside those below it describe the table, as
    /// the number of samples and the time of a measurement do.
    fn first_row(separator: Separator, lines: &[Line], places: &[usize]) -> Option<usize> {
        let are_names = |place: usize| {
            let cells = lines.get(place).map(|line| separator.cells(line.text)).unwrap_or_default();
            filled(&cells) > 1 && is_names(&cells)
        };
        let begins_below_header = |at: usize| {
            let (Some(before), Some(place)) = (places.get(at.wrapping_sub(1)), places.get(at)) else {
                return false;
            };
            let is_many = places.len() - at >= MANY_TIMES * at;
            is_many && *before + 1 < *place && are_names(*place - 1)
        };
        let at = (1..places.len()).rev().find(|at| begins_below_header(*at)).unwrap_or(0);
        let mut first = places.get(at).copied()?;
        // Rows above with fewer values, as that of a sensor which says that it isn't there, are rows as well.
        let width = lines.get(first).map(|line| separator.cells(line.text).len());
        while let Some(above) = first.checked_sub(1).and_then(|at| lines.get(at)) {
            let cells = separator.cells(above.text);
            let is_row = above.comment.is_none()
                && Some(cells.len()) == width
                && cells.iter().any(|cell| is_number_or_date(cell));
            if !is_row {
                break;
            }
            first -= 1;
        }
        Some(first)
    }

    /// The rows that can be seen from here.
    fn first_rows(&self, lines: &[Line]) -> FirstRows {
        let rows = lines.iter().skip(self.first).filter(|line| line.comment.is_none());
        FirstRows::of(rows.map(|line| self.separator.cells(line.text)))
    }

    fn layout(&self, lines: &[Line]) -> Layout {
        let data = |at: usize| lines.get(at).map_or((0, 1), |line| (line.from, line.number));
        let header = self.header(lines);
        let comment = lines.iter().skip(self.first).find_map(|line| line.comment);
        let comment = comment.filter(|sign| sign.len() == 1).and_then(|sign| sign.bytes().next());
        let layout = |names: Option<Vec<String>>, place: usize, rows_below: usize, lines_before: usize| {
            let (body_from, body_line) = data(place);
            Layout {
                separator: self.separator,
                is_headerless: false,
                body_from,
                body_line,
                rows_below,
                comment,
                labels: None,
                first_rows: self.first_rows(lines),
                lines_before,
                splits_date: self.splits_date(lines, header),
                names,
            }
        };
        if let Some(place) = header {
            // Empty rows between the header and the data are data.
            let below =
                lines.iter().take(self.first).skip(place + 1).map(|line| self.separator.cells(line.text));
            let below = below.filter(|cells| is_names(cells) && !is_empty(cells)).count();
            return layout(None, place, below.min(BELOW_MAX), place);
        }
        let above =
            self.first.checked_sub(1).and_then(|at| lines.get(at)).filter(|line| line.comment.is_some());
        let names: Vec<&str> = above.map_or(Vec::new(), |line| self.separator.cells(line.uncommented()));
        if names.len() == self.width && !is_data(&names) {
            let names = names.into_iter().map(str::to_owned).collect();
            return layout(Some(names), self.first, 0, self.first.saturating_sub(1));
        }
        let numbers = (1..=self.width).map(|number| number.to_string()).collect();
        Layout { is_headerless: true, ..layout(Some(numbers), self.first, 0, self.first) }
    }

    /// The place of the header.
    fn header(&self, lines: &[Line]) -> Option<usize> {
        let above = self.words_above(lines);
        let cells =
            |place: usize| lines.get(place).map(|line| self.separator.cells(line.text)).unwrap_or_default();
        let are_units = above.iter().rposition(|place| units_row::are_units(&cells(*place)));
        let named = |place: &usize| signals_named(&cells(*place));
        let header = match are_units.and_then(|at| above.get(at + 1)) {
            Some(above_units) => Some(*above_units),
            // Of lines that name equally many signals the one nearest to the data.
            None => above.iter().copied().rev().max_by_key(named),
        };
        header.or_else(|| self.header_with_numbers(lines))
    }

    /// The places of the lines directly above the data that hold no values, each as full as those below it; that nearest to the data
    /// first.
    fn words_above(&self, lines: &[Line]) -> Vec<usize> {
        let (mut places, mut below) = (Vec::new(), 0);
        for (place, line) in lines.iter().enumerate().take(self.first).rev() {
            let cells = self.separator.cells(line.text);
            // A line of separators alone, or of missing values, is a row of data.
            if places.is_empty() && line.comment.is_none() && is_empty(&cells) {
                continue;
            }
            let names = filled(&cells);
            let fits =
                if places.is_empty() { names > 1 } else { cells.len() == self.width && names >= below };
            if line.comment.is_some() || !fits || !is_names(&cells) {
                break;
            }
            places.push(place);
            below = names;
        }
        places
    }

    /// The first row, where it has a text above a column of values: some names are numbers.
    fn header_with_numbers(&self, lines: &[Line]) -> Option<usize> {
        let names = self.separator.cells(lines.get(self.first)?.text);
        let next = lines.get(self.first + 1).map(|line| self.separator.cells(line.text))?;
        let is_name = |(name, cell): (&&str, &&str)| !is_value(name) && is_value(cell) && !cell.is_empty();
        (names.len() == next.len() && names.iter().zip(&next).any(is_name)).then_some(self.first)
    }

    /// Whether the data begin with a date and a time that the header has one name for.
    fn splits_date(&self, lines: &[Line], header: Option<usize>) -> bool {
        let names = header.and_then(|at| lines.get(at)).map(|line| self.separator.cells(line.text).len());
        let cells = lines.get(self.first).map(|line| self.separator.cells(line.text)).unwrap_or_default();
        self.separator == Separator::Blanks
            && names.is_some_and(|names| names + 1 == self.width)
            && matches!(cells.as_slice(), [date, time, ..] if is_date(date) && time.contains(':'))
    }
}

fn is_date(cell: &str) -> bool {
    parse_number(cell.as_bytes()).is_none() && is_date_or_time(cell) && !cell.contains(':')
}

fn is_empty(cells: &[&str]) -> bool {
    cells.iter().all(|cell| parse_number(cell.as_bytes()).is_some_and(f64::is_nan))
}

/// Whether none of these is a number or a date: names, units, descriptions.
fn is_names(cells: &[&str]) -> bool {
    !cells.iter().any(|cell| is_number_or_date(cell))
}

/// A value that is no word for nothing.
fn is_number_or_date(cell: &str) -> bool {
    is_value(cell) && !parse_number(cell.as_bytes()).is_some_and(f64::is_nan)
}

/// A number with a point or a comma, nothing at all, a word for nothing, a date or a time.
fn is_value(cell: &str) -> bool {
    parse_number(cell.as_bytes()).is_some() || with_point(cell.as_bytes()).is_some() || is_date_or_time(cell)
}

/// How many cells hold something.
fn filled(cells: &[&str]) -> usize {
    cells.iter().filter(|cell| !cell.is_empty()).count()
}

/// Whether at least half of what says something are numbers or dates.
fn is_data(cells: &[&str]) -> bool {
    let values = cells.iter().filter(|cell| is_number_or_date(cell)).count();
    let words = cells.iter().filter(|cell| !is_value(cell)).count();
    values > 0 && values >= words
}

/// The lines that hold something.
fn lines(text: &str) -> Vec<Line<'_>> {
    let mut from = 0;
    let mut lines = Vec::new();
    for (number, line) in text.split_inclusive('\n').enumerate() {
        let text = line.trim_end();
        if !text.trim().is_empty() {
            let comment = COMMENTS.into_iter().find(|sign| text.trim_start().starts_with(sign));
            lines.push(Line { text, from, number: number as u64 + 1, comment });
        }
        from += line.len();
    }
    lines
}

/// The separator that spreadsheets write on a line of its own before the header.
fn stated_separator(line: &str) -> Option<Separator> {
    match line.strip_prefix("sep=")?.as_bytes() {
        [byte @ (b',' | b';' | b'\t' | b'|')] => Some(Separator::Byte(*byte)),
        // The separator itself was a tab, which is gone with the blanks at the end.
        [] => Some(Separator::Byte(b'\t')),
        _ => None,
    }
}
