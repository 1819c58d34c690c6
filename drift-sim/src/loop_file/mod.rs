//! Loop files (`LOOP.toml`): reading with messages that name file, line and what is allowed; writing so that it reads
//! back the same.

mod read;
mod section;
mod write;

use std::path::Path;

use crate::control_loop::Loop;
use crate::{Result, text_file};

/// More than any honest loop file; a recording given by mistake is refused before it is parsed.
const LARGEST_MEGABYTES: u64 = 10;

impl Loop {
    /// Reads a loop file; `-` is standard input.
    ///
    /// # Errors
    /// The file can't be read, or is not a sound loop: the first fault, with its line and what is allowed.
    pub fn read(path: &Path) -> Result<Self> {
        let text = text_file::read(path, "a loop file", LARGEST_MEGABYTES)?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Reads a loop from the text of a loop file; `file_name` is for messages.
    ///
    /// # Errors
    /// The first fault, with its line and what is allowed.
    pub fn parse(text: &str, file_name: &str) -> Result<Self> {
        read::parse(text).map_err(|error| error.in_file(file_name))
    }

    /// The loop as the text of a loop file; reading it gives the same loop.
    pub fn to_toml(&self) -> String {
        write::text(self)
    }
}

#[cfg(test)]
mod tests;
