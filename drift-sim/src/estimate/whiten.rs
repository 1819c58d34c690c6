//! The noise model: an autoregression of the residual. What is left after it is white, so that likelihoods and
//! intervals hold although the residual itself is coloured.

use nalgebra::{DMatrix, DVector};

/// An autoregressive filter `w[n] = e[n] - sum a[i] e[n-1-i]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Whitener {
    coefficients: Vec<f64>,
}

impl Whitener {
    /// No filter: the residual is taken as white.
    pub fn none() -> Self {
        Self::default()
    }

    /// The order, coefficients included.
    pub fn order(&self) -> usize {
        self.coefficients.len()
    }

    /// Of this order, by Levinson's recursion, which gives a stable one; none of a residual that is nothing.
    pub fn of_order(residual: &[f64], order: usize) -> Self {
        Self {
            coefficients: levinson(residual, order)
                .pop()
                .map(|(coefficients, _)| coefficients)
                .unwrap_or_default(),
        }
    }

    /// Of this order, by least squares: unlike Levinson's recursion it is not misled by a residual that is far from zero at its ends (a
    /// drift, steps). No filter where that has no solution.
    pub fn least_squares(residual: &[f64], order: usize) -> Self {
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(order, order), DVector::<f64>::zeros(order));
        for window in residual.windows(order + 1) {
            let Some((now, past)) = window.split_last() else { continue };
            let past = DVector::from_iterator(order, past.iter().rev().copied());
            normal.ger(1.0, &past, &past, 1.0);
            right.axpy(*now, &past, 1.0);
        }
        let solved = normal.cholesky().map(|factor| factor.solve(&right));
        Self { coefficients: solved.map(|a| a.iter().copied().collect()).unwrap_or_default() }
    }

    /// The filtered residual, without the first samples that lack a past.
    pub fn apply(&self, residual: &[f64]) -> Vec<f64> {
        let mut filtered = residual.to_vec();
        self.whiten(&mut filtered);
        filtered.split_off(self.order().min(residual.len()))
    }

    /// Filters a residual in place; before its first sample there was nothing.
    pub fn whiten(&self, residual: &mut [f64]) {
        if self.order() == 0 {
            return;
        }
        for n in (0..residual.len()).rev() {
            let foretold = self.foretold(residual.get(..n).unwrap_or(&[]));
            residual.iter_mut().skip(n).take(1).for_each(|e| *e -= foretold);
        }
    }

    /// The inverse: makes white noise as coloured as the residual was.
    pub fn color(&self, white: &mut [f64]) {
        for n in 0..white.len() {
            let foretold = self.foretold(white.get(..n).unwrap_or(&[]));
            white.iter_mut().skip(n).take(1).for_each(|e| *e += foretold);
        }
    }

    fn foretold(&self, past: &[f64]) -> f64 {
        self.coefficients.iter().zip(past.iter().rev()).map(|(a, e)| a * e).sum()
    }
}

/// Log-likelihood that a residual gains by a filter of this order.
pub fn gain_by(residual: &[f64], order: usize) -> f64 {
    let orders = levinson(residual, order);
    let power = |of: Option<&(Vec<f64>, f64)>| of.map_or(1.0, |(_, left)| *left).max(1e-300);
    0.5 * residual.len() as f64 * libm::log(power(orders.first()) / power(orders.last()))
}

/// Levinson's recursion: the coefficients of each order from none on, and the variance that they leave; up to the highest or to where a residual is
/// foretold wholly. Empty of a residual that is nothing.
fn levinson(residual: &[f64], highest: usize) -> Vec<(Vec<f64>, f64)> {
    let covariance: Vec<f64> = (0..=highest).map(|lag| autocovariance(residual, lag)).collect();
    let Some(&power) = covariance.first().filter(|power| **power > 0.0) else { return Vec::new() };
    let (mut a, mut left): (Vec<f64>, f64) = (Vec::new(), power);
    let mut orders = vec![(a.clone(), left)];
    for order in 1..=highest {
        let predicted: f64 = a.iter().zip(covariance.iter().take(order).rev()).map(|(a, c)| a * c).sum();
        // a[i] pairs with lag order-1-i.
        let reflection = (covariance.get(order).copied().unwrap_or(0.0) - predicted) / left;
        if !reflection.is_finite() || reflection.abs() >= 1.0 {
            break;
        }
        let reversed: Vec<f64> = a.iter().rev().copied().collect();
        for (a, r) in a.iter_mut().zip(&reversed) {
            *a -= reflection * r;
        }
        a.push(reflection);
        left *= 1.0 - reflection * reflection;
        orders.push((a.clone(), left));
    }
    orders
}

/// Autocovariance about zero (a residual has no mean of its own to be excused), biased so that it is a valid one.
pub fn autocovariance(x: &[f64], lag: usize) -> f64 {
    let late = x.get(lag..).unwrap_or(&[]);
    late.iter().zip(x).map(|(a, b)| a * b).sum::<f64>() / x.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn ar1(phi: f64, n: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut x = 0.0;
        (0..n)
            .map(|_| {
                let e: f64 = StandardNormal.sample(&mut rng);
                x = phi * x + e;
                x
            })
            .collect()
    }

    /// On an AR(1) of known coefficient the filter finds it, and what is left is white.
    #[test]
    fn an_autoregression_is_found_and_undone() {
        let x = ar1(0.8, 20_000);
        let whitener = Whitener::of_order(&x, 1);
        let white = whitener.apply(&x);
        assert!((whitener.coefficients[0] - 0.8).abs() < 0.03, "{whitener:?}");
        assert!((autocovariance(&white, 1) / autocovariance(&white, 0)).abs() < 0.02);
        assert!((autocovariance(&white, 0) - 1.0).abs() < 0.05);
    }

    /// Noise with a resonance, as a second, faster oscillation makes it: found, whitened and coloured again.
    #[test]
    fn a_resonance_is_whitened_and_colored_again() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let white: Vec<f64> = (0..20_000).map(|_| StandardNormal.sample(&mut random)).collect();
        let truth = Whitener { coefficients: vec![1.5, -0.9] };
        let mut z = white.clone();
        truth.color(&mut z);
        let found = Whitener::of_order(&z, 10).coefficients;
        assert!((found[0] - 1.5).abs() < 0.03 && (found[1] + 0.9).abs() < 0.03, "{found:?}");
        // The determinant of the inverse: -n/2 ln(variance left) is what the closed form of an AR(2) says.
        let variance = (1.0 + 0.9) / ((1.0 - 0.9) * ((1.0 + 0.9) * (1.0 + 0.9) - 1.5 * 1.5));
        assert!((gain_by(&z, 10) / (0.5 * 20_000.0 * libm::log(variance)) - 1.0).abs() < 0.03);
        truth.whiten(&mut z);
        assert!(z.iter().zip(&white).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    /// The same coefficient under a drift. Of order 2, what takes the drift away (a1 + a2 = 1) leaves least at a1 = 3/4: 1.25 times
    /// the variance of the noise.
    #[test]
    fn least_squares_are_not_misled_by_a_drift() {
        let mut x = ar1(0.5, 4000);
        x.iter_mut().enumerate().for_each(|(i, x)| *x += 0.01 * i as f64);
        let left = autocovariance(&Whitener::least_squares(&x, 2).apply(&x), 0);
        assert!((left / 1.25 - 1.0).abs() < 0.05, "{left}");
    }
}
