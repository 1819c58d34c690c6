//! A controller output that stands at its limit while the error doesn't vanish: the loop has nothing left to give. Such samples
//! enter no index, so that no channel can say it.

use drift_core::Saturation;
use serde::Serialize;

/// The mean error counts as not vanished from so many of its noise's standard deviations on: as far out, one noisy sample in
/// twenty lies.
const VANISHED: f64 = 2.0;

/// The longest stretch of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pinned {
    /// The limit that u stood at, u units.
    pub limit: f64,
    /// Beginning, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// Mean error meanwhile, y units.
    pub mean_e: f64,
}

/// One stretch of samples at a limit.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    limit: f64,
    from_s: f64,
    to_s: f64,
    samples: f64,
    sum_e: f64,
    last_e: f64,
    /// Of squared differences from sample to sample: twice the noise's variance each.
    roughness: f64,
}

/// Looks for it, sample by sample.
#[derive(Debug, Clone)]
pub(super) struct Watch {
    limits: Option<Saturation<f32>>,
    sample_time_s: f64,
    least_s: f64,
    open: Option<Stretch>,
    longest: Option<Pinned>,
}

impl Watch {
    /// Stretches of at least `least_s` at these limits.
    pub(super) fn new(limits: Option<Saturation<f32>>, sample_time_s: f64, least_s: f64) -> Self {
        Self { limits, sample_time_s, least_s, open: None, longest: None }
    }

    /// Whether there are limits to stand at: without them no sample need be told.
    pub(super) fn looks(&self) -> bool {
        self.limits.is_some()
    }

    /// A valid sample.
    pub(super) fn sample(&mut self, t_s: f64, e: f64, u: f64) {
        let Some(limits) = self.limits else { return };
        let limit = if u as f32 >= limits.u_max {
            f64::from(limits.u_max)
        } else if u as f32 <= limits.u_min {
            f64::from(limits.u_min)
        } else {
            return self.close();
        };
        if self.open.is_some_and(|stretch| stretch.limit != limit) {
            self.close();
        }
        let to_s = t_s + self.sample_time_s;
        let fresh = Stretch { limit, from_s: t_s, to_s, samples: 0.0, sum_e: 0.0, last_e: e, roughness: 0.0 };
        let stretch = self.open.get_or_insert(fresh);
        stretch.roughness += (e - stretch.last_e).powi(2);
        stretch.sum_e += e;
        stretch.samples += 1.0;
        (stretch.last_e, stretch.to_s) = (e, to_s);
    }

    fn close(&mut self) {
        let Some(s) = self.open.take() else { return };
        let mean_e = s.sum_e / s.samples;
        let noise = (0.5 * s.roughness / s.samples).sqrt();
        let lasts = s.to_s - s.from_s;
        let longer = self.longest.is_none_or(|longest| lasts > longest.to_s - longest.from_s);
        if lasts >= self.least_s && mean_e.abs() > VANISHED * noise && longer {
            self.longest = Some(Pinned { limit: s.limit, from_s: s.from_s, to_s: s.to_s, mean_e });
        }
    }

    /// The longest stretch of the run.
    pub(super) fn finish(mut self) -> Option<Pinned> {
        self.close();
        self.longest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watched(samples: impl Iterator<Item = (f64, f64)>) -> Option<Pinned> {
        let mut watch = Watch::new(Some(Saturation { u_min: 0.0, u_max: 1.0 }), 1.0, 100.0);
        samples.enumerate().for_each(|(i, (e, u))| watch.sample(i as f64, e, u));
        watch.finish()
    }

    fn noise(i: u64) -> f64 {
        ((i * 7919) % 101) as f64 / 50.0 - 1.0
    }

    #[test]
    fn a_valve_that_is_wide_open_and_does_not_suffice() {
        let stuck = |i: u64| (2.0 + 0.3 * noise(i), if i < 50 { 0.5 } else { 1.0 });
        let found = watched((0..400).map(stuck)).unwrap();
        assert_eq!((found.limit, found.from_s, found.to_s), (1.0, 50.0, 400.0));
        assert!((found.mean_e - 2.0).abs() < 0.05);
    }

    #[test]
    fn a_limit_that_suffices_or_is_left_soon_is_no_finding() {
        assert_eq!(watched((0..400).map(|i| (0.5 * noise(i), 1.0))), None, "e vanishes");
        assert_eq!(watched((0..400).map(|i| (2.0, if i % 60 < 50 { 1.0 } else { 0.9 }))), None, "short");
        assert_eq!(watched((0..400).map(|_| (2.0, 0.5))), None, "not at a limit");
    }
}
