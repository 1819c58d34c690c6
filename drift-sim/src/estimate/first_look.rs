//! A first look at fewer samples: a search that runs over one sample in a few costs as much less, and the fits that it leads to go on over all of them. Between
//! its samples the plant moves by u's mean, and y is the mean about each sample where noise hides how y bends between them.

use super::fit::Fit;
use super::hypothesis::{Hypothesis, Point, Target};
use super::likelihood::Data;
use super::signals::Signals;

/// How many samples of recordings, of which so many are fitted, a first look takes as one where so many are enough: an odd number, for their mean is that of the
/// middle one.
pub fn coarseness(fitted: &[usize], enough: usize) -> usize {
    let longest = fitted.iter().max().copied().unwrap_or(0);
    let most = (longest / enough.max(1)).max(1);
    if most.is_multiple_of(2) { most - 1 } else { most }
}

/// Recordings in coarser samples.
pub fn coarser(recordings: &[Signals], factor: usize) -> Vec<Signals> {
    recordings.iter().map(|signals| signals.coarser(factor)).collect()
}

/// The counts of samples that such recordings show as fewer.
pub fn fewer(samples: &[usize], factor: usize) -> Vec<usize> {
    samples.iter().map(|samples| samples / factor).collect()
}

impl Data {
    /// The same recordings with a first look at them, where more samples of one are fitted than are enough to search over.
    #[must_use]
    pub fn with_first_look(self, hypothesis: &Hypothesis, enough: usize) -> Self {
        let factor = coarseness(&self.fitted, enough);
        if factor == 1 {
            return self;
        }
        let recordings = coarser(&self.recordings, factor);
        let look =
            Self::new(hypothesis, recordings, fewer(&self.fitted, factor)).with_healthy(self.healthy_from);
        self.looked_at_as(look)
    }

    /// The recordings' sample time, in seconds.
    pub(super) fn sample_time_s(&self) -> f64 {
        self.recordings.first().map_or(0.0, |signals| signals.sample_time_s)
    }
}

impl Hypothesis {
    /// The same for samples as these data have them.
    #[must_use]
    pub fn sampled_as(&self, data: &Data) -> Self {
        let mut same = self.clone();
        same.model.sample_time_s = data.sample_time_s();
        same
    }

    /// A point of another sample time's: what stays of the sensor's noise from one sample to the next is another part.
    fn resampled(&self, point: &Point, ratio: f64) -> Point {
        let mut point = point.clone();
        if let Some(x) = self.place(Target::SensorRho).and_then(|place| point.x.get_mut(place)) {
            *x = libm::atanh(libm::pow(libm::tanh(x.max(0.0)), ratio));
        }
        point
    }
}

impl Fit {
    /// The fit on the first look at the data that it is on.
    pub fn on_look(&self, data: &Data) -> Option<Self> {
        if data.has_first_look() { self.on(data.look()) } else { Some(self.clone()) }
    }

    /// The fit on the samples of other data of the same recordings; `None` where it can't be simulated there.
    pub fn on(&self, data: &Data) -> Option<Self> {
        let ratio = data.sample_time_s() / self.hypothesis.model.sample_time_s;
        let hypothesis = self.hypothesis.sampled_as(data);
        let point = if ratio == 1.0 { self.point.clone() } else { hypothesis.resampled(&self.point, ratio) };
        Self::at(&hypothesis, &point, data)
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::coarseness;
    use crate::control_loop::Loop;
    use crate::estimate::fit::Fit;
    use crate::estimate::hypothesis::{Hypothesis, Target};
    use crate::estimate::likelihood::Data;
    use crate::estimate::measure;
    use crate::estimate::noise::sequence;
    use crate::estimate::signals::Signals;
    use crate::likelihood_search::nominal;
    use crate::likelihood_search::options::Options;

    const SAMPLES: usize = 15_000;

    #[test]
    fn a_look_takes_an_odd_number_of_samples_as_one_and_no_more_than_leave_enough() {
        for (longest, factor) in [(0, 1), (999, 1), (2_999, 1), (3_000, 3), (4_999, 3), (5_000, 5)] {
            assert_eq!(coarseness(&[longest, longest / 2], 1_000), factor, "{longest}");
        }
        assert_eq!(coarseness(&[usize::MAX], usize::MAX), 1);
        assert_eq!(coarseness(&[100], 0), 99);
    }

    /// A first-order lag of 200 samples, written out: `y' = (2 u - load - y)/2`, a random load of 3 s, and a sensor of which 0.8 of the noise stays from sample to sample.
    fn lag() -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let load = sequence(SAMPLES, 0.1, libm::exp(-0.01 / 3.0), &mut random);
        let noise = sequence(SAMPLES, 0.02, 0.8, &mut random);
        let u: Vec<f64> = (0..SAMPLES).map(|n| if n / 700 % 2 == 0 { 1.0 } else { -0.6 }).collect();
        let mut level = 0.0;
        let mut y: Vec<f64> = Vec::new();
        for ((u, load), noise) in u.iter().zip(load).zip(noise) {
            y.push(level + noise);
            level += (1.0 - libm::exp(-0.01 / 2.0)) * (2.0 * u - load - level);
        }
        Signals { sample_time_s: 0.01, r: u.clone(), y, u, ..Signals::default() }
    }

    /// Plant, load and noise that a look at a fifth of the samples finds are those of all samples, the noise's part that stays by its fifth root.
    #[test]
    fn what_a_look_finds_holds_on_all_samples() {
        let text = "[loop]\nsample_time_s = 0.01\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"first-order\"\ngain = 1.7\ntime_constant_s = 2.5\n";
        let model = Loop::parse(text, "a lag").unwrap();
        let recordings = vec![lag()];
        let scales = measure::scales(&model, &recordings);
        let hypothesis = Hypothesis::nominal(&model, &scales, &Options::default().priors);
        let data =
            Data::new(&hypothesis, recordings, vec![SAMPLES]).with_first_look(&hypothesis, SAMPLES / 5);
        let look = data.look();
        assert_eq!(look.recordings[0].len(), SAMPLES / 5);
        let fit = nominal::fit(&hypothesis.sampled_as(look), look).unwrap();
        let value = |fit: &Fit, target| {
            let place = fit.hypothesis.place(target).unwrap();
            fit.hypothesis.free[place].value(fit.point.x[place])
        };
        let near = |value: f64, truth: f64, part: f64| {
            assert!((value / truth - 1.0).abs() < part, "{value} for {truth}");
        };
        let moved = fit.on(&data).unwrap();
        let mut ended = moved.clone();
        ended.descend(&data, 30, &[]);
        for of in [&moved, &ended] {
            near(value(of, Target::Plant(0)), 2.0, 0.03);
            near(value(of, Target::Plant(1)), 2.0, 0.03);
            near(libm::exp(value(of, Target::LoadTau)), 3.0, 0.5);
            near(libm::tanh(value(of, Target::SensorRho)), 0.8, 0.1);
        }
        // There and back is the same point.
        let back = moved.on(look).unwrap();
        assert!(back.point.x.iter().zip(&fit.point.x).all(|(a, b)| (a - b).abs() < 1e-9));
        // What is left to gain on all samples is little beside what the stated numbers lack.
        let stated = Fit::at(&hypothesis, &hypothesis.own_point(), &data).unwrap();
        let (lacked, left) = (stated.objective() - ended.objective(), moved.objective() - ended.objective());
        assert!(left < 0.1 * lacked, "{left} of {lacked}");
    }
}
