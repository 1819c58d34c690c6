//! What a fitted model is worth on samples that it has not seen.

use crate::control_loop::Loop;

use super::fit::{Effort, Fit, mean_square};
use super::model::Model;
use super::signals::Signals;
use super::whiten::Whitener;

/// Contiguous blocks over which the gain is averaged; their scatter gives its standard error.
const BLOCKS: usize = 16;

/// Each block's part of the log-likelihood of the hold-out, its noise's size being free in each block; `whitener` has to be the
/// same for models that are compared, else the noise models compete instead of the physics. Only the state at the
/// hold-out's first sample is found anew.
pub fn block_likelihoods(fit: &Fit, holdout: &Signals, whitener: &Whitener) -> Option<Vec<f64>> {
    let white = whitener.apply(&residual(fit, holdout, whitener)?);
    let length = (white.len() / BLOCKS).max(1);
    Some(
        white
            .chunks(length)
            .take(BLOCKS)
            .map(|block| -0.5 * block.len() as f64 * libm::log(mean_square(block).max(1e-300)))
            .collect(),
    )
}

/// Measured less predicted y on the hold-out, the parameters being those of the fit.
pub fn residual(fit: &Fit, holdout: &Signals, whitener: &Whitener) -> Option<Vec<f64>> {
    let (fitted, _) = fit.model.loop_at(&fit.model.x)?;
    Some(started(&fitted, holdout, whitener)?.residual)
}

/// y as the loop's plant makes it of the recorded u, from the start that fits best.
pub fn free_run(model: &Loop, signals: &Signals) -> Option<Vec<f64>> {
    let fit = started(model, signals, &Whitener::none())?;
    fit.model.predict(&fit.model.x, signals)
}

/// The loop at the start that fits best, its numbers as they are.
fn started(model: &Loop, signals: &Signals, whitener: &Whitener) -> Option<Fit> {
    let starts = only_start(model, signals).across_the_gap();
    let fits = starts.iter().filter_map(|model| {
        let started = Fit::start(model, signals, whitener)?;
        Some(if model.free.is_empty() { started } else { started.search(signals, Effort::LOOK) })
    });
    fits.min_by(|a, b| a.variance.total_cmp(&b.variance))
}

fn only_start(model: &Loop, signals: &Signals) -> Model {
    let mut states = Model::refit(model, signals);
    let keep: Vec<bool> = states.free.iter().map(|f| f.target.is_start()).collect();
    let mut flags = keep.iter();
    states.free.retain(|_| flags.next().copied().unwrap_or(false));
    let mut flags = keep.iter();
    states.x.retain(|_| flags.next().copied().unwrap_or(false));
    states
}

/// Mean gain per block of one model over another, and how many standard errors the gain is above none. The errors are
/// those of `asinh(gain)`: blocks in which the term hardly acts gain little and others very much, which is no reason to
/// doubt it, so that large gains count by their logarithm.
pub fn gain(better: &[f64], worse: &[f64]) -> (f64, f64) {
    let differences: Vec<f64> = better.iter().zip(worse).map(|(a, b)| a - b).collect();
    let n = differences.len().max(1) as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let tamed: Vec<f64> = differences.iter().map(|d| libm::asinh(*d)).collect();
    let centre = tamed.iter().sum::<f64>() / n;
    let spread = tamed.iter().map(|d| (d - centre) * (d - centre)).sum::<f64>() / (n - 1.0).max(1.0);
    (mean, centre / libm::sqrt(spread / n).max(1e-300))
}
