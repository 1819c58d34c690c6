//! What was wrong with a recording and what was done about it: nothing is mended in silence.

use std::fmt;

/// Counts of what was found while reading. All zero for a flawless file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Quality {
    /// Rows of data in the file.
    pub rows: u64,
    /// Samples that they became.
    pub samples: u64,
    /// Cells of r that were empty, NaN or infinite.
    pub missing_r: u64,
    /// Cells of y that were empty, NaN or infinite.
    pub missing_y: u64,
    /// Cells of u that were empty, NaN or infinite.
    pub missing_u: u64,
    /// Rows where a `when` condition did not hold.
    pub manual: u64,
    /// Places where the time stamps jump by a whole number of samples.
    pub gaps: u64,
    /// Samples that were filled in there, as missing.
    pub gap_samples: u64,
    /// Rows that repeated the one before to the letter, time stamp and all, and were dropped.
    pub duplicates: u64,
    /// Rows that were left out because they are no samples: cut off, or words.
    pub left_out: u64,
    /// Lines with nothing on them, or only a comment.
    pub blank_lines: u64,
    /// How finely the time stamps are written, s (0 where there are none).
    pub time_resolution_s: f64,
    /// Greatest distance of a time stamp from the uniform grid, s.
    pub time_deviation_max_s: f64,
    /// The line of that time stamp (0 where there is none).
    pub time_deviation_max_line: u64,
    /// The jitter that resampling removed; `None` where nothing was resampled.
    pub resampled: Option<Jitter>,
    /// Further columns that were left out because they hold text.
    pub text_columns: Vec<String>,
    /// What was chosen on the way and a person should know, a line each: names guessed, what time 0 is.
    pub notes: Vec<String>,
}

/// How unequal the intervals between the first (up to 10 000) time stamps are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jitter {
    /// The median interval, s.
    pub interval_s: f64,
    /// Root mean square of interval minus median, s.
    pub rms_s: f64,
    /// The greatest difference, s.
    pub max_s: f64,
    /// The line that ends the interval where it is greatest.
    pub max_line: u64,
}

impl fmt::Display for Jitter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { interval_s, rms_s, max_s, max_line } = self;
        write!(f, "interval {} s, jitter {} s rms", short(*interval_s), short(*rms_s))?;
        write!(f, " and at most {} s, at line {max_line}", short(*max_s))
    }
}

impl fmt::Display for Quality {
    /// One line: the samples, then only what was found.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} samples from {} rows", self.samples, self.rows)?;
        for (count, what) in [
            (self.missing_r, "missing in r"),
            (self.missing_y, "missing in y"),
            (self.missing_u, "missing in u"),
            (self.manual, "in manual"),
            (self.gap_samples, "filled in gaps"),
            (self.duplicates, "duplicates dropped"),
            (self.left_out, "left out"),
            (self.blank_lines, "blank lines"),
        ] {
            if count > 0 {
                write!(f, ", {count} {what}")?;
            }
        }
        if let Some(jitter) = &self.resampled {
            write!(f, ", resampled from {jitter}")?;
        }
        if !self.text_columns.is_empty() {
            write!(f, ", without the text in {}", self.text_columns.join(", "))?;
        }
        Ok(())
    }
}

/// Three significant digits, as a person writes them.
pub(super) fn short(x: f64) -> String {
    format!("{x:.2e}").parse::<f64>().map_or_else(|_| x.to_string(), super::write::number)
}
