//! A signal of any length kept in bounded memory: the least and the greatest value of each of at most so many equal
//! stretches. When they run out, neighbours are merged and a stretch becomes twice as long.

/// Most stretches kept: about two for each pixel of a chart.
const STRETCHES: usize = 2048;

#[derive(Debug, Clone, Copy)]
struct Stretch {
    t_s: f64,
    least: f64,
    greatest: f64,
    /// A value was missing here: the line breaks.
    broken: bool,
}

impl Stretch {
    fn merge(&mut self, other: Self) {
        // f64::min passes a NaN over.
        self.least = self.least.min(other.least);
        self.greatest = self.greatest.max(other.greatest);
        self.broken |= other.broken;
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
        let new = Stretch { t_s, least: value, greatest: value, broken: value.is_nan() };
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

    /// Points of a line through them, NaN where it breaks.
    pub(super) fn points(&self) -> Vec<(f64, f64)> {
        let mut points = Vec::with_capacity(2 * self.stretches.len());
        for stretch in &self.stretches {
            if stretch.broken {
                points.push((stretch.t_s, f64::NAN));
            }
            if !stretch.least.is_nan() {
                points.push((stretch.t_s, stretch.least));
                if stretch.greatest > stretch.least {
                    points.push((stretch.t_s, stretch.greatest));
                }
            }
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_values_keep_their_spike_in_few_points() {
        let mut thinned = Thinned::new();
        for i in 0..1_000_000u32 {
            thinned.add(f64::from(i), if i == 777_777 { 9.0 } else { f64::from(i % 5) });
        }
        let points = thinned.points();
        assert!(points.len() <= 2 * STRETCHES, "{}", points.len());
        let spikes: Vec<_> = points.iter().filter(|p| p.1 == 9.0).collect();
        assert_eq!(spikes.len(), 1);
        assert!((spikes[0].0 - 777_777.0).abs() < 1024.0);
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
