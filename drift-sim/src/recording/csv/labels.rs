//! Lines in which every value stands behind its name: `Setpoint:32.0,Input:31.8,Output:40`, `t=0.1 r=1 y=0.9 u=2`. Sketches for
//! microcontrollers and programs that print what they do write them; a time may stand before the first name.

use std::io::{self, BufRead, BufReader, Read};

use super::layout::Separator;
use crate::recording::clock::is_date_or_time;
use crate::recording::decimal::parse_number;

/// What separates the values afterwards.
pub(super) const SEPARATOR: u8 = b'\t';
/// What the column of a time without a name is called.
const TIME: &str = "time";
/// Of so many lines as hold something, this part has to be of that kind.
const MOST: f64 = 0.9;
/// A longer line is none of them.
const LINE_BYTES_MAX: u64 = 1 << 20;

/// How the lines are written: what stands between the pairs, and the names.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Labels {
    separator: Separator,
    pub names: Vec<String>,
}

impl Labels {
    /// The names that most of these lines have, and where the first of these stands among them.
    pub fn of(lines: &[&str]) -> Option<(Self, usize)> {
        let comma = [b',', b';', b'\t'].map(Separator::Byte).into_iter();
        comma.chain([Separator::Blanks]).find_map(|separator| {
            let names = |line: &&str| -> Option<Vec<String>> {
                Some(pairs(separator, line)?.into_iter().map(|(name, _)| name.to_owned()).collect())
            };
            let all: Vec<Option<Vec<String>>> = lines.iter().map(names).collect();
            let first = all.iter().position(Option::is_some)?;
            let names = all.get(first).cloned().flatten()?;
            let alike = all.iter().flatten().filter(|other| **other == names).count();
            let labels = Self { separator, names };
            (alike > 1 && alike as f64 >= MOST * (lines.len() - first) as f64).then_some((labels, first))
        })
    }

    /// The values of a line of these names, each behind a separator but the first.
    fn values(&self, line: &str) -> Option<String> {
        let pairs = pairs(self.separator, line)?;
        let same = pairs.len() == self.names.len() && pairs.iter().zip(&self.names).all(|((a, _), b)| a == b);
        let values: Vec<&str> = pairs.into_iter().map(|(_, value)| value).collect();
        same.then(|| values.join("\t"))
    }
}

/// The names and values of a line; `None` where one of its cells is no such pair.
fn pairs(separator: Separator, line: &str) -> Option<Vec<(&str, &str)>> {
    let mut found = Vec::new();
    for cell in separator.cells(line) {
        let mark = cell.rfind([':', '='])?;
        let (before, value) = (cell.get(..mark)?, cell.get(mark + 1..)?.trim());
        parse_number(value.as_bytes())?;
        let (time, name) = split_time(before);
        if !name.starts_with(|c: char| c.is_alphabetic()) {
            return None;
        }
        if let Some(time) = time {
            if !found.is_empty() {
                return None;
            }
            found.push((TIME, time));
        }
        found.push((name, value));
    }
    (found.len() > 1).then_some(found)
}

/// A time before a name, with anything but letters and digits between the two, and the name.
fn split_time(text: &str) -> (Option<&str>, &str) {
    let name_at = text.rfind(|c: char| !(c.is_alphanumeric() || "_.[]/-".contains(c)));
    let Some((before, name)) = name_at.and_then(|at| text.split_at_checked(at)) else { return (None, text) };
    let time = before.trim_end_matches(|c: char| !c.is_alphanumeric());
    let name = name.trim_start_matches(|c: char| !c.is_alphanumeric());
    if is_date_or_time(time) { (Some(time), name) } else { (None, text.trim()) }
}

/// The text with the values alone. Lines of another kind stay as they are.
pub(super) fn removed<R: Read>(source: R, labels: Labels) -> impl Read {
    Removed { source: BufReader::new(source), labels, line: Vec::new(), given: 0 }
}

struct Removed<R> {
    source: BufReader<R>,
    labels: Labels,
    /// What was read last, and how much of it was handed on.
    line: Vec<u8>,
    given: usize,
}

impl<R: Read> Removed<R> {
    fn next_line(&mut self) -> io::Result<()> {
        self.line.clear();
        self.given = 0;
        self.source.by_ref().take(LINE_BYTES_MAX).read_until(b'\n', &mut self.line)?;
        let values =
            std::str::from_utf8(&self.line).ok().and_then(|line| self.labels.values(line.trim_end()));
        if let Some(values) = values {
            let ended = self.line.ends_with(b"\n");
            self.line = values.into_bytes();
            self.line.extend(ended.then_some(b'\n'));
        }
        Ok(())
    }
}

impl<R: Read> Read for Removed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.given == self.line.len() {
            self.next_line()?;
        }
        let left = self.line.get(self.given..).unwrap_or_default();
        let count = left.len().min(buffer.len());
        for (to, from) in buffer.iter_mut().zip(left) {
            *to = *from;
        }
        self.given += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_behind_names_are_found() {
        for (lines, names, last) in [
            (["r:1,y:0.9,u:-2e1", "r:1,y:0.8,u:3"], vec!["r", "y", "u"], "1\t0.8\t3"),
            (["t=0 r=1 y=0.9 u=2", "t=0.1 r=1 y=0.8 u=3"], vec!["t", "r", "y", "u"], "0.1\t1\t0.8\t3"),
            (
                ["12:00:00.1 -> SP: 1\tPV: 2", "12:00:00.2 -> SP: 1\tPV: 3"],
                vec!["time", "SP", "PV"],
                "12:00:00.2\t1\t3",
            ),
        ] {
            let (labels, first) = Labels::of(&lines).unwrap_or_else(|| panic!("{lines:?}"));
            assert_eq!((labels.names.iter().map(String::as_str).collect::<Vec<_>>(), first), (names, 0));
            let mut text = String::new();
            removed(lines.join("\n").as_bytes(), labels).read_to_string(&mut text).unwrap();
            assert_eq!(text.lines().last(), Some(last));
        }
        for lines in
            [["t,r,y,u", "0,1,2,3"], ["a:1,b", "a:1,b"], ["12:00,1", "12:01,2"], ["r:1,y:2", "y:1,r:2"]]
        {
            assert_eq!(Labels::of(&lines), None, "{lines:?}");
        }
    }
}
