//! The proof: what was found, on samples that no number was fitted on and no choice was made by: the log-likelihood that is gained there.

use rayon::prelude::*;

use crate::diagnose::signals::Signals;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::likelihood::{Cache, Data, runs};

use super::decide::independent_share;
use super::needle::as_likely;

/// Log-likelihood gained on unseen samples, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gained {
    /// The sum over the unseen samples, in nats.
    pub sum: f64,
    /// Its standard error, from the scatter of the samples' own gains; they are independent as far as the innovations are white.
    pub error: f64,
    /// The sum as far as samples are independent.
    pub independent: f64,
}

impl Gained {
    /// The sum in standard errors.
    pub fn errors(self) -> f64 {
        self.sum / self.error.max(1e-300)
    }
}

/// Half width, in standard errors, of a 95 % interval.
const NORMAL_95: f64 = 1.96;
/// Likelihood ratio on unseen samples from which chance is ruled out: it exceeds this with a probability of one in as many, at most, where the worse
/// fit is the truth (Wasserman, Ramdas & Balakrishnan 2020, "Universal inference", with the worse fit's numbers taken as known).
const LEAST_RATIO: f64 = 100.0;

impl Gained {
    /// Whether chance is ruled out: by the scatter of the samples' gains, or, where few samples tell all (a step), by the likelihood ratio itself.
    pub fn is_sure(self) -> bool {
        self.sum > NORMAL_95 * self.error || self.independent > libm::log(LEAST_RATIO)
    }
}

/// Logarithms of the load's size over the drive's, at least, with which a proof is tried again: a filter that trusts its loop wholly, because no load was seen, goes
/// on for long from one slip of a valve or of a rusty bearing that comes a sample late.
const LEAST_LOADS: [f64; 2] = [-5.0, -3.5];

/// What one fit gains over another beyond what both were fitted to; `None` where there is nothing unseen, or it can't be simulated there.
pub fn gained(better: &Fit, worse: &Fit, data: &Data) -> Option<Gained> {
    let gained = run_on(better, worse, data)?;
    if gained.is_sure() {
        return Some(gained);
    }
    // What fits that are as likely foretell together is at least what one of them does, less the logarithm of its weight.
    let others = as_likely(better, data);
    let of_others = others.par_iter().filter_map(|(weight, better)| {
        let gained = run_on(better, worse, data)?;
        Some(Gained { sum: gained.sum + weight, independent: gained.independent + weight, ..gained })
    });
    if let Some(best) = of_others.max_by(|a, b| a.sum.total_cmp(&b.sum)).filter(|best| best.is_sure()) {
        return Some(best);
    }
    let mut again = LEAST_LOADS.iter().filter_map(|least| {
        run_on(&less_trusting(better, *least, data)?, &less_trusting(worse, *least, data)?, data)
    });
    Some(again.find(|again| again.is_sure()).unwrap_or(gained))
}

/// A fit with a load of at least this size.
fn less_trusting(fit: &Fit, least: f64, data: &Data) -> Option<Fit> {
    let mut point = fit.point.clone();
    if let Some(place) = fit.hypothesis.place(Target::LoadSize)
        && let Some(size) = point.x.get_mut(place)
    {
        *size = size.max(least);
    }
    Fit::at(&fit.hypothesis, &point, data)
}

/// Both filters run on from the samples that they have seen.
fn run_on(better: &Fit, worse: &Fit, data: &Data) -> Option<Gained> {
    let whole = data.whole();
    let longest = data.recordings.iter().map(Signals::len).max()?;
    let of = |fit: &Fit| -> Option<Vec<f64>> {
        let seen = fit.rows.sensor_sd / fit.hypothesis.scales.noise;
        let runs = runs(&fit.hypothesis, &fit.point, &whole, &mut Cache::default(), longest, true)?;
        let mut all = Vec::new();
        for (run, fitted) in runs.iter().zip(&data.fitted) {
            let unseen = run.scaled.iter().zip(&run.log_scales).skip(*fitted);
            all.extend(unseen.map(|(e, log)| -0.5 * (e * e / (seen * seen) + log) - libm::log(seen)));
        }
        Some(all)
    };
    let differences: Vec<f64> = of(better)?.iter().zip(of(worse)?).map(|(a, b)| a - b).collect();
    if differences.is_empty() {
        return None;
    }
    let n = differences.len() as f64;
    let sum: f64 = differences.iter().sum();
    let mean = sum / n;
    let square: f64 = differences.iter().map(|d| (d - mean) * (d - mean)).sum();
    Some(Gained { sum, error: libm::sqrt(square), independent: independent_share(better) * sum })
}
