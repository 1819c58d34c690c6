//! The law of one channel's standardised residual, beyond what was seen: a cubic of a normal variable,
//! `z(g) = c0 + c1 g + c2 (g^2 - 1) + c3 (g^3 - 3 g)`.
//!
//! Its coefficients are regressed on the order statistics, so they scatter little (they are close relatives of L-moments): c2 carries
//! the skewness of an index that is a sum of squares, c3 heavy or light tails. Beyond the sample the cubic is the
//! extrapolation (Cornish & Fisher's in form). Where it would bend back it goes on straight.

use crate::design;

/// Gradient, as a fraction of c1, below which the curve goes on straight.
const LEAST_GRADIENT: f64 = 0.3;
/// c3 that is usual (an excess kurtosis of a quarter), and how far loops differ in it.
const USUAL_TAIL: f64 = 0.01;
const TAIL_SPREAD: f64 = 0.02;
/// As far as a normal variable is ever asked for.
const FARTHEST: f64 = 8.0;

/// The law of a residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Marginal {
    pub c: [f64; 4],
    /// Between these the cubic holds.
    range: [f64; 2],
}

impl Marginal {
    #[cfg(test)]
    pub(super) const NORMAL: Self = Self { c: [0.0, 1.0, 0.0, 0.0], range: [-FARTHEST, FARTHEST] };

    pub(super) fn new(c: [f64; 4]) -> Self {
        let c = [c[0], c[1].max(1e-3), c[2], c[3]];
        let steep = |g: f64| c[1] + 2.0 * c[2] * g + 3.0 * c[3] * (g * g - 1.0) >= LEAST_GRADIENT * c[1];
        let reach = |sign: f64| {
            let steps = (1..=160).map(|i| sign * 0.05 * f64::from(i)).take_while(|&g| steep(g));
            steps.last().unwrap_or(0.0)
        };
        Self { c, range: [reach(-1.0), reach(1.0)] }
    }

    /// From values in rising order and the normal scores of as many; `worth`: how many independent ones they are.
    pub(super) fn fit(sorted: &[f64], scores: &[f64], worth: f64) -> Self {
        let basis = |g: f64| [1.0, g, g * g - 1.0, g * (g * g - 3.0)];
        let mut normal = nalgebra::Matrix4::<f64>::zeros();
        let mut right = nalgebra::Vector4::<f64>::zeros();
        for (z, &g) in sorted.iter().zip(scores) {
            let row = nalgebra::Vector4::from(basis(g));
            normal += row * row.transpose();
            right += row * *z;
        }
        let c = normal.cholesky().map_or(nalgebra::Vector4::new(0.0, 1.0, 0.0, 0.0), |m| m.solve(&right));
        // Few windows often look lighter- or heavier-tailed than they are, and a limit hangs on it: c3 is drawn to what indices of
        // loops usually have, as far as its own standard error leaves it open, and light tails are never believed.
        let variance = 1.0 / (24.0 * worth);
        let weight = TAIL_SPREAD * TAIL_SPREAD / (TAIL_SPREAD * TAIL_SPREAD + variance);
        let c3 = USUAL_TAIL + weight * (c[3] - USUAL_TAIL);
        Self::new([c[0], c[1], c[2], c3.max(0.0)])
    }

    pub(super) fn at(&self, g: f64) -> f64 {
        let held = g.clamp(self.range[0], self.range[1]);
        let [c0, c1, c2, c3] = self.c;
        let inside = c0 + held * (c1 + c2 * held + c3 * (held * held - 3.0)) - c2;
        inside + (g - held) * LEAST_GRADIENT * c1
    }

    /// P(z > limit).
    pub(super) fn above(&self, limit: f64) -> f64 {
        design::normal::above(self.score_of(limit))
    }

    /// P(z < limit).
    pub(super) fn below(&self, limit: f64) -> f64 {
        design::normal::below(self.score_of(limit))
    }

    fn score_of(&self, z: f64) -> f64 {
        let (mut low, mut high) = (-2.0 * FARTHEST, 2.0 * FARTHEST);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.at(middle) < z { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// The sum of all autocovariances of z, where g has these autocorrelations (lag 0 first), by Hermite's
    /// polynomials being orthogonal: `sum of c_j^2 j! rho^j`. Never less than the variance itself: where neighbours
    /// compensate each other a CUSUM still alarms on few of them, which a long run's variance knows nothing of.
    pub(super) fn long_run_variance(&self, rho: &[f64]) -> f64 {
        let [_, c1, c2, c3] = self.c;
        let at = |r: f64| c1 * c1 * r + 2.0 * c2 * c2 * r * r + 6.0 * c3 * c3 * r * r * r;
        let both: f64 = rho.iter().skip(1).map(|&r| 2.0 * at(r)).sum();
        at(1.0) + both.max(0.0)
    }

    /// Third central moment of z.
    pub(super) fn third_cumulant(&self) -> f64 {
        let [_, c1, c2, c3] = self.c;
        6.0 * c1 * c1 * c2 + 8.0 * c2 * c2 * c2 + 36.0 * c1 * c2 * c3 + 108.0 * c2 * c3 * c3
    }
}

/// The normal variable that is exceeded with probability `p`.
pub(super) fn exceeded_with(p: f64) -> f64 {
    let (mut low, mut high) = (-FARTHEST, FARTHEST);
    for _ in 0..48 {
        let middle = 0.5 * (low + high);
        if design::normal::above(middle) > p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Where `n` normal variables in rising order are to be expected (Blom 1958).
pub(super) fn scores(n: usize) -> Vec<f64> {
    (1..=n).map(|i| -exceeded_with((i as f64 - 0.375) / (n as f64 + 0.25))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chi-square of 60 degrees of freedom, standardised, fitted on 2000 of its own quantiles, against its exact tails far
    /// beyond them.
    #[test]
    fn the_tails_of_a_sum_of_squares() {
        use statrs::distribution::{ChiSquared, ContinuousCDF};
        let law = ChiSquared::new(60.0).unwrap();
        let n = 2000;
        let sorted: Vec<f64> = (1..=n)
            .map(|i| (law.inverse_cdf((f64::from(i) - 0.375) / (f64::from(n) + 0.25)) - 60.0) / 120f64.sqrt())
            .collect();
        let fitted = Marginal::fit(&sorted, &scores(n as usize), f64::from(n));
        for p in [1e-3, 1e-4, 1e-5] {
            let upper = (law.inverse_cdf(1.0 - p) - 60.0) / 120f64.sqrt();
            let lower = (law.inverse_cdf(p) - 60.0) / 120f64.sqrt();
            // A little heavier than the law: c3 is drawn to the usual one.
            assert!((fitted.above(upper) / p - 1.0).abs() < 0.12, "{p}: {}", fitted.above(upper));
            assert!((fitted.below(lower) / p - 1.0).abs() < 0.25, "{p}: {}", fitted.below(lower));
        }
    }

    #[test]
    fn the_curve_never_bends_back() {
        for c in [[0.0, 1.0, 0.3, -0.1], [0.0, 1.0, -0.4, 0.0], [0.0, 0.8, 0.0, 0.07], [0.0, 1.0, 0.0, -0.05]]
        {
            let law = Marginal::new(c);
            let values: Vec<f64> = (-80..=80).map(|i| law.at(f64::from(i) * 0.1)).collect();
            assert!(values.windows(2).all(|w| w[1] > w[0]), "{c:?}");
        }
    }

    #[test]
    fn normal_tails() {
        assert!((exceeded_with(1e-4) - 3.719_016_5).abs() < 1e-6);
        assert!((Marginal::NORMAL.above(3.0) / 1.349_898e-3 - 1.0).abs() < 1e-6);
    }
}
