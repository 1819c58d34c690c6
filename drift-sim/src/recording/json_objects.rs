//! The texts of JSON objects in a file: one on each line, or all of them in one list, however its lines are broken.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};

use super::json_lines::open_error;
use crate::{Error, Result};

/// An object longer than this is no record.
const OBJECT_BYTES_MAX: usize = 1 << 20;
/// Bytes asked of the system at a time.
const BUFFER_BYTES: usize = 1 << 18;

/// Texts, each with the line that it begins on.
pub(super) struct Objects {
    source: BufReader<Box<dyn Read + Send>>,
    is_list: bool,
    /// Lines that were passed.
    lines: u64,
    /// What was looked at already.
    ahead: VecDeque<(Vec<u8>, u64)>,
}

impl Objects {
    pub fn of(source: Box<dyn Read + Send>, is_list: bool) -> Self {
        let source = BufReader::with_capacity(BUFFER_BYTES, source);
        Self { source, is_list, lines: 0, ahead: VecDeque::new() }
    }

    /// The next one; `None` at the end. In a text of lines it may be empty.
    ///
    /// # Errors
    /// The source can't be read, an object is too long, or a list holds something else.
    pub fn next(&mut self) -> Result<Option<(Vec<u8>, u64)>> {
        match self.ahead.pop_front() {
            Some(text) => Ok(Some(text)),
            None => self.read(),
        }
    }

    /// Looks at the next so many, which are still to come.
    ///
    /// # Errors
    /// As [`Self::next`].
    pub fn look(&mut self, count: usize) -> Result<impl Iterator<Item = (&[u8], u64)>> {
        while self.ahead.len() < count {
            let Some(text) = self.read()? else { break };
            self.ahead.push_back(text);
        }
        Ok(self.ahead.iter().map(|(text, line)| (text.as_slice(), *line)))
    }

    fn read(&mut self) -> Result<Option<(Vec<u8>, u64)>> {
        if self.is_list { self.in_list() } else { self.line() }
    }

    fn line(&mut self) -> Result<Option<(Vec<u8>, u64)>> {
        let (mut text, number) = (Vec::new(), self.lines + 1);
        let read = self.source.by_ref().take(OBJECT_BYTES_MAX as u64 + 1).read_until(b'\n', &mut text);
        read.map_err(|e| unreadable(&e).at_line(number))?;
        if text.len() > OBJECT_BYTES_MAX {
            return Err(Error::new("a line of more than 1 MiB").at_line(number));
        }
        self.lines = number;
        Ok((!text.is_empty()).then_some((text, number)))
    }

    /// The next object of a list: all from its brace to the one that closes it.
    fn in_list(&mut self) -> Result<Option<(Vec<u8>, u64)>> {
        let (mut text, mut from) = (Vec::new(), 0);
        let mut scan = Scan::default();
        loop {
            let lines = &mut self.lines;
            let buffer = self.source.fill_buf().map_err(|e| unreadable(&e).at_line(*lines + 1))?;
            if buffer.is_empty() {
                // What the file ends within is no object, which its reader says.
                return Ok((!text.is_empty()).then_some((text, from)));
            }
            let mut used = 0;
            for byte in buffer {
                used += 1;
                *lines += u64::from(*byte == b'\n');
                if scan.depth == 0 {
                    match byte {
                        b'{' => from = *lines + 1,
                        // A mark of the byte order may stand before the list.
                        b'[' | b',' | b']' | 0xef | 0xbb | 0xbf => continue,
                        blank if blank.is_ascii_whitespace() => continue,
                        _ => return Err(open_error("no object").at_line(*lines + 1)),
                    }
                }
                text.push(*byte);
                scan.pass(*byte);
                if scan.depth == 0 || text.len() > OBJECT_BYTES_MAX {
                    break;
                }
            }
            self.source.consume(used);
            if text.len() > OBJECT_BYTES_MAX {
                return Err(Error::new("an object of more than 1 MiB").at_line(from));
            }
            if !text.is_empty() && scan.depth == 0 {
                return Ok(Some((text, from)));
            }
        }
    }
}

/// Where in an object one stands.
#[derive(Default)]
pub(super) struct Scan {
    depth: u32,
    in_string: bool,
    escaped: bool,
    was_open: bool,
}

impl Scan {
    /// Whether the last brace that was passed closed the object.
    pub fn is_closed(&self) -> bool {
        self.depth == 0 && self.was_open
    }

    pub fn pass(&mut self, byte: u8) {
        if self.in_string {
            self.in_string = self.escaped || byte != b'"';
            self.escaped = !self.escaped && byte == b'\\';
            return;
        }
        match byte {
            b'"' => self.in_string = true,
            b'{' | b'[' => (self.depth, self.was_open) = (self.depth.saturating_add(1), true),
            b'}' | b']' => self.depth = self.depth.saturating_sub(1),
            _ => {}
        }
    }
}

fn unreadable(e: &std::io::Error) -> Error {
    Error::new(format!("can't be read: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(text: &'static str) -> Vec<(String, u64)> {
        let mut objects = Objects::of(Box::new(text.as_bytes()), true);
        std::iter::from_fn(|| objects.next().unwrap())
            .map(|(text, line)| (String::from_utf8(text).unwrap(), line))
            .collect()
    }

    #[test]
    fn a_list_is_taken_apart_however_its_lines_are_broken() {
        let apart = [("{\"a\": \"}\\\"{\", \"b\": [{}]}".to_owned(), 1), ("{}".to_owned(), 1)];
        assert_eq!(texts("[{\"a\": \"}\\\"{\", \"b\": [{}]},{}]"), apart);
        assert_eq!(texts("[\n {\n\"a\":1},\n\n{}\n]\n"), [("{\n\"a\":1}".into(), 2), ("{}".into(), 5)]);
        assert_eq!(texts("[]"), []);
        // A file that was cut off.
        assert_eq!(texts("[{\"a\": 1"), [("{\"a\": 1".to_owned(), 1)]);
    }

    #[test]
    fn what_is_no_list_of_objects_is_refused() {
        for (text, expected) in [("[{}, 5]", "no object"), ("[\n\nx]", "3: no object")] {
            let mut objects = Objects::of(Box::new(text.as_bytes()), true);
            let error = std::iter::from_fn(|| objects.next().transpose()).find_map(Result::err).unwrap();
            assert!(error.to_string().contains(expected), "{text}: {error}");
        }
    }
}
