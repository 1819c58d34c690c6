//! A slow random load beside a recorded loop.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// So many samples of a load of this deviation, of which this part stays from one sample to the next. It begins at nothing.
pub fn random_load(samples: usize, deviation: f64, stays: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut load = 0.0;
    let next = |_| {
        let normal: f64 = StandardNormal.sample(&mut random);
        load = stays * load + deviation * libm::sqrt(1.0 - stays * stays) * normal;
        load
    };
    (0..samples).map(next).collect()
}
