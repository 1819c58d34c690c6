//! How much memory the reading of one recording may take, whatever its format: a small file can ask for a lot.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::{Error, Result};

/// What a recording may take where nobody says otherwise: 40 million samples of r, y and u, which is 11 hours at
/// 1 kHz.
pub const MEMORY_LIMIT_BYTES: u64 = 2 << 30;
/// What a sample of r, y and u takes, bytes: three numbers and a state, in lists that grow by doubling.
pub const SAMPLE_BYTES: u64 = 50;
/// Bytes asked for at a time while a source of unknown length is read.
const STEP_BYTES: usize = 1 << 20;

/// The memory that is left; all clones share it.
#[derive(Debug, Clone)]
pub(super) struct Budget {
    limit_bytes: u64,
    taken_bytes: Arc<AtomicU64>,
}

impl Budget {
    pub fn of(limit_bytes: u64) -> Self {
        Self { limit_bytes, taken_bytes: Arc::new(AtomicU64::new(0)) }
    }

    /// Takes so many bytes, before they are asked of the system.
    ///
    /// # Errors
    /// There are not so many left.
    pub fn take(&self, bytes: u64) -> Result<()> {
        let taken = self.taken_bytes.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
        if taken <= self.limit_bytes {
            return Ok(());
        }
        self.give_back(bytes);
        Err(self.exceeded())
    }

    /// What is left.
    #[cfg(feature = "matlab73")]
    pub fn left_bytes(&self) -> u64 {
        self.limit_bytes.saturating_sub(self.taken_bytes.load(Ordering::Relaxed))
    }

    /// Returns what was taken for a time.
    pub fn give_back(&self, bytes: u64) {
        self.taken_bytes.fetch_sub(bytes, Ordering::Relaxed);
    }

    fn exceeded(&self) -> Error {
        let limit = shown_bytes(self.limit_bytes);
        Error::new(format!("reading it takes more than {limit} of memory"))
            .allowed("a larger --memory-limit, fewer columns, or a part of the recording")
    }

    /// Checks that so many samples, on each of which the work takes so many bytes, are within the limit.
    ///
    /// # Errors
    /// They are not; said with how many are.
    pub fn check_work(&self, bytes: u64, count: u64) -> Result<()> {
        let most = self.limit_bytes / (bytes + SAMPLE_BYTES);
        if bytes == 0 || count <= most {
            return Ok(());
        }
        let limit = shown_bytes(self.limit_bytes);
        Err(Error::new(format!("more than {most} samples, whose work takes more than {limit} of memory"))
            .allowed("a larger step of --resample, a part of the recording, or a larger --memory-limit"))
    }

    /// Adds a value to a column.
    ///
    /// # Errors
    /// The column would outgrow the budget.
    pub fn push<T>(&self, column: &mut Vec<T>, value: T) -> Result<()> {
        const FIRST: usize = 1024;
        if column.len() == column.capacity() {
            let more = column.capacity().max(FIRST);
            self.take((more * size_of::<T>()) as u64)?;
            column.reserve_exact(more);
        }
        column.push(value);
        Ok(())
    }

    /// Reads a source to its end.
    ///
    /// # Errors
    /// It can't be read, or is larger than the budget.
    pub fn read_to_end(&self, source: impl Read) -> Result<Vec<u8>> {
        self.read_up_to(source, u64::MAX, |e| Error::new(format!("can't be read: {e}")))
    }

    /// Reads at most so many bytes; `refused` says what it means that they can't be read.
    ///
    /// # Errors
    /// They can't be read, or are more than the budget.
    pub fn read_up_to(
        &self,
        mut source: impl Read,
        most: u64,
        refused: impl Fn(std::io::Error) -> Error,
    ) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        loop {
            let left = most - bytes.len() as u64;
            let step = left.min(STEP_BYTES.max(bytes.len()) as u64);
            if bytes.capacity() - bytes.len() < step as usize {
                let more = step as usize;
                self.take(more as u64)?;
                bytes.reserve_exact(more);
            }
            let before = bytes.len();
            source.by_ref().take(step).read_to_end(&mut bytes).map_err(&refused)?;
            if ((bytes.len() - before) as u64) < step || bytes.len() as u64 == most {
                return Ok(bytes);
            }
        }
    }
}

/// Bytes as a person writes them.
pub(super) fn shown_bytes(bytes: u64) -> String {
    for (unit, shift) in [("GiB", 30), ("MiB", 20), ("KiB", 10)] {
        if bytes >= 1 << shift {
            let tenths = (bytes >> (shift - 10)) * 10 / 1024;
            let fraction =
                if tenths.is_multiple_of(10) { String::new() } else { format!(".{}", tenths % 10) };
            return format!("{}{fraction} {unit}", tenths / 10);
        }
    }
    format!("{bytes} bytes")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_over_the_budget_is_refused_before_it_is_taken() {
        let budget = Budget::of(3 << 20);
        budget.take(1 << 20).unwrap();
        assert_eq!(
            budget.take(u64::MAX / 2).unwrap_err().to_string(),
            "reading it takes more than 3 MiB of memory; a larger --memory-limit, fewer columns, or a part of the \
             recording"
        );
        budget.give_back(1 << 20);
        budget.take(3 << 20).unwrap();
        let mut column = Vec::new();
        Budget::of(8 * 1024).push(&mut column, 1.0_f64).unwrap();
        assert!(Budget::of(8 * 1024 - 1).push(&mut Vec::new(), 1.0_f64).is_err());
    }

    #[test]
    fn an_endless_source_ends_at_the_budget() {
        assert!(Budget::of(10 << 20).read_to_end(std::io::repeat(0)).is_err());
        let text = vec![7_u8; 5_000_000];
        assert_eq!(Budget::of(10 << 20).read_to_end(text.as_slice()).unwrap(), text);
        let budget = Budget::of(u64::MAX);
        assert_eq!(budget.read_up_to(text.as_slice(), 3, |_| Error::new("x")).unwrap(), [7; 3]);
    }

    #[test]
    fn bytes_are_shown_short() {
        for (bytes, text) in [(5, "5 bytes"), (1 << 20, "1 MiB"), (3 << 29, "1.5 GiB"), (2000, "1.9 KiB")] {
            assert_eq!(shown_bytes(bytes), text);
        }
    }
}
