//! Loop files (`LOOP.toml`): reading with messages that name file, line and what is allowed; writing so that it reads
//! back the same.

mod read;
mod section;
mod write;

use std::io::Read;
use std::path::Path;

use crate::control_loop::Loop;
use crate::{Error, Result};

/// More than any honest loop file; a recording given by mistake is refused before it is parsed.
const LARGEST_BYTES: u64 = 10_000_000;

impl Loop {
    /// Reads a loop file; `-` is standard input.
    ///
    /// # Errors
    /// The file can't be read, or is not a sound loop: the first fault, with its line and what is allowed.
    pub fn read(path: &Path) -> Result<Self> {
        let refused = |e: std::io::Error| Error::new(format!("can't be read: {e}")).in_file(path);
        let mut bytes = Vec::new();
        if path == Path::new("-") {
            std::io::stdin().lock().take(LARGEST_BYTES + 1).read_to_end(&mut bytes).map_err(refused)?;
        } else {
            let file = std::fs::File::open(path).map_err(refused)?;
            file.take(LARGEST_BYTES + 1).read_to_end(&mut bytes).map_err(refused)?;
        }
        if bytes.len() as u64 > LARGEST_BYTES {
            return Err(Error::new("too large for a loop file").allowed("at most 10 MB").in_file(path));
        }
        let text = String::from_utf8(bytes).map_err(|e| {
            let good = e.as_bytes().get(..e.utf8_error().valid_up_to()).unwrap_or(&[]);
            let line = good.iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
            Error::new("not text").allowed("a loop file in UTF-8").at_line(line).in_file(path)
        })?;
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
