//! References: what the loop is asked to follow.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// A reference, sample by sample, without end. Seeded ones are the same on every machine.
#[derive(Debug, Clone)]
pub enum Reference {
    /// Always the same value.
    Constant(f64),
    /// `before` until the sample at or after a time, then `after`.
    Step {
        /// The value before.
        before: f64,
        /// The value from then on.
        after: f64,
        /// The number of samples before the step.
        at_tick: u64,
    },
    /// The paper's (its section 4): a new value from N(mean, sd) every some ticks, held between.
    Random(Box<RandomLevels>),
}

/// Random levels, each held for some ticks.
#[derive(Debug, Clone)]
pub struct RandomLevels {
    mean: f64,
    sd: f64,
    hold_ticks: u64,
    level: f64,
    left: u64,
    noise: ChaCha8Rng,
}

impl Reference {
    /// A stream apart from those of the simulation's terms under the same seed.
    const STREAM: u64 = u64::MAX;

    /// The paper's kind of reference: levels from N(mean, sd), held for `hold_ticks` (at least one).
    pub fn random(mean: f64, sd: f64, hold_ticks: u64, seed: u64) -> Self {
        let mut noise = ChaCha8Rng::seed_from_u64(seed);
        noise.set_stream(Self::STREAM);
        Self::Random(Box::new(RandomLevels {
            mean,
            sd,
            hold_ticks: hold_ticks.max(1),
            level: 0.0,
            left: 0,
            noise,
        }))
    }

    /// The paper's own: N(0.1, 1), held for 50 samples.
    pub fn paper(seed: u64) -> Self {
        Self::random(0.1, 1.0, 50, seed)
    }

    /// The first samples in full.
    pub fn take_samples(self, samples: usize) -> Vec<f64> {
        self.take(samples).collect()
    }
}

impl Iterator for Reference {
    type Item = f64;

    #[inline]
    fn next(&mut self) -> Option<f64> {
        Some(match self {
            Self::Constant(value) => *value,
            Self::Step { after, at_tick: 0, .. } => *after,
            Self::Step { before, at_tick, .. } => {
                *at_tick -= 1;
                *before
            }
            Self::Random(random) => random.next_level(),
        })
    }
}

impl RandomLevels {
    #[inline]
    fn next_level(&mut self) -> f64 {
        if self.left == 0 {
            let normal: f64 = StandardNormal.sample(&mut self.noise);
            self.level = self.mean + self.sd * normal;
            self.left = self.hold_ticks;
        }
        self.left -= 1;
        self.level
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_levels_are_held_and_have_their_mean_and_deviation() {
        let samples = Reference::random(0.1, 1.0, 50, 3).take_samples(500_000);
        assert!(samples.chunks(50).all(|level| level.iter().all(|value| *value == level[0])));
        let levels: Vec<f64> = samples.chunks(50).map(|level| level[0]).collect();
        let mean = levels.iter().sum::<f64>() / levels.len() as f64;
        let variance =
            levels.iter().map(|level| (level - mean) * (level - mean)).sum::<f64>() / levels.len() as f64;
        // 10 000 levels: the mean's own deviation is 0.01, that of the variance 0.014.
        assert!((mean - 0.1).abs() < 0.04 && (variance - 1.0).abs() < 0.06, "{mean} {variance}");
    }

    #[test]
    fn a_step_comes_at_its_tick() {
        let step = Reference::Step { before: 1.0, after: 2.0, at_tick: 2 };
        assert_eq!(step.take_samples(4), [1.0, 1.0, 2.0, 2.0]);
    }
}
