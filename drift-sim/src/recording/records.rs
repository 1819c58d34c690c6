//! Records of text: the cells of one row, from any format whose rows are text.

use super::Quality;
use crate::controller::Controller;
use crate::{Error, Result};

/// The cells of one record, one behind the other. Its buffers only grow.
#[derive(Debug, Default)]
pub(super) struct Record {
    bytes: Vec<u8>,
    used: usize,
    /// Where each cell ends.
    ends: Vec<usize>,
    count: usize,
    /// Why it can't be taken apart.
    broken: Option<Error>,
}

impl Record {
    /// Makes it empty.
    pub fn clear(&mut self) {
        (self.used, self.count) = (0, 0);
        self.broken = None;
    }

    /// Makes it one that can't be taken apart into cells.
    pub fn set_broken(&mut self, error: Error) {
        self.clear();
        self.broken = Some(error);
    }

    /// Why it can't be taken apart, where it can't.
    pub fn broken(&self) -> Option<&Error> {
        self.broken.as_ref()
    }

    /// Adds a cell.
    pub fn push(&mut self, cell: &[u8]) {
        self.bytes.truncate(self.used);
        self.bytes.extend_from_slice(cell);
        self.used = self.bytes.len();
        self.ends.truncate(self.count);
        self.ends.push(self.used);
        self.count += 1;
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.count
    }

    /// A cell without the blanks around it.
    pub fn get(&self, index: usize) -> Option<&[u8]> {
        let ends = self.ends.get(..self.count)?;
        let end = *ends.get(index)?;
        let start = index.checked_sub(1).and_then(|before| ends.get(before)).copied().unwrap_or(0);
        self.bytes.get(start..end).map(<[u8]>::trim_ascii)
    }

    /// All cells.
    pub fn iter(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.len()).filter_map(|index| self.get(index))
    }

    /// All cells as they stand, without what was between them.
    pub fn as_slice(&self) -> &[u8] {
        self.bytes.get(..self.used).unwrap_or_default()
    }

    /// The buffers, for a parser that fills them itself and then states what it used with [`Self::filled`].
    pub fn buffers(&mut self) -> (&mut Vec<u8>, &mut Vec<usize>) {
        (&mut self.bytes, &mut self.ends)
    }

    /// So many bytes and cells are in the buffers.
    pub fn filled(&mut self, used: usize, count: usize) {
        (self.used, self.count) = (used.min(self.bytes.len()), count.min(self.ends.len()));
    }
}

/// A source of records.
pub(super) trait Records: Send {
    /// Reads the next record; its line, `None` at the end.
    ///
    /// # Errors
    /// The source can't be read, or is broken there.
    fn next(&mut self, record: &mut Record, quality: &mut Quality) -> Result<Option<u64>>;

    /// The control law that the source itself states.
    fn stated_law(&self) -> Option<Controller> {
        None
    }

    /// Whether the program that writes them goes on in the same file when it is restarted.
    fn is_restarted(&self) -> bool {
        false
    }

    /// What a person should know of the source, a line each.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
}
