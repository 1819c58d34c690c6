//! What is left of correlation in innovations: noise of a real machine is neither the random load nor the sensor's noise that a filter reckons with. A
//! filter behind the filter, an autoregression of the innovations, makes them white; its determinant is one, so that likelihoods stay likelihoods.

use super::inner_product::dot;

/// Past innovations that it looks at.
pub const ORDER: usize = 10;

/// An autoregression; none of any order leaves innovations as they are.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coloring {
    /// What the next innovation takes of the last ones, the last first.
    past: Vec<f64>,
}

impl Coloring {
    /// That of innovations (Yule and Walker's equations by Levinson's recursion, which gives a stable one).
    pub fn of(z: &[f64]) -> Self {
        Self { past: recursion(z).0 }
    }

    /// Whether there is one.
    pub fn is_some(&self) -> bool {
        !self.past.is_empty()
    }

    /// Innovations less what is foretold of them.
    pub fn whiten(&self, z: &mut [f64]) {
        if !self.is_some() {
            return;
        }
        for n in (0..z.len()).rev() {
            let (before, now) = z.split_at_mut(n);
            let foretold: f64 = self.past.iter().zip(before.iter().rev()).map(|(a, z)| a * z).sum();
            now.iter_mut().take(1).for_each(|z| *z -= foretold);
        }
    }

    /// White noise made like the innovations.
    pub fn color(&self, white: &mut [f64]) {
        for n in 0..white.len() {
            let (before, now) = white.split_at_mut(n);
            let foretold: f64 = self.past.iter().zip(before.iter().rev()).map(|(a, z)| a * z).sum();
            now.iter_mut().take(1).for_each(|z| *z += foretold);
        }
    }
}

/// Log-likelihood that innovations would gain by a coloring of their own.
pub fn own_gain(z: &[f64]) -> f64 {
    -0.5 * z.len() as f64 * libm::log(recursion(z).1.max(1e-300))
}

/// Levinson's recursion: the coefficients, and the part of the variance that they leave.
fn recursion(z: &[f64]) -> (Vec<f64>, f64) {
    let of_lag = |lag: usize| dot(z, z.get(lag..).unwrap_or(&[]));
    let own = of_lag(0);
    let (mut past, mut left) = (Vec::new(), 1.0);
    if own <= 0.0 {
        return (past, left);
    }
    let correlation: Vec<f64> = (0..=ORDER).map(|lag| of_lag(lag) / own).collect();
    for next in &correlation[1..] {
        let order = past.len();
        let foretold: f64 = past.iter().zip(correlation[1..=order].iter().rev()).map(|(a, r)| a * r).sum();
        let reflection = (next - foretold) / left;
        let before = past.clone();
        past.iter_mut().zip(before.iter().rev()).for_each(|(a, b)| *a -= reflection * b);
        past.push(reflection);
        left *= 1.0 - reflection * reflection;
    }
    (past, left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Noise with a resonance, as a second, faster oscillation makes it: whitened to a tenth of what chance leaves, and back.
    #[test]
    fn a_resonance_is_whitened_and_colored_again() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let white: Vec<f64> = (0..20_000).map(|_| StandardNormal.sample(&mut random)).collect();
        let truth = Coloring { past: vec![1.5, -0.9] };
        let mut z = white.clone();
        truth.color(&mut z);
        let found = Coloring::of(&z);
        assert!((found.past[0] - 1.5).abs() < 0.03 && (found.past[1] + 0.9).abs() < 0.03, "{found:?}");
        // The determinant of the inverse: -n/2 ln(variance left) is what the closed form of an AR(2) says.
        let variance = (1.0 + 0.9) / ((1.0 - 0.9) * ((1.0 + 0.9) * (1.0 + 0.9) - 1.5 * 1.5));
        assert!((own_gain(&z) / (0.5 * 20_000.0 * libm::log(variance)) - 1.0).abs() < 0.03);
        truth.whiten(&mut z);
        assert!(z.iter().zip(&white).all(|(a, b)| (a - b).abs() < 1e-9));
    }
}
