//! How much neighbouring windows repeat each other: autocorrelations, the integrated autocorrelation time, and the number of independent windows
//! that a series is worth.

/// Autocovariances at lags 0..=`most`, over stretches without a gap, each divided by the whole count (so that they are
/// a positive definite sequence). The mean is not taken off.
pub fn autocovariances(stretches: &[&[f64]], most: usize) -> Vec<f64> {
    let n: usize = stretches.iter().map(|s| s.len()).sum();
    let at = |lag: usize| {
        let products = stretches.iter().flat_map(|s| s.iter().zip(s.get(lag..).unwrap_or(&[])));
        products.map(|(a, b)| a * b).sum::<f64>() / n.max(1) as f64
    };
    (0..=most).map(at).collect()
}

/// The sum of all autocorrelations, `1 + 2 (rho_1 + rho_2 + ...)`, up to the first lag that is five times the sum so far
/// (Sokal 1997); 1 for independent values, `(1 + phi)/(1 - phi)` for a first-order autoregression.
pub fn integrated_time(autocovariances: &[f64]) -> f64 {
    let Some((&variance, lagged)) = autocovariances.split_first() else { return 1.0 };
    if variance <= 0.0 {
        return 1.0;
    }
    let mut sum = 1.0;
    for (lag, covariance) in lagged.iter().enumerate() {
        sum += 2.0 * covariance / variance;
        if (lag + 1) as f64 >= 5.0 * sum.max(1.0) {
            break;
        }
    }
    sum.max(0.0)
}

/// Independent values that they are worth for their variance: `n/(1 + 2 (rho_1^2 + rho_2^2 + ...))`, each square less what mere
/// chance makes of it, 1/n.
pub fn size_for_variance(n: usize, autocovariances: &[f64]) -> f64 {
    let Some((&variance, lagged)) = autocovariances.split_first().filter(|(v, _)| **v > 0.0) else {
        return n as f64;
    };
    let excess = |c: &f64| (c / variance) * (c / variance) - 1.0 / n as f64;
    n as f64 / (1.0 + 2.0 * lagged.iter().map(excess).sum::<f64>().max(0.0))
}

/// Independent values that `n` are worth for their mean; never more than `n`.
pub fn effective_size(n: usize, integrated_time: f64) -> f64 {
    n as f64 / integrated_time.max(1.0)
}

/// The integrated autocorrelation time of a long signal, samples, from the scatter of ever longer batches' means: one
/// pass, whatever the correlation's length. The longest of all scales is taken, since a slow part may hide behind a fast one. What
/// is not finite is left out.
pub fn batch_time(signal: &[f64]) -> f64 {
    let mut means: Vec<f64> = signal.iter().copied().filter(|x| x.is_finite()).collect();
    let variance = variance(&means);
    if variance.is_nan() || variance <= 0.0 {
        return 1.0;
    }
    let (mut batch, mut longest) = (1.0, 1.0f64);
    while means.len() >= 64 {
        let time = batch * self::variance(&means) / variance;
        longest = longest.max(time);
        means = means.chunks_exact(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        batch *= 2.0;
    }
    longest
}

fn variance(of: &[f64]) -> f64 {
    let n = of.len() as f64;
    let mean = of.iter().sum::<f64>() / n;
    of.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n
}

/// An autoregression `g[t] = sum of phi[i] g[t - 1 - i] + noise` with unit variance.
#[derive(Debug, Clone, PartialEq)]
pub struct Autoregression {
    /// Coefficients, most recent first; none for independent values.
    pub phi: Vec<f64>,
    /// Variance of the noise.
    pub noise: f64,
}

impl Autoregression {
    /// From `windows` values, by Yule and Walker's equations (Levinson's recursion), of the order that the autocovariances reach to. Each
    /// partial correlation is shrunk by its own standard error (`1 - 1/(n r^2)`, or to 0): independent values then have almost no
    /// memory, and a long one that few values only seem to have moves no threshold.
    pub fn shrunk(autocovariances: &[f64], windows: usize) -> Self {
        let shrink = |r: f64| r * (1.0 - 1.0 / (windows as f64 * r * r)).max(0.0);
        let mut model = Self::NONE;
        partial_correlations(autocovariances)
            .into_iter()
            .for_each(|r| model.extend(if r == 0.0 { 0.0 } else { shrink(r) }));
        model
    }

    const NONE: Self = Self { phi: Vec::new(), noise: 1.0 };

    /// One order more, by its last (partial) correlation.
    fn extend(&mut self, partial: f64) {
        let mirrored: Vec<f64> = self.phi.iter().rev().copied().collect();
        self.phi.iter_mut().zip(&mirrored).for_each(|(p, m)| *p -= partial * m);
        self.phi.push(partial);
        self.noise *= 1.0 - partial * partial;
    }

    /// Its autocorrelations at lags 0..=`most`.
    pub fn correlations(&self, most: usize) -> Vec<f64> {
        // From the impulse response: Yule and Walker's equations backwards, without a linear system.
        let length = most + 40 * (self.phi.len() + 1);
        let mut response: Vec<f64> = vec![1.0];
        for t in 1..length {
            let next = self.phi.iter().zip(response[..t].iter().rev()).map(|(p, w)| p * w).sum();
            response.push(next);
        }
        let products = autocovariances(&[&response], most);
        let variance = products.first().copied().unwrap_or(1.0);
        products.iter().map(|c| c / variance).collect()
    }
}

/// Of lags 1, 2, ...
fn partial_correlations(autocovariances: &[f64]) -> Vec<f64> {
    let Some((&variance, lagged)) = autocovariances.split_first().filter(|(v, _)| **v > 0.0) else {
        return Vec::new();
    };
    let rho: Vec<f64> = lagged.iter().map(|c| c / variance).collect();
    let mut model = Autoregression::NONE;
    let mut next = |order: usize| {
        let explained: f64 = model.phi.iter().zip(rho[..order].iter().rev()).map(|(p, r)| p * r).sum();
        let partial = ((rho[order] - explained) / model.noise).clamp(-0.999, 0.999);
        model.extend(partial);
        partial
    };
    (0..rho.len()).map(&mut next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn autoregressive(phi: f64, n: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut g = 0.0;
        let mut next = || {
            let noise: f64 = StandardNormal.sample(&mut random);
            g = phi * g + noise;
            g
        };
        (0..n).map(|_| next()).collect()
    }

    /// Theory: (1 + phi)/(1 - phi).
    #[test]
    fn the_integrated_time_of_an_autoregression() {
        for (phi, seed) in [(0.0, 1), (0.3, 2), (0.6, 3), (0.9, 4), (-0.4, 5)] {
            let series = autoregressive(phi, 100_000, seed);
            let theory = (1.0 + phi) / (1.0 - phi);
            let found = integrated_time(&autocovariances(&[&series], 400));
            assert!((found / theory - 1.0).abs() < 0.1, "{phi}: {found} {theory}");
            let n_effective = effective_size(series.len(), found);
            assert!((n_effective * theory.max(1.0) / 1e5 - 1.0).abs() < 0.1, "{phi}: {n_effective}");
            if phi >= 0.0 {
                let found = batch_time(&series);
                assert!((0.85..1.7).contains(&(found / theory)), "{phi}: {found} {theory}");
            }
        }
    }

    #[test]
    fn an_autoregression_is_found_again() {
        let series = autoregressive(0.6, 20_000, 7);
        let model = Autoregression::shrunk(&autocovariances(&[&series], 4), series.len());
        let first = model.phi[0];
        assert!((first - 0.6).abs() < 0.03, "{model:?}");
        assert!((model.noise - 0.64).abs() < 0.02, "{model:?}");
        let rho = Autoregression { phi: vec![0.6], noise: 0.64 }.correlations(3);
        assert!((rho[1] - 0.6).abs() < 1e-9 && (rho[3] - 0.216).abs() < 1e-9, "{rho:?}");
    }

    #[test]
    fn pairs_do_not_span_a_gap() {
        let c = autocovariances(&[&[1.0, 1.0], &[-1.0, -1.0]], 3);
        assert_eq!(c, [1.0, 0.5, 0.0, 0.0]);
    }
}
