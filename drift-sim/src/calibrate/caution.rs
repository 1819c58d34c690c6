//! What a baseline from finitely many windows costs: the next calibration of the same loop would find another mean,
//! sigma, skewness, tail and correlation. Of all such calibrations a wanted share (the confidence) must keep the promised
//! run length, so the thresholds are made for a longer one.
//!
//! The fitted process plays the truth; calibrations of it are simulated (a parametric bootstrap), each one's thresholds
//! and what they would realise are computed in closed form ([`super::run_length`], the marginals' tails), and the quantile of
//! realised over designed run length is the factor that is missing. More than [`MOST_WINDOWS`] windows are not simulated: errors are
//! scaled by the root of their number instead.

use rayon::prelude::*;

use super::marginal::{self, Marginal, scores};
use super::process::{ChannelProcess, Process, refit};
use super::run_length::{OneSide, cusum_two_sided, threshold};
use super::thresholds::DetectorChoice;

const SEED: u64 = 0x6472_6966_7402;
/// The run length that is designed for is at most this many times the wanted one: beyond, the bootstrap says only that the
/// windows are too few.
const MOST_CAUTION: f64 = 20.0;
/// Simulated calibrations.
const CALIBRATIONS: usize = 400;
/// The fitted process that plays the truth is itself an estimate, which a bootstrap does not see: with few windows the share
/// of calibrations that fail is taken smaller by n/(n + this). Chosen by trial on the loops of `tests/calibration_promise.rs`.
const UNSEEN_WINDOWS: f64 = 600.0;
const MOST_WINDOWS: usize = 400;

/// What one calibration found of one channel, in the true residual's sigmas.
#[derive(Debug, Clone, Copy)]
struct Found {
    mean: f64,
    sigma: f64,
    marginal: Marginal,
    long_run_variance: f64,
}

/// Simulated calibrations of one process.
#[derive(Debug)]
pub(super) struct Calibrations<'p> {
    process: &'p Process,
    choice: DetectorChoice,
    k: f64,
    worth: f64,
    found: Vec<Vec<Found>>,
}

impl<'p> Calibrations<'p> {
    /// `windows`: of the real calibration; `worth`: how many independent ones they are.
    pub(super) fn simulate(
        process: &'p Process,
        choice: DetectorChoice,
        k: f64,
        windows: usize,
        worth: f64,
    ) -> Self {
        let simulated = windows.clamp(2, MOST_WINDOWS);
        let scale = (simulated as f64 / windows.max(2) as f64).sqrt();
        let expected = scores(simulated);
        let calibrate = |stream: u64| {
            let series = process.simulate(simulated, SEED, stream);
            let of = |(z, truth): (&Vec<f64>, &ChannelProcess)| find(z, truth, &expected, scale, windows);
            series.iter().zip(&process.channels).map(of).collect()
        };
        let found = (0..CALIBRATIONS as u64).into_par_iter().map(calibrate).collect();
        Self { process, choice, k, worth, found }
    }

    /// The run length to design for, so that a share `confidence` of all calibrations realises `arl` or more.
    pub(super) fn cautious(&self, arl: f64, confidence: f64) -> f64 {
        let failing = (1.0 - confidence) * self.worth / (self.worth + UNSEEN_WINDOWS);
        let mut designed = arl;
        for _ in 0..4 {
            designed = arl * (1.0 / self.quantile(designed, failing)).min(MOST_CAUTION);
        }
        designed
    }

    /// The quantile of realised over designed run length.
    fn quantile(&self, designed: f64, probability: f64) -> f64 {
        let mut ratios: Vec<f64> = self.found.par_iter().map(|found| self.ratio(found, designed)).collect();
        ratios.sort_by(f64::total_cmp);
        let at = probability * (ratios.len() as f64) - 0.5;
        let floor = at.max(0.0) as usize;
        let value = |i: usize| ratios.get(i).or(ratios.last()).copied().unwrap_or(1.0);
        // Not further than a factor that no threshold could make good for.
        (value(floor) + (at - floor as f64).max(0.0) * (value(floor + 1) - value(floor))).clamp(1e-4, 1.0)
    }

    fn ratio(&self, found: &[Found], designed: f64) -> f64 {
        let watched = (self.process.channels.len() * self.choice.count()).max(1) as f64;
        let share = 1.0 / (designed * watched);
        let of = |(found, truth): (&Found, &ChannelProcess)| self.realised_rate(found, truth, share);
        let realised: f64 = found.iter().zip(&self.process.channels).map(of).sum();
        1.0 / (designed * realised)
    }

    /// The alarm rate of one channel's detectors that were designed for `share` each on what was found.
    fn realised_rate(&self, found: &Found, truth: &ChannelProcess, share: f64) -> f64 {
        let mut rate = 0.0;
        if self.choice.shewhart {
            let g = marginal::exceeded_with(0.5 * share);
            let limit = |g: f64| found.mean + found.sigma * found.marginal.at(g);
            rate += truth.marginal.above(limit(g)) + truth.marginal.below(limit(-g));
        }
        // An SPRT of the mean is a CUSUM that restarts elsewhere: the same errors move it as much.
        let sequential = u8::from(self.choice.cusum) + u8::from(self.choice.sprt);
        if sequential > 0 {
            let third = found.marginal.third_cumulant();
            let h = threshold(self.k, 1.0 / share, found.long_run_variance, third);
            let side = OneSide { k: self.k * found.sigma, h: h * found.sigma };
            let law = &truth.marginal;
            let arl = cusum_two_sided(side, found.mean, truth.long_run_variance, law.third_cumulant());
            rate += f64::from(sequential) / arl;
        }
        rate
    }
}

fn find(z: &[f64], truth: &ChannelProcess, expected: &[f64], scale: f64, windows: usize) -> Found {
    let n = z.len() as f64;
    let mean = z.iter().sum::<f64>() / n;
    // A line takes two degrees of freedom.
    let sigma = (z.iter().map(|z| (z - mean) * (z - mean)).sum::<f64>() / (n - 2.0).max(1.0)).sqrt();
    let own = truth.marginal.variance().sqrt();
    let standard: Vec<f64> = z.iter().map(|z| (z - mean) / sigma).collect();
    let again = refit(&standard, expected, truth.memory.phi.len());
    let toward = |truth: f64, found: f64| truth + scale * (found - truth);
    let [t, f] = [truth.marginal.c, again.marginal.c];
    // The monitor widens its sigma by the baseline's own uncertainty, 2/n in the mean over x.
    let widened = (1.0 + 2.0 / windows as f64).sqrt();
    let truth_variance = truth.long_run_variance / truth.marginal.variance();
    Found {
        mean: scale * (mean - truth.marginal.c[0]),
        sigma: toward(own, sigma) * widened,
        marginal: Marginal::new(std::array::from_fn(|j| toward(t[j] / own, f[j]))),
        long_run_variance: truth_variance * libm::pow(again.long_run_variance / truth_variance, scale),
    }
}

#[cfg(test)]
mod tests {
    use super::super::autocorrelation::Autoregression;
    use super::*;
    use crate::design::{Cusum, EstimatedBaseline};

    /// Independent normal residuals, against the integral over the estimates' exact laws. Ours may be a little less, since the
    /// monitor widens its sigma by the baseline's uncertainty, or more, since skewness and tails are estimated too.
    #[test]
    fn the_price_of_an_estimated_baseline() {
        let memory = Autoregression { phi: Vec::new(), noise: 1.0 };
        let process = Process::independent(vec![ChannelProcess::new(Marginal::NORMAL, memory)]);
        let choice = DetectorChoice { shewhart: false, cusum: true, sprt: false };
        for (windows, tolerance) in [(200.0, 0.2), (2000.0, 0.1)] {
            let calibrations = Calibrations::simulate(&process, choice, 0.5, windows as usize, windows);
            let own = calibrations.cautious(500.0, 0.9) / 500.0;
            let baseline = EstimatedBaseline::independent(windows).unwrap();
            let unseen = 0.1 * windows / (windows + UNSEEN_WINDOWS);
            let exact = baseline.guaranteed(0.5, 500.0, 1.0 - unseen, 0.0).unwrap();
            let exact = Cusum::new(0.5, exact.up().h(), 0.0).unwrap().arl(0.0) / 500.0;
            assert!((own / exact - 1.0).abs() < tolerance, "{windows}: {own} {exact}");
        }
    }
}
