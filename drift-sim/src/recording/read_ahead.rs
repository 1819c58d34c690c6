//! The first rows, read ahead to learn from what they hold how all rows are to be understood.

use std::collections::VecDeque;

use super::Quality;
use super::row::{Row, Rows};
use super::sampling::HEAD_ROWS;
use crate::{Error, Result};

/// Rows whose first ones are looked at before the first is given on.
pub(super) struct ReadAhead {
    rows: Box<dyn Rows>,
    head: VecDeque<Row>,
    /// What broke behind them.
    failed: Option<Error>,
    is_begun: bool,
}

impl ReadAhead {
    pub fn of(rows: Box<dyn Rows>) -> Self {
        Self { rows, head: VecDeque::new(), failed: None, is_begun: false }
    }

    pub fn source(&self) -> &dyn Rows {
        self.rows.as_ref()
    }

    /// The first rows, where this is the first call.
    pub fn begin(&mut self, quality: &mut Quality) -> Option<&VecDeque<Row>> {
        if std::mem::replace(&mut self.is_begun, true) {
            return None;
        }
        while self.head.len() < HEAD_ROWS && self.failed.is_none() {
            let mut row = Row::default();
            match self.rows.read(&mut row, quality) {
                Ok(true) => self.head.push_back(row),
                Ok(false) => break,
                Err(error) => self.failed = Some(error),
            }
        }
        Some(&self.head)
    }

    /// The next row in its turn; false at the end.
    pub fn next_row(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        if let Some(read_ahead) = self.head.pop_front() {
            *row = read_ahead;
            return Ok(true);
        }
        match self.failed.take() {
            Some(error) => Err(error),
            None => self.rows.read(row, quality),
        }
    }
}
