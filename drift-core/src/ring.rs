//! The closed blocks of the window, oldest first.

use heapless::Vec;

/// At most `B` blocks; a full window's oldest block makes room for a new one.
#[derive(Debug, Clone)]
pub(crate) struct Ring<T, const B: usize> {
    blocks: Vec<T, B, u8>,
    oldest: u8,
}

impl<T: Copy, const B: usize> Ring<T, B> {
    pub const fn new() -> Self {
        Self { blocks: Vec::new(), oldest: 0 }
    }

    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// Takes a block into a window of `window` blocks (1 to `B`).
    pub fn write(&mut self, block: T, window: u16) {
        // Never beyond the end: `get_mut` instead of an index leaves no path to a panic in the image.
        if self.blocks.len() < usize::from(window) {
            let _ = self.blocks.push(block);
        } else if let Some(place) = self.blocks.get_mut(usize::from(self.oldest)) {
            *place = block;
            self.oldest += 1;
            if u16::from(self.oldest) >= window {
                self.oldest = 0;
            }
        }
    }

    /// Calls `each` from the oldest block to the newest.
    pub fn for_each(&self, mut each: impl FnMut(&T)) {
        let (newer, older) = self.blocks.split_at_checked(usize::from(self.oldest)).unwrap_or((&[], &[]));
        for part in [older, newer] {
            part.iter().for_each(&mut each);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Ring;
    use std::vec::Vec;

    #[test]
    fn keeps_the_newest_blocks_in_order() {
        let mut ring = Ring::<u32, 4>::new();
        for n in 0..10u32 {
            ring.write(n, 3);
            let mut seen = Vec::new();
            ring.for_each(|&x| seen.push(x));
            assert_eq!(seen, (n.saturating_sub(2)..=n).collect::<Vec<_>>());
            assert_eq!(ring.len(), seen.len());
        }
    }
}
