//! The part of a recording in which the loop is closed.

use super::{Recording, RowState};

impl Recording {
    /// Keeps the longest stretch in which the loop is closed: by hand u follows no law, and the law starts anew afterwards.
    /// Hands back the times of its first and last sample, s; `None` where all or nothing of the recording is closed, which
    /// is then left as it is.
    pub fn keep_longest_closed(&mut self) -> Option<(f64, f64)> {
        let is_closed = |state: &RowState| *state != RowState::Manual;
        let (mut longest, mut from) = (0..0, 0);
        for (end, state) in self.state.iter().chain([&RowState::Manual]).enumerate() {
            if !is_closed(state) {
                if end - from > longest.len() {
                    longest = from..end;
                }
                from = end + 1;
            }
        }
        if longest.len() == self.len() || longest.is_empty() {
            return None;
        }
        let (first_s, last_s) = (self.time_s(longest.start), self.time_s(longest.end - 1));
        let signals = [&mut self.r, &mut self.y, &mut self.u].into_iter();
        for values in signals.chain(self.extra.iter_mut().map(|(_, values)| values)) {
            values.truncate(longest.end);
            values.drain(..longest.start);
        }
        self.state.truncate(longest.end);
        self.state.drain(..longest.start);
        self.start_s = first_s;
        Some((first_s, last_s))
    }
}
