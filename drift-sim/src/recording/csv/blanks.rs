//! Runs of blanks as one separator: the columns of a text that is lined up for people.

use std::io::{self, Read};

/// What separates the columns afterwards.
pub(super) const SEPARATOR: u8 = b'\t';

/// The text with one separator for each run of blanks, none at the ends of lines; quoted blanks stay.
pub(super) fn collapsed<R: Read>(source: R) -> impl Read {
    let raw = vec![0; 1 << 16];
    Collapsed { source, at_start: true, pending: false, quoted: false, raw, done: Vec::new(), given: 0 }
}

struct Collapsed<R> {
    source: R,
    at_start: bool,
    /// Blanks were seen behind a cell.
    pending: bool,
    quoted: bool,
    raw: Vec<u8>,
    /// What is collapsed, and how much of it was handed on.
    done: Vec<u8>,
    given: usize,
}

impl<R> Collapsed<R> {
    fn collapse(&mut self, count: usize) {
        self.done.clear();
        self.given = 0;
        for byte in self.raw.get(..count).unwrap_or_default() {
            if matches!(byte, b' ' | b'\t' | b'\r') && !self.quoted {
                self.pending = !self.at_start;
                continue;
            }
            if *byte == b'\n' {
                self.pending = false;
            }
            self.at_start = *byte == b'\n';
            self.quoted ^= *byte == b'"';
            if std::mem::take(&mut self.pending) {
                self.done.push(SEPARATOR);
            }
            self.done.push(*byte);
        }
    }
}

impl<R: Read> Read for Collapsed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.given == self.done.len() {
            match self.source.read(&mut self.raw)? {
                0 => return Ok(0),
                count => self.collapse(count),
            }
        }
        let left = self.done.get(self.given..).unwrap_or_default();
        let count = left.len().min(buffer.len());
        buffer[..count].copy_from_slice(&left[..count]);
        self.given += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_blanks_are_one_separator() {
        let mut text = String::new();
        let source: &[u8] = b"  t   r\t y  \r\n \n 1  \"a b\"  3\n";
        collapsed(source).read_to_string(&mut text).unwrap();
        assert_eq!(text, "t\tr\ty\n\n1\t\"a b\"\t3\n");
    }
}
