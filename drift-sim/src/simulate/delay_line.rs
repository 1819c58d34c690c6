//! Dead time: the actuator's held output, some samples and a part of a sample late. Over one sample the delayed
//! signal is a step: the older value for the first `part` of it, then the newer.

/// A ring of held values.
#[derive(Debug, Clone)]
pub(super) struct DelayLine {
    ring: Vec<f64>,
    newest: usize,
    whole: usize,
    /// The part of a sample, in [0, 1), for which the older value still holds.
    pub part: f64,
}

/// A delay in whole samples and a part of one. A ten-millionth of a sample is rounding of the quotient.
pub(super) fn split(delay_s: f64, sample_time_s: f64) -> (f64, f64) {
    let samples = delay_s / sample_time_s;
    let whole = libm::floor(samples + 1e-7);
    (whole, (samples - whole).max(0.0))
}

impl DelayLine {
    /// Room for `longest` whole samples.
    pub fn new(longest: usize) -> Self {
        Self { ring: vec![0.0; longest + 2], newest: 0, whole: 0, part: 0.0 }
    }

    /// From now on this late; not more than there is room for.
    pub fn set(&mut self, whole: usize, part: f64) {
        self.whole = whole.min(self.ring.len().saturating_sub(2));
        self.part = part;
    }

    /// Whether a value leaves as it comes in, so that none has to be kept.
    #[inline]
    pub fn is_short(&self) -> bool {
        self.whole == 0 && self.part == 0.0
    }

    /// As if the value had been held for ever.
    pub fn fill(&mut self, value: f64) {
        self.ring.fill(value);
    }

    /// The value that leaves first.
    pub fn first(&self) -> f64 {
        self.back(self.whole)
    }

    /// Takes in the newest value; gives what leaves over this sample: (older, newer).
    #[inline]
    pub fn push(&mut self, value: f64) -> (f64, f64) {
        self.newest = if self.newest + 1 == self.ring.len() { 0 } else { self.newest + 1 };
        if let Some(slot) = self.ring.get_mut(self.newest) {
            *slot = value;
        }
        if self.part == 0.0 {
            let newer = self.back(self.whole);
            return (newer, newer);
        }
        (self.back(self.whole + 1), self.back(self.whole))
    }

    #[inline]
    fn back(&self, samples: usize) -> f64 {
        let index = if samples > self.newest {
            self.newest + self.ring.len() - samples
        } else {
            self.newest - samples
        };
        self.ring.get(index).copied().unwrap_or(0.0)
    }
}
