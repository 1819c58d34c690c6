//! The healthy residuals of all channels as one random process, fitted to calibration and simulated from: each channel
//! is an autoregression of normal scores seen through its [`Marginal`]; the channels' noises are correlated. So the simulated residuals have the
//! recorded ones' skewness and tails, their correlation from window to window (overlap included), and the correlation between channels.

use crate::cores::AcrossCores as _;
use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::autocorrelation::{Autoregression, autocovariances};
use super::marginal::{Marginal, scores};

/// Lags over which correlations are summed.
const LAGS: usize = 200;

/// One channel of the process.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChannelProcess {
    pub marginal: Marginal,
    pub memory: Autoregression,
    pub long_run_variance: f64,
}

impl ChannelProcess {
    pub(super) fn new(marginal: Marginal, memory: Autoregression) -> Self {
        let long_run_variance = marginal.long_run_variance(&memory.correlations(LAGS));
        Self { marginal, memory, long_run_variance }
    }
}

/// All channels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Process {
    pub channels: Vec<ChannelProcess>,
    /// Lower triangle that makes the channels' noises from independent ones.
    mixing: DMatrix<f64>,
}

/// A simulated residual series, one column a channel.
pub(super) type Series = Vec<Vec<f64>>;

impl Process {
    /// Fits standardised residuals (`columns[channel][window]`); `stretches` are the runs of windows without a gap, `order` is the
    /// longest memory, `worth` how many independent windows they are.
    pub(super) fn fit(
        columns: &[Vec<f64>],
        stretches: &[std::ops::Range<usize>],
        order: usize,
        worth: f64,
    ) -> Self {
        let n = columns.first().map_or(0, Vec::len);
        let expected = scores(n);
        let normal: Vec<Vec<f64>> = columns.iter().map(|z| to_scores(z, &expected)).collect();
        let channels: Vec<ChannelProcess> = columns
            .iter()
            .zip(&normal)
            .map(|(z, g)| {
                let mut sorted = z.clone();
                sorted.sort_by(f64::total_cmp);
                let memory = Autoregression::shrunk(&autocovariances(&pieces(g, stretches), order), n);
                ChannelProcess::new(Marginal::fit(&sorted, &expected, worth), memory)
            })
            .collect();
        let noises: Vec<Vec<f64>> = channels.iter().zip(&normal).map(|(c, g)| noise(&c.memory, g)).collect();
        Self { mixing: mixing(&noises), channels }
    }

    #[cfg(test)]
    pub(super) fn independent(channels: Vec<ChannelProcess>) -> Self {
        let size = channels.len();
        Self { channels, mixing: DMatrix::identity(size, size) }
    }

    /// `n` consecutive decisions; the same for the same stream number.
    pub(super) fn simulate(&self, n: usize, seed: u64, stream: u64) -> Series {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        let size = self.channels.len();
        let order = self.channels.iter().map(|c| c.memory.phi.len()).max().unwrap_or(0);
        let settle = if order == 0 { 0 } else { 50 + 10 * order };
        let mut scores = vec![Vec::with_capacity(n + settle); size];
        let mut noise = vec![0.0; size];
        for t in 0..n + settle {
            noise.iter_mut().for_each(|e| *e = StandardNormal.sample(&mut random));
            for (i, (channel, g)) in self.channels.iter().zip(&mut scores).enumerate() {
                let mixed: f64 =
                    noise.iter().take(i + 1).enumerate().map(|(j, e)| self.mixing[(i, j)] * e).sum();
                let past: f64 = channel.memory.phi.iter().zip(g[..t].iter().rev()).map(|(p, g)| p * g).sum();
                g.push(past + channel.memory.noise.sqrt() * mixed);
            }
        }
        let seen = |(channel, g): (&ChannelProcess, Vec<f64>)| {
            g.into_iter().skip(settle).map(|g| channel.marginal.at(g)).collect()
        };
        self.channels.iter().zip(scores).map(seen).collect()
    }

    /// Independent stretches of `each` decisions, in parallel.
    pub(super) fn simulate_many(&self, count: usize, each: usize, seed: u64) -> Vec<Series> {
        (0..count as u64).into_par_iter().map(|stream| self.simulate(each, seed, stream)).collect()
    }
}

/// Replaces values by the normal scores of their ranks, in place of time.
fn to_scores(z: &[f64], expected: &[f64]) -> Vec<f64> {
    let mut by_rank: Vec<usize> = (0..z.len()).collect();
    by_rank.sort_by(|&a, &b| z[a].total_cmp(&z[b]));
    let mut scores = vec![0.0; z.len()];
    by_rank.iter().zip(expected).for_each(|(&at, &g)| scores[at] = g);
    scores
}

fn pieces<'a>(of: &'a [f64], stretches: &[std::ops::Range<usize>]) -> Vec<&'a [f64]> {
    stretches.iter().filter_map(|r| of.get(r.clone())).collect()
}

/// What the autoregression does not foresee; gaps are passed over, they are few.
fn noise(memory: &Autoregression, g: &[f64]) -> Vec<f64> {
    let foreseen = |t: usize| memory.phi.iter().zip(g[..t].iter().rev()).map(|(p, g)| p * g).sum::<f64>();
    (0..g.len()).map(|t| g[t] - foreseen(t)).collect()
}

fn mixing(noises: &[Vec<f64>]) -> DMatrix<f64> {
    let size = noises.len();
    let product = |a: usize, b: usize| noises[a].iter().zip(&noises[b]).map(|(a, b)| a * b).sum::<f64>();
    let correlation = DMatrix::from_fn(size, size, |a, b| {
        if a == b { 1.0 } else { 0.999 * product(a, b) / (product(a, a) * product(b, b)).sqrt().max(1e-300) }
    });
    correlation.cholesky().map_or_else(|| DMatrix::identity(size, size), |c| c.l())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A process is simulated, fitted, and its tails, memory and correlation found again.
    #[test]
    fn a_known_process_is_found_again() {
        let skewed = Marginal::new([0.0, 0.98, 0.1, 0.01]);
        let memory = Autoregression { phi: vec![0.4], noise: 0.84 };
        let mut truth = Process::independent(vec![
            ChannelProcess::new(skewed, memory.clone()),
            ChannelProcess::new(Marginal::NORMAL, memory),
        ]);
        truth.mixing = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.6, 0.8]);
        let series = truth.simulate(20_000, 1, 0);
        let found = Process::fit(&series, std::slice::from_ref(&(0..20_000)), 8, 20_000.0);
        assert!((found.mixing[(1, 0)] - 0.6).abs() < 0.03, "{}", found.mixing);
        for (found, truth) in found.channels.iter().zip(&truth.channels) {
            assert!((found.memory.phi[0] - 0.4).abs() < 0.04, "{:?}", found.memory);
            let ratio = found.long_run_variance / truth.long_run_variance;
            assert!((0.9..1.1).contains(&ratio), "{ratio}");
            let limit = truth.marginal.at(3.5);
            let ratio = found.marginal.above(limit) / truth.marginal.above(limit);
            assert!((0.7..1.4).contains(&ratio), "{ratio}");
        }
    }
}
