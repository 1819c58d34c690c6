//! Rows side by side. Where t, r, y and u hold finite numbers, the loop is closed and nothing else is read, there is nothing to decide
//! row by row: such rows are handed on in columns, as far as their stamps follow each other on the grid.

use super::row::Row;
use super::stamp::Stamp;

/// Samples that come one after the other, all of them valid, in columns of one length.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    /// When each was taken, s: the row's stamp, or without stamps the grid's.
    pub t_s: &'a [f64],
    /// Reference.
    pub r: &'a [f64],
    /// Measured output.
    pub y: &'a [f64],
    /// Controller output.
    pub u: &'a [f64],
}

impl Samples<'_> {
    /// No sample.
    pub(super) const NONE: Self = Self { t_s: &[], r: &[], y: &[], u: &[] };

    /// How many they are.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }
}

/// Rows that were read ahead: they stay in the processor's nearer memory.
pub(super) const ROWS: usize = 512;

/// Rows of which t, r, y and u are finite numbers and of which nothing else is read, in columns of one length; what was handed on of them.
#[derive(Debug, Default)]
pub(super) struct Stretch {
    lines: Vec<u64>,
    stamps: Vec<Stamp>,
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
    /// When the rows that were handed on together were taken, s.
    pub t_s: Vec<f64>,
    next: usize,
}

impl Stretch {
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// Whether every row was handed on.
    pub fn is_used_up(&self) -> bool {
        self.next >= self.len()
    }

    /// Makes room for other rows.
    pub fn clear(&mut self) {
        self.lines.clear();
        self.stamps.clear();
        self.r.clear();
        self.y.clear();
        self.u.clear();
        self.next = 0;
    }

    /// Adds rows by their lines, their stamps and r, y and u, column by column.
    pub fn extend_rows(&mut self, rows: impl Iterator<Item = (u64, Stamp, [f64; 3])> + Clone) {
        self.lines.extend(rows.clone().map(|(line, _, _)| line));
        self.stamps.extend(rows.clone().map(|(_, stamp, _)| stamp));
        self.r.extend(rows.clone().map(|(_, _, [r, _, _])| r));
        self.y.extend(rows.clone().map(|(_, _, [_, y, _])| y));
        self.u.extend(rows.map(|(_, _, [_, _, u])| u));
    }

    /// Adds the numbers of rows whose lines and stamps are to follow.
    pub fn extend(&mut self, [r, y, u]: [&[f64]; 3]) {
        self.r.extend_from_slice(r);
        self.y.extend_from_slice(y);
        self.u.extend_from_slice(u);
    }

    /// The line and the stamp of the next of them.
    #[inline]
    pub fn date(&mut self, line: u64, stamp: Stamp) {
        self.lines.push(line);
        self.stamps.push(stamp);
    }

    /// The same of rows that follow each other, the first of which is `line`.
    #[inline]
    pub fn date_all(&mut self, line: u64, stamps: impl Iterator<Item = Stamp>) -> usize {
        let known = self.stamps.len();
        self.stamps.extend(stamps);
        let count = self.stamps.len() - known;
        self.lines.extend(line..line + count as u64);
        count
    }

    /// Drops those that got none.
    pub fn keep_dated(&mut self) {
        let count = self.len();
        [&mut self.r, &mut self.y, &mut self.u].into_iter().for_each(|column| column.truncate(count));
    }

    /// Lines and stamps of the rows that come next.
    pub fn ahead(&self) -> impl Iterator<Item = (u64, Stamp)> + '_ {
        let from = self.next.min(self.len());
        let rows = self.lines.iter().zip(&self.stamps).skip(from);
        rows.map(|(line, stamp)| (*line, *stamp))
    }

    /// The next row by itself; false where there is none.
    pub fn take_one(&mut self, row: &mut Row) -> bool {
        let is_there = self.write(self.next, row);
        self.next += usize::from(is_there);
        is_there
    }

    /// The next rows together, as many as have their times in [`Self::t_s`]; the last of them is written down in `last`.
    pub fn take_timed(&mut self, last: &mut Row) {
        self.next += self.t_s.len();
        if !self.t_s.is_empty() {
            self.write(self.next - 1, last);
        }
    }

    /// What was taken last.
    pub fn taken(&self) -> Samples<'_> {
        let from = self.next.saturating_sub(self.t_s.len());
        let part = |column| <[f64]>::get(column, from..self.next).unwrap_or_default();
        Samples { t_s: &self.t_s, r: part(&self.r), y: part(&self.y), u: part(&self.u) }
    }

    fn write(&self, at: usize, row: &mut Row) -> bool {
        let (Some(line), Some(stamp)) = (self.lines.get(at), self.stamps.get(at)) else { return false };
        let value = |column: &[f64]| column.get(at).copied().unwrap_or(f64::NAN);
        (row.line, row.stamp) = (*line, *stamp);
        (row.r, row.y, row.u) = (value(&self.r), value(&self.y), value(&self.u));
        (row.manual, row.mode, row.good) = (false, f64::NAN, None);
        row.extra.clear();
        true
    }
}
