//! What a baseline from finitely many windows costs. Its mean, sigma, tails and memory are estimates, so another calibration of the
//! same loop would find others; a wanted share of them (the confidence) must keep the promised run length. So the thresholds are made
//! for a loop that is a little worse than the one found: mean and sigma off by a margin, tails heavier, and a longer run
//! length. All margins are bounded and depend on the number of independent windows alone, never on what a lucky sample looks like.
//!
//! They fall with the windows' number (the run length's with its square), faster than the standard errors' root: 200 windows must keep
//! the promise nine times in ten, while after 2000 the mean run length must not exceed it by half. They were chosen by trial on
//! three loops, for one false alarm in 500 decisions of six detectors; `tests/calibration_promise.rs` measures them on other seeds and a
//! fourth loop (the numbers stand in [`super`]).
//!
//! Tried and not kept: a bootstrap of 400 simulated calibrations (a sample with light tails also simulates light ones: 83 % kept on the
//! servo; where tails look heavy it ran into its bound); a longer run length alone (exp(300/windows): 79 and 80 % kept on the paper's loop and the
//! servo, since neither a mean that is off nor a tail gets better by it); margins that fall with the root (68 to 95 % from 200 windows
//! and already 1.5 N from 2000).

use super::marginal;

/// Confidence at which the margins below are as they stand.
const CONFIDENCE: f64 = 0.9;
/// Margin of the mean, sigmas times the effective windows.
const MEAN: f64 = 12.0;
/// At most this share of the CUSUM's k: no threshold helps against a mean that is off by k.
const MOST_OF_K: f64 = 0.6;
/// Margin of the sigma, times the effective windows.
const SIGMA: f64 = 8.0;
/// Margin of the tails, as a marginal's c3, times the windows' worth for the variance.
const TAIL: f64 = 2.0;
/// Root of the logarithm of the run length's margin, times the same.
const RUN_LENGTH: f64 = 150.0;
/// Its most: beyond, the windows are too few and the warning says so.
const MOST_RUN_LENGTH: f64 = 20.0;
/// Worth of fewer windows is taken for this: a smaller one is an estimate of nothing.
const LEAST_WORTH: f64 = 25.0;

/// How wrong a baseline may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Margin {
    /// The mean, sigmas, in either direction.
    pub mean: f64,
    /// The true sigma over the found one.
    pub sigma: f64,
    /// What the tail's c3 may be larger.
    tail: f64,
}

impl Margin {
    /// A baseline that is known exactly.
    pub(super) const NONE: Self = Self { mean: 0.0, sigma: 1.0, tail: 0.0 };

    /// A limit, which lies at the normal score `g`, moved outward.
    pub(super) fn apart(self, limit: f64, g: f64) -> f64 {
        (limit + self.tail * g * (g * g - 3.0).max(0.0)) * self.sigma + self.mean * g.signum()
    }
}

/// All margins of one calibration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Caution {
    worth: f64,
    weight: f64,
}

impl Caution {
    /// `worth`: independent windows for the variance, of the channel that has fewest.
    pub(super) fn new(worth: f64, confidence: f64) -> Self {
        let deviations = |share: f64| marginal::exceeded_with(1.0 - share);
        let weight = (deviations(confidence) / deviations(CONFIDENCE)).max(0.0);
        Self { worth: worth.max(LEAST_WORTH), weight }
    }

    /// The run length to design for, over the wanted one.
    pub(super) fn run_length_factor(&self) -> f64 {
        let share = RUN_LENGTH / self.worth;
        libm::exp(self.weight * share * share).min(MOST_RUN_LENGTH)
    }

    /// Of a channel with so many independent windows for its mean.
    pub(super) fn margin(&self, k: f64, n_effective: f64) -> Margin {
        let of = |constant: f64, worth: f64| self.weight * constant / worth;
        let n_effective = n_effective.max(LEAST_WORTH);
        Margin {
            mean: of(MEAN, n_effective).min(MOST_OF_K * k),
            sigma: 1.0 + of(SIGMA, n_effective),
            tail: of(TAIL, self.worth),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caution_falls_with_the_windows_and_never_diverges() {
        let at = |worth: f64| {
            (Caution::new(worth, 0.9).run_length_factor(), Caution::new(worth, 0.9).margin(0.5, worth))
        };
        let (few, many) = (at(200.0), at(2000.0));
        assert!(few.0 > many.0 && few.1.mean > many.1.mean && few.1.tail > many.1.tail);
        assert!(many.0 < 1.1 && many.1.mean < 0.01 && many.1.sigma < 1.01);
        let (factor, margin) = at(3.0);
        assert!(factor <= MOST_RUN_LENGTH && margin.mean <= 0.3 && margin.sigma < 1.4, "{factor} {margin:?}");
    }

    #[test]
    fn without_confidence_there_is_no_caution() {
        let none = Caution::new(200.0, 0.5);
        assert!((none.run_length_factor() - 1.0).abs() < 1e-9);
        assert!(none.margin(0.5, 200.0).mean.abs() < 1e-9);
        let [some, more] = [0.9, 0.99].map(|c| Caution::new(200.0, c).margin(0.5, 200.0));
        assert!((more.mean / some.mean - 2.326 / 1.2816).abs() < 1e-3);
        // Outward on both sides.
        assert!(some.apart(3.0, 3.0) > 3.0 && some.apart(-3.0, -3.0) < -3.0);
        assert_eq!(Margin::NONE.apart(3.0, 3.0), 3.0);
    }
}
