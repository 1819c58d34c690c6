//! Rows at unequal intervals put on a uniform grid, only ever on demand: y is interpolated linearly between its
//! neighbours, r, u and the further columns hold the value of the last row, as a controller's output does. Nothing is interpolated across a
//! gap of more than [`GAP_INTERVALS`] median intervals: its samples are missing.

use std::collections::VecDeque;

use super::quality::{Jitter, short};
use super::row::{Row, repeats};
use super::sampling::{GAP_INTERVALS, forward_steps, goes_back, jitter, median, same_time};
use super::stamp::Stamp;
use crate::{Error, Result};

/// Samples that one gap may be filled with, and samples between two rows.
const SAMPLES_MAX: f64 = 1e8;
/// A sample this near to a row, in samples, is that row, but for arithmetic.
const SLACK: f64 = 1e-6;

/// The grid start, start + DT, ... between the row before it and the row after.
pub(super) struct Resampler {
    step_s: f64,
    interval_s: f64,
    start_s: f64,
    /// Of the next sample.
    index: u64,
    before: Row,
    after: Option<Row>,
    pub jitter: Jitter,
    pub gaps: u64,
    pub gap_samples: u64,
    pub duplicates: u64,
}

/// One sample on the new grid.
pub(super) struct Resampled {
    pub t_s: f64,
    pub y: f64,
    pub in_gap: bool,
}

impl Resampler {
    /// Starts from the first rows, which say what interval is usual.
    pub fn new(head: &VecDeque<Row>, step_s: f64) -> Result<Self> {
        let stamps: Vec<(u64, Stamp)> = head.iter().map(|row| (row.line, row.stamp)).collect();
        let steps = forward_steps(&stamps)?;
        let (Some(interval_s), Some(jitter), Some(first)) = (median(&steps), jitter(&steps), head.front())
        else {
            return Err(same_time(stamps.len(), stamps.first().map_or(0.0, |(_, stamp)| stamp.t_s)));
        };
        Ok(Self {
            step_s,
            interval_s,
            start_s: first.stamp.t_s,
            index: 0,
            before: first.clone(),
            after: None,
            jitter,
            gaps: 0,
            gap_samples: 0,
            duplicates: 0,
        })
    }

    /// The row whose r, u and further columns hold now.
    pub fn held(&self) -> &Row {
        &self.before
    }

    /// The next sample, with `next_row` asked for as many rows as it takes to reach it.
    pub fn next(&mut self, mut next_row: impl FnMut(&mut Row) -> Result<bool>) -> Result<Option<Resampled>> {
        let t_s = self.start_s + self.index as f64 * self.step_s;
        let slack = SLACK * self.step_s;
        loop {
            if let Some(after) = &self.after {
                if after.stamp.t_s > t_s + slack {
                    break;
                }
                let after = self.after.take().unwrap_or_default();
                self.before = after;
            }
            if self.before.stamp.t_s >= t_s - slack {
                break;
            }
            let mut row = Row::default();
            if !next_row(&mut row)? {
                return if self.index < 2 { Err(self.too_long_a_step()) } else { Ok(None) };
            }
            if !self.accept(&row)? {
                continue;
            }
            self.after = Some(row);
        }
        self.index += 1;
        Ok(Some(self.between(t_s)))
    }

    /// Whether the row brings something new; it may not go back in time.
    fn accept(&mut self, row: &Row) -> Result<bool> {
        let (from, to) = (self.before.stamp.t_s, row.stamp.t_s);
        if to < from {
            return Err(goes_back(from, to, row.line));
        }
        if to > from && (to - from) / self.step_s > SAMPLES_MAX {
            return Err(Error::new(format!(
                "{from} to {to} s is more than 1e8 samples of {} s",
                self.step_s
            ))
            .at_line(row.line));
        }
        if to > from {
            self.gaps += u64::from(to - from > self.gap_s());
            return Ok(true);
        }
        repeats(&self.before, row)?;
        self.duplicates += 1;
        Ok(false)
    }

    fn too_long_a_step(&self) -> Error {
        let length = short(self.before.stamp.t_s - self.start_s);
        let step = short(self.step_s);
        Error::new(format!("a grid of {step} s has one sample in the {length} s of this recording"))
            .allowed(format!("--resample with {length} or less"))
    }

    fn gap_s(&self) -> f64 {
        (GAP_INTERVALS * self.interval_s).max(GAP_INTERVALS * self.step_s)
    }

    fn between(&mut self, t_s: f64) -> Resampled {
        let on_row = t_s - self.before.stamp.t_s <= SLACK * self.step_s;
        let Some(after) = self.after.as_ref().filter(|_| !on_row) else {
            return Resampled { t_s, y: self.before.y, in_gap: false };
        };
        let span_s = after.stamp.t_s - self.before.stamp.t_s;
        let in_gap = span_s > self.gap_s();
        self.gap_samples += u64::from(in_gap);
        let share = (t_s - self.before.stamp.t_s) / span_s;
        Resampled { t_s, y: self.before.y + share * (after.y - self.before.y), in_gap }
    }
}
