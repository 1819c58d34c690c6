//! Writes a recording: CSV with the shortest numbers that read back exactly, whole or not at all.

use std::io::{self, Write};
use std::path::Path;

use super::Recording;
use crate::output;
use crate::shortest;
use crate::{Error, Result};

/// Writes columns of equal length under their names; NaN is an empty cell. `-` is standard output.
///
/// # Errors
/// Columns of unequal length, or the file can't be written.
pub fn write_csv(path: &Path, columns: &[(&str, &[f64])]) -> Result<()> {
    let rows = equal_length(columns)?;
    output::write_with(path, |out| write_rows(out, columns, rows))
}

/// The bytes that [`write_csv`] would write.
///
/// # Errors
/// Columns of unequal length.
pub fn csv_bytes(columns: &[(&str, &[f64])]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_rows(&mut bytes, columns, equal_length(columns)?)
        .map_err(|e| Error::new(format!("the recording can't be written: {e}")))?;
    Ok(bytes)
}

fn equal_length(columns: &[(&str, &[f64])]) -> Result<usize> {
    let rows = columns.first().map_or(0, |(_, values)| values.len());
    match columns.iter().find(|(_, values)| values.len() != rows) {
        Some((name, values)) => {
            Err(Error::new(format!("column '{name}' has {} rows", values.len())).allowed(rows.to_string()))
        }
        None => Ok(rows),
    }
}

/// Text is handed on once it is as long as this.
const BUFFER_BYTES: usize = 1 << 16;

fn write_rows(out: &mut dyn Write, columns: &[(&str, &[f64])], rows: usize) -> io::Result<()> {
    write_header(out, columns.iter().map(|(name, _)| *name))?;
    let mut text = Vec::with_capacity(2 * BUFFER_BYTES);
    for row in 0..rows {
        let cells = columns.iter().filter_map(|(_, values)| values.get(row));
        for (i, value) in cells.enumerate() {
            if i > 0 {
                text.push(b',');
            }
            push_number(&mut text, *value);
        }
        text.push(b'\n');
        if text.len() >= BUFFER_BYTES {
            out.write_all(&text)?;
            text.clear();
        }
    }
    out.write_all(&text)
}

impl Recording {
    /// Writes t, r, y, u and the further columns.
    ///
    /// # Errors
    /// As [`write_csv`].
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        let t = uniform_times_s(self.start_s, self.sample_time_s, self.len());
        let mut columns: Vec<(&str, &[f64])> =
            vec![("t", &t), ("r", &self.r), ("y", &self.y), ("u", &self.u)];
        columns.extend(self.extra.iter().map(|(name, values)| (name.as_str(), values.as_slice())));
        write_csv(path, &columns)
    }
}

/// So many times from `start_s` on, s, as a person writes them: where start and sample time have few decimals, the
/// third time is 0.3 and not 0.30000000000000004.
pub fn uniform_times_s(start_s: f64, sample_time_s: f64, count: usize) -> Vec<f64> {
    const FEW: usize = 9;
    let decimals = |x: f64| {
        let text = format!("{x}");
        text.split_once('.').map_or(0, |(_, decimals)| decimals.len())
    };
    let decimals = decimals(start_s).max(decimals(sample_time_s));
    let exact = |i: usize| start_s + i as f64 * sample_time_s;
    let rounded = |i: usize| {
        let t = exact(i);
        if decimals > FEW { t } else { format!("{t:.decimals$}").parse().unwrap_or(t) }
    };
    (0..count).map(rounded).collect()
}

fn write_header<'a>(out: &mut dyn Write, names: impl Iterator<Item = &'a str>) -> io::Result<()> {
    // The names may hold commas and quotes: the library knows how they are written.
    let mut header = ::csv::Writer::from_writer(Vec::new());
    header.write_record(names).map_err(io::Error::other)?;
    out.write_all(&header.into_inner().map_err(|e| io::Error::other(e.to_string()))?)
}

fn push_number(text: &mut Vec<u8>, x: f64) {
    if x.is_nan() {
        return;
    }
    if x == 0.0 || (1e-5..1e16).contains(&x.abs()) {
        shortest::push(text, x);
    } else {
        // Writing to memory does not fail.
        let _ = write!(text, "{x:e}");
    }
}

/// The shortest text that reads back as the same number.
pub(super) fn number(x: f64) -> String {
    let mut text = Vec::new();
    push_number(&mut text, x);
    String::from_utf8_lossy(&text).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_no_more_digits_than_the_sample_time() {
        assert_eq!(uniform_times_s(0.0, 0.1, 4), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(uniform_times_s(1.5, 1.0 / 3.0, 2), [1.5, 1.5 + 1.0 / 3.0]);
    }

    #[test]
    fn numbers_are_the_shortest_that_read_back() {
        for (x, text) in [(0.1, "0.1"), (1.0, "1"), (1e-7, "1e-7"), (1e300, "1e300"), (-2.5e-5, "-0.000025")]
        {
            assert_eq!(number(x), text);
        }
    }
}
