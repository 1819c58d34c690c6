//! What says where a row belongs in time: its stamp on a grid, its stamp between samples that are asked for, or its number alone.

use std::collections::VecDeque;

use super::ReadOptions;
use super::resample::Resampler;
use super::row::{Row, Rows};
use super::sampling::{Grid, one_row};
use crate::{Error, Result};

/// What says where a row belongs in time.
pub(super) enum Pacing {
    /// There are no time stamps: one row, one sample.
    Given(f64),
    Grid(Grid),
    Resampled(Box<Resampler>, f64),
}

impl Pacing {
    /// That of a recording whose first rows are these, and when it begins, s.
    ///
    /// # Errors
    /// There are too few rows, nothing tells their time, or their stamps are on no grid.
    pub fn begin(rows: &dyn Rows, head: &VecDeque<Row>, options: &ReadOptions) -> Result<(Self, f64)> {
        let Some(first) = head.front() else {
            return Err(Error::new("no rows of data, only a header"));
        };
        let start_s = if rows.has_time() { first.stamp.t_s } else { 0.0 };
        let pacing = match (rows.has_time(), options.sample_time_s, options.resample_s) {
            (_, _, _) if head.len() < 2 => return Err(one_row()),
            (false, _, Some(_)) => return Err(Error::new("no time stamps to resample by")),
            (false, Some(sample_time_s), None) => Self::Given(sample_time_s),
            (false, None, None) => return Err(Error::new("neither time stamps nor a sample time")),
            (true, _, Some(step_s)) => Self::Resampled(Box::new(Resampler::new(head, step_s)?), step_s),
            (true, given, None) => {
                let stamps: Vec<_> = head.iter().map(|row| (row.line, row.stamp)).collect();
                Self::Grid(Grid::establish(&stamps, given)?)
            }
        };
        Ok((pacing, start_s))
    }
}
