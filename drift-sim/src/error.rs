//! One error: where, what, and what is allowed, in one line.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// The result of everything in this crate that input can make fail.
pub type Result<T> = std::result::Result<T, Error>;

/// Why input was refused. Its `Display` is one line, `file:line: what; what is allowed`, with the parts that
/// are not known left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    file: Option<PathBuf>,
    line: Option<u64>,
    what: String,
    allowed: Option<String>,
}

impl Error {
    /// What is wrong, in a few words without a full stop.
    pub fn new(what: impl Into<String>) -> Self {
        Self { file: None, line: None, what: what.into(), allowed: None }
    }

    /// What the system says of a file that `can't be read`, `can't be written` ..., in plain words.
    pub fn of_file(cannot: &str, error: &io::Error) -> Self {
        let (why, allowed) = match error.kind() {
            io::ErrorKind::NotFound => ("there is no such file", "check its name and its folder"),
            io::ErrorKind::PermissionDenied => ("access is denied", "check who may use it"),
            io::ErrorKind::IsADirectory => ("it is a folder", "name a file in it"),
            _ => return Self::new(format!("{cannot}: {}", without_code(&error.to_string()))),
        };
        Self::new(format!("{cannot}: {why}")).allowed(allowed)
    }

    /// What would have been right.
    #[must_use]
    pub fn allowed(mut self, allowed: impl Into<String>) -> Self {
        self.allowed = Some(allowed.into());
        self
    }

    /// The file that it was found in; an earlier, more exact word on it stays.
    #[must_use]
    pub fn in_file(mut self, file: impl AsRef<Path>) -> Self {
        self.file.get_or_insert_with(|| file.as_ref().to_path_buf());
        self
    }

    /// The line (from 1) that it was found on; an earlier, more exact word on it stays.
    #[must_use]
    pub fn at_line(mut self, line: u64) -> Self {
        self.line.get_or_insert(line);
        self
    }

    /// The line, where it is known.
    pub fn line(&self) -> Option<u64> {
        self.line
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, self.line) {
            (Some(file), Some(line)) => write!(f, "{}:{line}: ", file.display())?,
            (Some(file), None) => write!(f, "{}: ", file.display())?,
            (None, Some(line)) => write!(f, "line {line}: ")?,
            (None, None) => {}
        }
        f.write_str(&one_line(&self.what))?;
        match &self.allowed {
            Some(allowed) => write!(f, "; {}", one_line(allowed)),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Error {}

/// The system's own words without the number of the error.
fn without_code(text: &str) -> &str {
    text.split_once(" (os error").map_or(text, |(words, _)| words)
}

/// Messages quote input: a line break or a terminal's control code in it must not reach the terminal.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_one_line_with_file_line_what_and_allowed() {
        let error = Error::new("unknown key 'kpp'").allowed("kp, ki").at_line(7).in_file("loop.toml");
        assert_eq!(error.to_string(), "loop.toml:7: unknown key 'kpp'; kp, ki");
    }

    #[test]
    fn hostile_text_stays_on_one_line() {
        assert_eq!(Error::new("bad 'a\nb\u{1b}[2J'").to_string(), "bad 'a b [2J'");
    }

    #[test]
    fn a_file_that_is_not_there_is_told_in_plain_words() {
        let missing = std::fs::File::open("no such file").unwrap_err();
        let text = Error::of_file("can't be read", &missing).in_file("a.csv").to_string();
        assert_eq!(text, "a.csv: can't be read: there is no such file; check its name and its folder");
        let full = Error::of_file("can't be written", &io::Error::from_raw_os_error(28)).to_string();
        assert!(full.starts_with("can't be written: ") && !full.contains("os error"), "{full}");
    }

    #[test]
    fn the_first_place_named_is_kept() {
        let error = Error::new("x").at_line(3).at_line(9).in_file("a").in_file("b");
        assert_eq!(error.to_string(), "a:3: x");
    }
}
