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
    let mut climber = Climber::new(from, steps);
    for _ in 0..steps.count {
        let moved = climber.moved(kind);
        let found = worth(&moved);
        climber.judge(moved, found);
    }
    climber.best
}

/// The same of several climbs, whose steps are judged together, one of each at a time.
pub fn climb_together(
    kind: &Kind,
    from: Vec<(Vec<f64>, f64)>,
    steps: Steps,
    worth: impl Fn(&[Vec<f64>]) -> Vec<Option<f64>>,
) -> Vec<(Vec<f64>, f64)> {
    let seeded = from.into_iter().zip(steps.seed..);
    let mut climbers: Vec<Climber> =
        seeded.map(|(from, seed)| Climber::new(from, Steps { seed, ..steps })).collect();
    for _ in 0..steps.count {
        let moved: Vec<Vec<f64>> = climbers.iter_mut().map(|climber| climber.moved(kind)).collect();
        let found = worth(&moved);
        for ((climber, moved), found) in climbers.iter_mut().zip(moved).zip(found) {
            climber.judge(moved, found);
        }
    }
    climbers.into_iter().map(|climber| climber.best).collect()
}

/// One climb at work.
struct Climber {
    random: ChaCha8Rng,
    reach: f64,
    most: f64,
    best: (Vec<f64>, f64),
}

impl Climber {
    fn new(from: (Vec<f64>, f64), steps: Steps) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(steps.seed),
            reach: steps.reach,
            most: steps.reach,
            best: from,
        }
    }

    /// A random step.
    fn moved(&mut self, kind: &Kind) -> Vec<f64> {
        let (reach, random) = (self.reach, &mut self.random);
        let moved = kind.parameters.iter().zip(&self.best.0).map(|(parameter, value)| {
            let draw: f64 = StandardNormal.sample(random);
            if !parameter.fitted {
                return *value;
            }
            parameter.neutral + libm::exp(reach * draw) * (value - parameter.neutral)
        });
        moved.collect()
    }

    /// What a step was worth: the climb goes on from there, or with shorter steps.
    fn judge(&mut self, moved: Vec<f64>, worth: Option<f64>) {
        match worth {
            Some(better) if better > self.best.1 => {
                self.best = (moved, better);
                self.reach = (WIDER * self.reach).min(self.most);
            }
            _ => self.reach *= NARROWER,
        }
    }
}
