//! A climb to a narrow peak by random steps that shrink where they miss: for numbers along which a likelihood is neither smooth nor wide, those of a valve that
//! sticks say.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::physics::Kind;

/// By how much the deviation of the steps grows where one helps, and shrinks where none does.
const WIDER: f64 = 1.3;
const NARROWER: f64 = 0.93;

/// How a climb is made.
#[derive(Debug, Clone, Copy)]
pub struct Steps {
    /// How many.
    pub count: usize,
    /// Deviation of the logarithm of a number's step at first, and at most.
    pub reach: f64,
    /// They are drawn from this.
    pub seed: u64,
}

/// The best of random steps from a kind's numbers, each away from or towards where that number does nothing; with what it is worth.
pub fn climb(
    kind: &Kind,
    from: (Vec<f64>, f64),
    steps: Steps,
    worth: impl Fn(&[f64]) -> Option<f64>,
) -> (Vec<f64>, f64) {
    let mut random = ChaCha8Rng::seed_from_u64(steps.seed);
    let mut reach = steps.reach;
    let mut best = from;
    for _ in 0..steps.count {
        let numbers = kind.parameters.iter().zip(&best.0);
        let moved = numbers.map(|(parameter, value)| {
            let draw: f64 = StandardNormal.sample(&mut random);
            parameter.neutral + libm::exp(reach * draw) * (value - parameter.neutral)
        });
        let moved: Vec<f64> = moved.collect();
        match worth(&moved) {
            Some(better) if better > best.1 => {
                best = (moved, better);
                reach = (WIDER * reach).min(steps.reach);
            }
            _ => reach *= NARROWER,
        }
    }
    best
}
