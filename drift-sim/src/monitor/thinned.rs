//! A signal of any length kept in bounded memory: the least and the greatest value of each of at most so many equal
//! stretches. When they run out, neighbours are merged and a stretch becomes twice as long.

/// Most stretches kept: enough to zoom into, and every sample of a recording of twice as many.
const STRETCHES: usize = 16_384;

#[derive(Debug, Clone, Copy)]
struct Stretch {
    t_s: f64,
    /// NaN where every value is missing.
    least: f64,
    greatest: f64,
    /// The greatest value came before the least.
    falling: bool,
}

impl Stretch {
    fn merge(&mut self, other: Self) {
        // What comes is later: the greatest is first where only the least is new, or both are old and were falling.
        let (lower, higher) = (other.least < self.least, other.greatest > self.greatest);
        self.falling = match (lower, higher) {
            (true, true) => other.falling,
            (true, false) => true,
            (false, true) => false,
            (false, false) => self.falling,
        };
        // f64::min passes a NaN over.
        self.least = self.least.min(other.least);
        self.greatest = self.greatest.max(other.greatest);
    }

    /// The two values in the order in which they came.
    fn in_order(&self) -> [f64; 2] {
        if self.falling { [self.greatest, self.least] } else { [self.least, self.greatest] }
    }
}

/// Least and greatest values over time.
#[derive(Debug, Clone)]
pub(super) struct Thinned {
    stretches: Vec<Stretch>,
    /// Values per stretch, a power of two.
    length: u64,
    in_last: u64,
}

impl Thinned {
    pub(super) fn new() -> Self {
        Self { stretches: Vec::new(), length: 1, in_last: 0 }
    }

    /// The next value; NaN where there is none.
    pub(super) fn add(&mut self, t_s: f64, value: f64) {
        let new = Stretch { t_s, least: value, greatest: value, falling: false };
        if self.in_last > 0 && self.in_last < self.length {
            if let Some(last) = self.stretches.last_mut() {
                last.merge(new);
            }
            self.in_last += 1;
            return;
        }
        if self.stretches.len() == STRETCHES {
            self.halve();
        }
        self.stretches.push(new);
        self.in_last = 1;
    }

    /// Called between whole stretches only, and their number is even.
    fn halve(&mut self) {
        let merged = self.stretches.chunks(2).filter_map(|pair| {
            let (first, rest) = pair.split_first()?;
            let mut merged = *first;
            rest.iter().for_each(|other| merged.merge(*other));
            Some(merged)
        });
        self.stretches = merged.collect();
        self.length *= 2;
    }

    /// Points of a line through them; NaN, which breaks it, where a whole stretch has no value. Signals that were fed at the
    /// same times have points at the same times.
    pub(super) fn points(&self) -> Vec<(f64, f64)> {
        if self.length == 1 {
            return self.stretches.iter().map(|s| (s.t_s, s.least)).collect();
        }
        let mut points = Vec::with_capacity(2 * self.stretches.len());
        let mut half_s = 0.0;
        for (i, stretch) in self.stretches.iter().enumerate() {
            if let Some(next) = self.stretches.get(i + 1) {
                half_s = 0.5 * (next.t_s - stretch.t_s);
            }
            let [first, second] = stretch.in_order();
            points.extend([(stretch.t_s, first), (stretch.t_s + half_s, second)]);
        }
        points
    }

    /// Values that each stretch stands for; up to 2 nothing was left out.
    pub(super) fn length(&self) -> u64 {
        self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_million_values_keep_their_spike_in_few_points() {
        let mut thinned = Thinned::new();
        for i in 0..4_000_000u32 {
            thinned.add(f64::from(i), if i == 3_777_777 { 9.0 } else { f64::from(i % 5) });
        }
        let points = thinned.points();
        assert!(points.len() <= 2 * STRETCHES, "{}", points.len());
        let spikes: Vec<_> = points.iter().filter(|p| p.1 == 9.0).collect();
        assert_eq!(spikes.len(), 1);
        assert!((spikes[0].0 - 3_777_777.0).abs() < 512.0);
    }

    #[test]
    fn a_short_signal_is_kept_as_it_is() {
        let mut thinned = Thinned::new();
        for (t, x) in [(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)] {
            thinned.add(t, x);
        }
        let points = thinned.points();
        assert_eq!((points[0], points[2]), ((0.0, 1.0), (2.0, 3.0)));
        assert!(points[1].1.is_nan());
    }
}
