//! Rows that need no state to be read: as many cells as the header, numbers where numbers belong, no quotes. They are read block
//! by block, also several blocks at once; every other row, and every fault, is left to the reader of single rows
//! ([`TextRows`]), which decides alone what a row says. So a plain row is what that reader would have made of it.

use super::super::choice::{Choice, Reference};
use super::super::decimal::{DecimalMark, parse_number};
use super::super::row::{Row, worse};
use super::super::stamp::{Stamp, TimeUnit};
use super::super::when::When;

/// A longer row may be too long for the reader of single rows, which says so.
const ROW_BYTES_MAX: usize = 1 << 16;

/// What a row must be like to be plain, and which of its cells say what. It holds as long as the file's decimal mark, its clock and
/// its columns of text are what they were when the plan was made.
pub(super) struct Plan {
    /// Which plan of the file it is.
    pub number: u32,
    separator: u8,
    comment: Option<u8>,
    /// Cells of a row.
    width: usize,
    mark: DecimalMark,
    unit: TimeUnit,
    /// The cells that are read, in their order.
    parts: Vec<(usize, Part)>,
    when: Vec<When>,
    extra: usize,
}

/// What a cell is.
#[derive(Debug, Clone, Copy)]
enum Part {
    Time,
    R,
    Y,
    U,
    Mode,
    When(usize),
    Extra(usize),
}

/// What stands around the cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Delimiters {
    pub separator: u8,
    pub comment: Option<u8>,
}

/// The plain rows of a block.
#[derive(Default)]
pub(super) struct PlainRows {
    pub rows: Vec<PlainRow>,
    /// The further columns, row by row.
    extra: Vec<f64>,
    /// How many there are.
    extra_columns: usize,
}

/// One plain row: where it stands and what it says. NaN is missing.
#[derive(Clone, Copy)]
pub(super) struct PlainRow {
    /// Where it begins, with empty lines before it.
    pub from: u32,
    /// Behind its end of line.
    pub to: u32,
    /// Its line, counted from the block's first.
    pub line: u32,
    manual: bool,
    good: Option<bool>,
    pub stamp: Stamp,
    r: f64,
    y: f64,
    u: f64,
    mode: f64,
}

impl PlainRow {
    /// Whether r, y and u are all there and the loop is closed.
    #[inline]
    pub fn is_sample(&self) -> bool {
        !self.manual && self.signals().iter().all(|x| x.is_finite())
    }

    /// r, y and u.
    #[inline]
    pub fn signals(&self) -> [f64; 3] {
        [self.r, self.y, self.u]
    }
}

impl PlainRows {
    /// Writes a row down, all but its line, and says whether r, y and u are missing.
    #[inline]
    pub fn write(&self, index: usize, row: &mut Row) {
        let Some(plain) = self.rows.get(index) else { return };
        row.stamp = plain.stamp;
        (row.r, row.y, row.u) = (plain.r, plain.y, plain.u);
        (row.manual, row.mode, row.good) = (plain.manual, plain.mode, plain.good);
        row.extra.clear();
        let from = index * self.extra_columns;
        row.extra.extend_from_slice(self.extra.get(from..from + self.extra_columns).unwrap_or_default());
    }
}

impl Plan {
    /// The plan of a file in which these columns are read.
    pub fn new(
        number: u32,
        delimiters: Delimiters,
        width: usize,
        (mark, unit): (DecimalMark, TimeUnit),
        choice: &Choice,
    ) -> Self {
        let r = match choice.r {
            Reference::Column(r) => Some(r),
            Reference::Absent => None,
        };
        let signals = [(choice.t, Part::Time), (r, Part::R), (choice.y, Part::Y), (choice.u, Part::U)];
        let signals = signals.into_iter().chain([(choice.mode, Part::Mode)]);
        let when = choice.when.iter().enumerate().map(|(i, (index, _))| (*index, Part::When(i)));
        // A column of text is NaN throughout.
        let extra = choice.extra.iter().enumerate().filter(|(_, extra)| !extra.text);
        let extra = extra.map(|(i, extra)| (extra.index, Part::Extra(i)));
        let signals = signals.filter_map(|(index, part)| Some((index?, part)));
        let mut parts: Vec<(usize, Part)> = signals.chain(when).chain(extra).collect();
        parts.sort_by_key(|(index, _)| *index);
        let Delimiters { separator, comment } = delimiters;
        let when = choice.when.iter().map(|(_, when)| when.clone()).collect();
        Self { number, separator, comment, width, mark, unit, parts, when, extra: choice.extra.len() }
    }

    /// Reads the plain rows of a text from a place on at which a row begins.
    pub fn read(&self, text: &[u8], from: usize, found: &mut PlainRows) {
        found.rows.clear();
        found.extra.clear();
        found.extra_columns = self.extra;
        // Within quotes a line end ends no row; places are kept as u32.
        if memchr::memchr(b'"', text).is_some() || u32::try_from(text.len()).is_err() {
            return;
        }
        let mut line = memchr::memchr_iter(b'\n', text.get(..from).unwrap_or_default()).count() as u32;
        let mut r = Repeated::default();
        let (mut at, mut begin) = (from, from);
        while at < text.len() {
            if text.get(at) == Some(&b'\n') {
                (at, line) = (at + 1, line + 1);
                continue;
            }
            match self.row(text, at, &mut r, &mut found.extra).filter(|(_, to)| to - at <= ROW_BYTES_MAX) {
                Some((row, to)) => {
                    found.rows.push(PlainRow { from: begin as u32, to: to as u32, line, ..row });
                    at = to;
                }
                None => {
                    found.extra.truncate(found.rows.len() * self.extra);
                    let Some(end) = memchr::memchr(b'\n', text.get(at..).unwrap_or_default()) else { return };
                    at += end + 1;
                }
            }
            line += 1;
            begin = at;
        }
    }

    /// A row and where the next one begins; `None` where it is not plain.
    #[inline]
    fn row<'a>(
        &self,
        text: &'a [u8],
        from: usize,
        r: &mut Repeated<'a>,
        extra: &mut Vec<f64>,
    ) -> Option<(PlainRow, usize)> {
        if self.comment.is_some() && text.get(from).copied() == self.comment {
            return None;
        }
        let nan = f64::NAN;
        let mut row = PlainRow {
            from: 0,
            to: 0,
            line: 0,
            manual: false,
            good: None,
            stamp: Stamp::default(),
            r: nan,
            y: nan,
            u: nan,
            mode: nan,
        };
        let further = extra.len();
        extra.resize(further + self.extra, nan);
        let mut cells = Cells { text, separator: self.separator, from, to: from, next: from, seen: 0 };
        for (index, part) in &self.parts {
            match part {
                Part::Time => row.stamp = self.unit.scale(cells.stamp(*index, self.mark)?),
                Part::R => row.r = cells.repeated(*index, self.mark, r)?,
                Part::Y => row.y = cells.number(*index, self.mark)?,
                Part::U => row.u = cells.number(*index, self.mark)?,
                Part::Extra(i) => {
                    let value = cells.number(*index, self.mark)?;
                    *extra.get_mut(further + i)? = value;
                }
                Part::Mode => row.mode = parse_number(cells.go_to(*index)?).unwrap_or(nan),
                Part::When(i) => {
                    let cell = cells.go_to(*index)?;
                    let plain = self.mark.plain(cell);
                    let (when, cell) = (self.when.get(*i)?, plain.as_deref().unwrap_or(cell));
                    row.manual |= !when.holds(cell);
                    row.good = worse(row.good, when.is_good_code(cell));
                }
            }
        }
        Some((row, cells.end(self.width)?))
    }
}

/// A number and the text that it was read from, with what separates it from the next. A reference mostly is what it was.
#[derive(Default)]
struct Repeated<'a> {
    text: &'a [u8],
    /// Of the cell alone.
    length: usize,
    value: f64,
}

/// The cells of one row, from left to right.
struct Cells<'a> {
    text: &'a [u8],
    separator: u8,
    /// The current cell, which may have blanks around it.
    from: usize,
    to: usize,
    /// Behind what separates it from the next.
    next: usize,
    /// How many there were, the current one with them.
    seen: usize,
}

impl<'a> Cells<'a> {
    /// The current cell without the blanks around it.
    #[inline]
    fn cell(&self) -> &'a [u8] {
        self.text.get(self.from..self.to).unwrap_or_default().trim_ascii()
    }

    /// Whether the current cell is the row's last.
    #[inline]
    fn is_last(&self) -> bool {
        self.seen > 0 && self.text.get(self.next.wrapping_sub(1)) == Some(&b'\n')
    }

    /// Goes on by one cell, whatever it holds.
    #[inline]
    fn step(&mut self) -> Option<()> {
        if self.is_last() {
            return None;
        }
        let length = memchr::memchr2(self.separator, b'\n', self.text.get(self.next..)?)?;
        self.from = self.next;
        self.to = self.from + length;
        self.next = self.to + 1;
        self.seen += 1;
        Some(())
    }

    /// Goes on to a cell, which may be the current one.
    #[inline]
    fn go_to(&mut self, index: usize) -> Option<&'a [u8]> {
        while self.seen <= index {
            self.step()?;
        }
        Some(self.cell())
    }

    /// The time stamp in a cell.
    #[inline]
    fn stamp(&mut self, index: usize, mark: DecimalMark) -> Option<Stamp> {
        if self.is_ahead(index, mark)
            && let Some((stamp, length)) = Stamp::of_digits(self.text.get(self.next..)?)
            && self.pass(length).is_some()
        {
            return Some(stamp);
        }
        let t_s = self.number(index, mark).filter(|t| t.is_finite())?;
        Stamp::written_as(t_s, self.cell())
    }

    /// The number in a cell that may say the same as in the row before.
    #[inline]
    fn repeated(&mut self, index: usize, mark: DecimalMark, before: &mut Repeated<'a>) -> Option<f64> {
        if self.is_ahead(index, mark)
            && !before.text.is_empty()
            && self.text.get(self.next..)?.starts_with(before.text)
        {
            self.from = self.next;
            (self.to, self.next) = (self.from + before.length, self.from + before.text.len());
            self.seen += 1;
            return Some(before.value);
        }
        let value = self.number(index, mark)?;
        *before = Repeated { text: self.text.get(self.from..self.next)?, length: self.to - self.from, value };
        Some(value)
    }

    /// Whether a cell is the next one, and a number in it can be read before its end is known.
    #[inline]
    fn is_ahead(&mut self, index: usize, mark: DecimalMark) -> bool {
        while self.seen < index {
            if self.step().is_none() {
                return false;
            }
        }
        self.seen == index && mark == DecimalMark::Point && !self.is_last()
    }

    /// Goes on by a cell of this length, where it ends there.
    #[inline]
    fn pass(&mut self, length: usize) -> Option<()> {
        let behind = self.behind(self.text.get(self.next..)?, length)?;
        self.from = self.next;
        self.to = self.from + length;
        self.next = self.to + behind;
        self.seen += 1;
        Some(())
    }

    /// The number in a cell, read together with its end; NaN for a word that says there is none.
    #[inline]
    fn number(&mut self, index: usize, mark: DecimalMark) -> Option<f64> {
        if self.is_ahead(index, mark)
            && let Ok((value, length)) = fast_float2::parse_partial::<f64, _>(self.text.get(self.next..)?)
            && value.is_finite()
            && self.pass(length).is_some()
        {
            return Some(value);
        }
        let cell = self.go_to(index)?;
        // A first mark settles what the file's is: that is no plain row.
        let is_plain = mark == DecimalMark::Point || !cell.iter().any(|b| matches!(b, b'.' | b','));
        parse_number(cell).filter(|_| is_plain)
    }

    /// How many bytes separate a cell of this length from what follows; `None` where it goes on.
    #[inline]
    fn behind(&self, text: &[u8], length: usize) -> Option<usize> {
        match text.get(length)? {
            b'\n' => Some(1),
            b if *b == self.separator => Some(1),
            b'\r' if text.get(length + 1) == Some(&b'\n') => Some(2),
            _ => None,
        }
    }

    /// Behind the row's end, where it has so many cells; more are harmless as long as they hold nothing.
    #[inline]
    fn end(mut self, width: usize) -> Option<usize> {
        while self.seen < width {
            self.step()?;
        }
        while !self.is_last() {
            self.step()?;
            if !self.cell().is_empty() {
                return None;
            }
        }
        Some(self.next)
    }
}
