//! A regular swing of the error: half periods between its crossings of zero that are alike in length and in area, each with the one but one
//! before it (Forsman and Stattin, "A new criterion for detecting oscillations in control loops", ECC 1999).

use super::{Kind, Stretch};

/// Two half periods of one sign are alike where length and area differ by no more than this factor.
const ALIKE: f64 = 1.5;
/// Half periods in a row that make an oscillation.
const LEAST_HALVES: u32 = 10;
/// Samples that the error's mean and its noise are taken from.
const MEMORY: u64 = 1000;
/// Standard deviations of the noise that lie beyond a crossing that counts.
const CLEAR: f64 = 2.0;
/// A half period of fewer samples is noise.
const LEAST_SAMPLES: u64 = 4;

#[derive(Debug, Clone, Copy, Default)]
struct Half {
    from_s: f64,
    to_s: f64,
    samples: u64,
    area: f64,
}

/// Looks for it.
#[derive(Debug, Clone, Default)]
pub(super) struct Oscillation {
    /// The mean of e: crossings count about it.
    level: f64,
    seen: u64,
    last_e: f64,
    /// Mean squared difference from sample to sample: twice the noise's variance.
    roughness: f64,
    is_above: bool,
    now: Half,
    /// The last two complete half periods.
    before: [Option<Half>; 2],
    alike: u32,
    from_s: f64,
    to_s: f64,
}

impl Oscillation {
    pub fn sample(&mut self, t_s: f64, e: f64) -> Option<Stretch> {
        self.seen += 1;
        let weight = 1.0 / self.seen.min(MEMORY) as f64;
        self.level += weight * (e - self.level);
        if self.seen > 1 {
            self.roughness += weight * ((e - self.last_e).powi(2) - self.roughness);
        }
        self.last_e = e;
        let d = e - self.level;
        // Noise crosses zero back and forth where the swing does once.
        let is_clear = d.abs() > CLEAR * (0.5 * self.roughness).sqrt();
        if self.now.samples == 0 || (d > 0.0) == self.is_above || !is_clear {
            if self.now.samples == 0 {
                (self.now.from_s, self.is_above) = (t_s, d > 0.0);
            }
            self.now.samples += 1;
            self.now.area += d.abs();
            self.now.to_s = t_s;
            return None;
        }
        let half =
            std::mem::replace(&mut self.now, Half { from_s: t_s, to_s: t_s, samples: 1, area: d.abs() });
        self.is_above = d > 0.0;
        self.half(half)
    }

    fn half(&mut self, half: Half) -> Option<Stretch> {
        let [other, last] = self.before;
        self.before = [last, Some(half)];
        let near = |a: f64, b: f64| a < ALIKE * b && b < ALIKE * a;
        let is_alike = other.is_some_and(|other| {
            half.samples >= LEAST_SAMPLES
                && near(half.samples as f64, other.samples as f64)
                && near(half.area, other.area)
        });
        if is_alike {
            if self.alike == 0 {
                self.from_s = other.map_or(half.from_s, |other| other.from_s);
            }
            self.alike += 1;
            self.to_s = half.to_s;
            return None;
        }
        self.end()
    }

    pub fn end(&mut self) -> Option<Stretch> {
        let halves = std::mem::take(&mut self.alike);
        let (from_s, to_s) = (self.from_s, self.to_s);
        (halves >= LEAST_HALVES).then_some(Stretch {
            kind: Kind::Oscillation,
            from_s,
            to_s,
            score: f64::from(halves),
        })
    }
}
