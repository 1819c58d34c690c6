//! A quality that is written as a code of OPC: good from 192 on. A file without any such code among its first rows counts something else,
//! and all of its rows count.

use super::Quality;
use super::read_ahead::ReadAhead;
use super::row::{Filter, Row, Rows};
use crate::Result;

/// The rows, those of a bad quality marked as manual.
pub(super) fn judged(rows: Box<dyn Rows>) -> Box<dyn Rows> {
    if rows.choice().quality().is_none() {
        return rows;
    }
    Box::new(QualityCodes { rows: ReadAhead::of(rows), are_codes: false, dropped: false })
}

struct QualityCodes {
    rows: ReadAhead,
    are_codes: bool,
    /// A row did not count.
    dropped: bool,
}

impl Filter for QualityCodes {
    fn source(&self) -> &dyn Rows {
        self.rows.source()
    }

    fn note(&self) -> Option<String> {
        let name = self.source().choice().quality().filter(|_| self.dropped)?;
        Some(format!(
            "rows where '{name}' is below 192 don't count: these codes of OPC are no good ones (--when \"{name}>=192\" or \
             --when always says otherwise)"
        ))
    }

    fn read(&mut self, row: &mut Row, quality: &mut Quality) -> Result<bool> {
        if let Some(head) = self.rows.begin(quality) {
            self.are_codes = head.iter().any(|row| row.good == Some(true));
        }
        if !self.rows.next_row(row, quality)? {
            return Ok(false);
        }
        if self.are_codes && row.good == Some(false) {
            (row.manual, self.dropped) = (true, true);
        }
        Ok(true)
    }
}
