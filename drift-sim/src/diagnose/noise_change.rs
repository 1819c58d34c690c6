//! A change of the noise: the one effect that no prediction of y can show, only the size of what is left.

use super::fit::mean_square;

/// Noise before and after a change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseChange {
    /// First sample of the new noise, in the whitened residual.
    pub at: usize,
    /// Standard deviation after over before.
    pub ratio: f64,
    /// Half width of the ratio's 95 % interval, from the two variances and the residual's own tails.
    pub half_width: f64,
    /// Gain in log-likelihood over one noise throughout.
    pub gain: f64,
}

/// The most likely single change; `None` for a record too short for one.
pub fn find(white: &[f64]) -> Option<NoiseChange> {
    let n = white.len();
    let margin = (n / 20).max(30);
    if n < 3 * margin {
        return None;
    }
    let mut cumulated = Vec::with_capacity(n + 1);
    cumulated.push(0.0);
    for w in white {
        cumulated.push(cumulated.last().copied().unwrap_or(0.0) + w * w);
    }
    let total = *cumulated.last()?;
    let whole = n as f64 * libm::log((total / n as f64).max(1e-300));
    let gain_at = |at: usize| {
        let before = cumulated.get(at).copied().unwrap_or(0.0);
        let (n1, n2) = (at as f64, (n - at) as f64);
        let parts =
            n1 * libm::log((before / n1).max(1e-300)) + n2 * libm::log(((total - before) / n2).max(1e-300));
        0.5 * (whole - parts)
    };
    let at = (margin..n - margin).max_by(|a, b| gain_at(*a).total_cmp(&gain_at(*b)))?;
    let (before, after) = white.split_at(at);
    let (s1, s2) = (mean_square(before), mean_square(after));
    if s1 <= 0.0 {
        return None;
    }
    let ratio = libm::sqrt(s2 / s1);
    // The variance of a variance is (kurtosis - 1)/n.
    let spread = |part: &[f64], s: f64| {
        let fourth = part.iter().map(|w| w * w * w * w).sum::<f64>() / part.len() as f64;
        (fourth / (s * s) - 1.0).max(0.5) / part.len() as f64
    };
    let half_width = 1.96 * ratio * 0.5 * libm::sqrt(spread(before, s1) + spread(after, s2));
    Some(NoiseChange { at, ratio, half_width, gain: gain_at(at) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn threefold_noise_from_sample_600_on_is_found() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let white: Vec<f64> = (0..2000)
            .map(|i| {
                let e: f64 = StandardNormal.sample(&mut rng);
                if i < 600 { e } else { 3.0 * e }
            })
            .collect();
        let change = find(&white).unwrap();
        assert!(change.at.abs_diff(600) < 10, "{change:?}");
        assert!((change.ratio - 3.0).abs() < change.half_width.max(0.2));
    }
}
