//! Reading a text file of our own of which nobody needs a large one: a loop, a baseline, a diagnosis.

use std::io::Read;
use std::path::Path;

use crate::{Error, Result};

const MEGABYTE: u64 = 1_000_000;

/// The text of `what`, of so many megabytes at most; `-` is standard input. Errors name the file.
///
/// # Errors
/// It can't be read, is larger, or is no text in UTF-8: with the line.
pub fn read(path: &Path, what: &str, most_megabytes: u64) -> Result<String> {
    let bytes = bytes_of(path, most_megabytes * MEGABYTE + 1)
        .map_err(|e| Error::of_file("can't be read", &e).in_file(path))?;
    if bytes.len() as u64 > most_megabytes * MEGABYTE {
        let most = format!("at most {most_megabytes} MB");
        return Err(Error::new(format!("too large for {what}")).allowed(most).in_file(path));
    }
    String::from_utf8(bytes).map_err(|e| {
        let good = e.as_bytes().get(..e.utf8_error().valid_up_to()).unwrap_or(&[]);
        let line = good.iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
        Error::new("not text").allowed(format!("{what} in UTF-8")).at_line(line).in_file(path)
    })
}

fn bytes_of(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if path == Path::new("-") {
        std::io::stdin().lock().take(most).read_to_end(&mut bytes)?;
    } else {
        std::fs::File::open(path)?.take(most).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}
