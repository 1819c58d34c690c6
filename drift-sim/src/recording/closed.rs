//! Where the loop is closed.

use super::{Recording, RowState};

impl Recording {
    /// Keeps the longest stretch in which the loop is closed: by hand u follows no law, and the law starts anew afterwards. Where something
    /// was left out, the times of the first and the last sample that are kept, s.
    pub fn keep_longest_closed(&mut self) -> Option<(f64, f64)> {
        let (mut longest, mut from) = (0..0, 0);
        for (end, state) in self.state.iter().chain([&RowState::Manual]).enumerate() {
            if *state == RowState::Manual {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_stretch_between_hands_is_kept_with_its_time() {
        use RowState::{Manual, Missing, Valid};
        let state = vec![Valid, Manual, Valid, Missing, Valid, Manual, Valid, Valid];
        let ramp: Vec<f64> = (0..8).map(f64::from).collect();
        let mut recording = Recording {
            sample_time_s: 0.5,
            start_s: 10.0,
            r: ramp.clone(),
            y: ramp.clone(),
            u: ramp.clone(),
            state,
            extra: vec![("x".into(), ramp)],
            ..Recording::default()
        };
        assert_eq!(recording.keep_longest_closed(), Some((11.0, 12.0)));
        assert_eq!((recording.start_s, &recording.y), (11.0, &vec![2.0, 3.0, 4.0]));
        assert_eq!(
            (&recording.extra[0].1, &recording.state),
            (&vec![2.0, 3.0, 4.0], &vec![Valid, Missing, Valid])
        );
        assert_eq!(recording.keep_longest_closed(), None);
    }
}
