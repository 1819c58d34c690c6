//! How soon a CUSUM would show a lasting shift behind a relation: simulated on a process that is correlated as the relation's residuals
//! are, with a threshold made for it. A white residual needs a lower one, which its size alone does not tell.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::autocorrelation::autocovariances;

/// Autoregressive coefficients of the residuals.
const LAGS: usize = 3;
/// Healthy windows that are simulated for the threshold.
const HEALTHY: usize = 40_000;
/// Pieces of them that a shift is added to, and how many windows it is waited for.
const RUNS: usize = 300;
const MOST: usize = 120;
/// Windows to one false alarm: orders are compared at this.
const EVERY: usize = 300;
/// The CUSUM's reference value.
const K: f64 = 0.5;
/// The same numbers for every relation: what differs is the relation.
const SEED: u64 = 1;

/// Geometric mean of the mean windows to an alarm, over `shifts`, which set in at once and last. `response`: how many of the residual's
/// standard deviations a shift of 1 shows in the window in which it sets in and in those after, the last for good.
///
/// Deterministic; some milliseconds.
pub(super) fn of_shifts(residuals: &[f64], response: &[f64], shifts: &[f64]) -> f64 {
    let healthy = Process::like(residuals).windows();
    let h = threshold(&healthy);
    let logarithms = shifts.iter().map(|&shift| mean_delay(&healthy, h, response, shift).ln());
    (logarithms.sum::<f64>() / shifts.len() as f64).exp()
}

/// An autoregression of variance 1.
struct Process {
    coefficients: [f64; LAGS],
    /// Of what is new in a window.
    deviation: f64,
}

impl Process {
    /// By the residuals' autocovariances (Levinson 1947, Durbin 1960).
    fn like(residuals: &[f64]) -> Self {
        let covariances = autocovariances(&[residuals], LAGS);
        let variance = covariances.first().copied().filter(|c| *c > 0.0).unwrap_or(1.0);
        let correlation = |lag: usize| covariances.get(lag).map_or(0.0, |c| c / variance);
        let (mut of, mut left) = ([0.0; LAGS], 1.0);
        for m in 0..LAGS {
            let known: f64 = (0..m).map(|i| of[i] * correlation(m - i)).sum();
            let reflection = ((correlation(m + 1) - known) / left).clamp(-0.95, 0.95);
            let before = of;
            of[m] = reflection;
            for i in 0..m {
                of[i] = before[i] - reflection * before[m - 1 - i];
            }
            left *= 1.0 - reflection * reflection;
        }
        Self { coefficients: of, deviation: left.sqrt() }
    }

    fn windows(&self) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let mut before = [0.0; LAGS];
        let mut next = || {
            let shock: f64 = StandardNormal.sample(&mut random);
            let known: f64 = self.coefficients.iter().zip(&before).map(|(a, z)| a * z).sum();
            before.rotate_right(1);
            before[0] = known + self.deviation * shock;
            before[0]
        };
        (0..HEALTHY).map(|_| next()).collect()
    }
}

/// Two-sided CUSUM.
#[derive(Default)]
struct Sums {
    high: f64,
    low: f64,
}

impl Sums {
    /// Whether it alarms, after which it starts anew.
    fn alarms(&mut self, z: f64, h: f64) -> bool {
        (self.high, self.low) = ((self.high + z - K).max(0.0), (self.low - z - K).max(0.0));
        let alarms = self.high > h || self.low > h;
        if alarms {
            *self = Self::default();
        }
        alarms
    }
}

/// The threshold with one alarm in [`EVERY`] of these windows.
fn threshold(healthy: &[f64]) -> f64 {
    let (mut low, mut high) = (0.5, 60.0);
    for _ in 0..18 {
        let h = 0.5 * (low + high);
        let mut sums = Sums::default();
        let alarms = healthy.iter().filter(|z| sums.alarms(**z, h)).count();
        if alarms * EVERY > healthy.len() { low = h } else { high = h }
    }
    high
}

fn mean_delay(healthy: &[f64], h: f64, response: &[f64], shift: f64) -> f64 {
    let last = response.last().copied().unwrap_or(1.0);
    let delay = |piece: &[f64]| {
        let mut sums = Sums::default();
        let responses = response.iter().copied().chain(std::iter::repeat(last));
        let found = piece.iter().take(MOST).zip(responses).position(|(z, r)| sums.alarms(z + shift * r, h));
        found.map_or(MOST, |at| at + 1)
    };
    let pieces = healthy.chunks_exact(HEALTHY / RUNS);
    let runs = pieces.len() as f64;
    pieces.map(delay).sum::<usize>() as f64 / runs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White residuals: the known mean delays of CUSUM(0.5) with one false alarm in 300 (h = 4.57), 8.9 windows to one sigma, 2.3 to three.
    #[test]
    fn white_residuals_give_the_known_delays() {
        let white = Process { coefficients: [0.0; LAGS], deviation: 1.0 }.windows();
        let h = threshold(&white);
        assert!((4.3..4.9).contains(&h), "{h}");
        let (one, three) = (mean_delay(&white, h, &[1.0], 1.0), mean_delay(&white, h, &[1.0], 3.0));
        assert!((8.5..10.5).contains(&one) && (2.1..2.7).contains(&three), "{one} {three}");
        // Half a shift that hides after its first window is found no later than half a shift throughout.
        assert!(of_shifts(&white, &[1.0, 0.5], &[1.0]) < of_shifts(&white, &[0.5], &[1.0]));
    }

    /// A correlated residual needs a higher threshold, and finds the same shift later.
    #[test]
    fn a_correlated_residual_is_slower() {
        let correlated = Process { coefficients: [0.6, 0.0, 0.0], deviation: 0.8 }.windows();
        let white = Process { coefficients: [0.0; LAGS], deviation: 1.0 }.windows();
        let found = Process::like(&correlated);
        assert!((found.coefficients[0] - 0.6).abs() < 0.03 && (found.deviation - 0.8).abs() < 0.02);
        assert!(of_shifts(&correlated, &[1.0], &[1.0]) > 1.5 * of_shifts(&white, &[1.0], &[1.0]));
    }
}
