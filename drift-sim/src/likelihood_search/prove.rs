//! The proof: what was found, on samples that no number was fitted on and no choice was made by: the log-likelihood that is gained there.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::likelihood::{Cache, Data, runs};
use crate::estimate::signals::Signals;

use super::decide::independent_share;
use super::equal_onsets;
use super::needle::{near_the_top, other_tops};

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

/// Part of the strongest term's gain from which on one is no further term.
const OF_STRONGEST: f64 = 0.5;
/// Standard errors from which on a further one is named. Of 52 that were named beside others in ten seeds of both case makers, 15 gained less: two of these were there.
const FURTHER_ERRORS: f64 = 3.0;

impl Gained {
    /// Whether chance is ruled out: by the scatter of the samples' gains, or, where few samples tell all (a step), by the likelihood ratio itself.
    pub fn is_sure(self) -> bool {
        self.is_sure_among(1)
    }

    /// The same of the best of several kinds between which these samples have chosen: one of k gains by chance k times as likely, at most. (The tail of a normal
    /// distribution falls by k where the square grows by twice the logarithm of k, or sooner.)
    pub fn is_sure_among(self, kinds: usize) -> bool {
        let log = libm::log(kinds.max(1) as f64);
        let errors = libm::sqrt(NORMAL_95 * NORMAL_95 + 2.0 * log);
        self.sum > errors * self.error || self.independent > libm::log(LEAST_RATIO) + log
    }

    /// Whether it names a term, chosen from so many kinds, beside others of which the strongest gains so much: where it is far from that, what a model lacks of the strongest gains as
    /// well, and does so in few samples.
    pub fn is_proof(self, among: usize, strongest: f64) -> bool {
        let is_main = self.independent >= OF_STRONGEST * strongest;
        self.is_sure_among(among) && (is_main || self.errors() > FURTHER_ERRORS)
    }
}

/// Logarithms of the load's size over the drive's, at least, with which a proof is tried again: a filter that trusts its loop wholly, because no load was seen, goes
/// on for long from one slip of a valve or of a rusty bearing that comes a sample late.
const LEAST_LOADS: [f64; 2] = [-5.0, -3.5];

/// Part of the weight that goes to all fits about a needle's top after each sample.
const SHARED: f64 = 0.02;

/// What one fit gains over another beyond what both were fitted to; `None` where there is nothing unseen, or it can't be simulated there.
pub fn gained(better: &Fit, worse: &Fit, data: &Data) -> Option<Gained> {
    let share = independent_share(better);
    let (own, of_worse) = (densities(better, data)?, densities(worse, data)?);
    let gained = beyond(&own, &of_worse, share)?;
    if gained.is_sure() {
        return Some(gained);
    }
    let together = together(better, own, data).and_then(|together| beyond(&together, &of_worse, share));
    if let Some(together) = together.filter(|together| together.is_sure()) {
        return Some(together);
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
    beyond(&densities(better, data)?, &densities(worse, data)?, independent_share(better))
}

/// What fits that are about as likely foretell together: those about a needle's top, for no valve slips at the same band each time, and the one that foretells this
/// slip may miss the next; and those with other onsets, where nothing moves when a term begins. After each sample a part of each one's weight goes to all (Herbster & Warmuth 1998, "Tracking the best expert"): a forecast like any other, made
/// without what it is judged by. `None` where there is only one.
fn together(top: &Fit, own: Vec<f64>, data: &Data) -> Option<Vec<f64>> {
    let mut near = near_the_top(top, data);
    let tops = other_tops(top, data);
    near.extend(tops.iter().flat_map(|top| near_the_top(top, data)));
    near.extend(tops);
    near.extend(equal_onsets::of(top, data));
    if near.is_empty() {
        return None;
    }
    let mut of: Vec<Vec<f64>> = near.par_iter().filter_map(|member| densities(member, data)).collect();
    of.push(own);
    let samples = of.iter().map(Vec::len).min()?;
    let share = 1.0 / of.len() as f64;
    let mut weights = vec![share; of.len()];
    let mut together = Vec::with_capacity(samples);
    for n in 0..samples {
        let at = |member: &Vec<f64>| member.get(n).copied().unwrap_or(f64::NEG_INFINITY);
        let most = of.iter().map(at).fold(f64::NEG_INFINITY, f64::max);
        weights.iter_mut().zip(&of).for_each(|(weight, member)| *weight *= libm::exp(at(member) - most));
        let sum = weights.iter().sum::<f64>().max(1e-300);
        together.push(most + libm::log(sum));
        weights.iter_mut().for_each(|weight| *weight = (1.0 - SHARED) * *weight / sum + SHARED * share);
    }
    Some(together)
}

/// Log densities of the unseen samples, one after the other, in units of the model's noise.
fn densities(fit: &Fit, data: &Data) -> Option<Vec<f64>> {
    let longest = data.recordings.iter().map(Signals::len).max()?;
    let seen = fit.rows.sensor_sd / fit.hypothesis.scales.noise;
    let runs = runs(&fit.hypothesis, &fit.point, &data.whole(), &mut Cache::default(), longest, true)?;
    let mut all = Vec::new();
    for (run, fitted) in runs.iter().zip(&data.fitted) {
        let unseen = run.scaled.iter().zip(&run.log_scales).skip(*fitted);
        all.extend(unseen.map(|(e, log)| -0.5 * (e * e / (seen * seen) + log) - libm::log(seen)));
    }
    Some(all)
}

/// What one's densities gain over the other's.
fn beyond(better: &[f64], worse: &[f64], share: f64) -> Option<Gained> {
    let differences: Vec<f64> = better.iter().zip(worse).map(|(a, b)| a - b).collect();
    if differences.is_empty() {
        return None;
    }
    let sum: f64 = differences.iter().sum();
    let mean = sum / differences.len() as f64;
    let square: f64 = differences.iter().map(|d| (d - mean) * (d - mean)).sum();
    Some(Gained { sum, error: libm::sqrt(square), independent: share * sum })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What gains 20 nats in so many standard errors, beside a strongest term that gains 30 or 3 000: a further one needs three of them, one of about the same size only what any does.
    #[test]
    fn a_further_term_needs_three_standard_errors() {
        let gained = |errors: f64| Gained { sum: 20.0, error: 20.0 / errors, independent: 20.0 };
        for (errors, beside_equal, beside_stronger) in
            [(1.0, true, false), (2.9, true, false), (3.1, true, true)]
        {
            let is_proof = |strongest| gained(errors).is_proof(1, strongest);
            assert_eq!((is_proof(30.0), is_proof(3_000.0)), (beside_equal, beside_stronger), "{errors}");
        }
        // Chance is not ruled out.
        let little = Gained { sum: 2.0, error: 1.5, independent: 2.0 };
        assert!(!little.is_proof(1, 2.0));
    }
}
