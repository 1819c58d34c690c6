//! Which candidate, if any: false alarms are controlled first, then rivals are compared.
//!
//! A term is accepted only if all of these hold: it gains on the training part by far more than its parameters cost
//! (Bayesian criterion on the effective number of samples); it gains on the hold-out by more than two standard errors over
//! contiguous blocks; and in closed loop it moves u by a part that matters. What comes within the margin of the winner is
//! a tie, not a loser.

use super::candidates::Candidate;
use super::fit::Fit;
use super::holdout;
use super::signals::Signals;
use super::whiten::effective_samples;

/// What a term must gain beyond its cost, in log-likelihood.
const LEAST_GAIN: f64 = 12.0;
/// Standard errors by which the hold-out must gain.
const LEAST_ERRORS: f64 = 2.0;
/// Rivals closer than this in log-likelihood over both recordings are tied: smooth ones, and those with a hidden state.
const MARGIN_SMOOTH: f64 = 5.0;
const MARGIN_HYSTERETIC: f64 = 10.0;

/// A candidate with what speaks for it.
#[derive(Debug, Clone)]
pub struct Scored {
    /// The candidate.
    pub candidate: Candidate,
    /// Gain in log-likelihood on the training part over the refitted nominal, less the cost of its parameters.
    pub train_gain: f64,
    /// Gain on the hold-out.
    pub holdout_gain: f64,
    /// The same in its standard errors.
    pub holdout_errors: f64,
}

impl Scored {
    /// What rivals are compared by.
    pub fn total(&self) -> f64 {
        self.train_gain + self.holdout_gain
    }

    /// Whether it holds on both recordings.
    pub fn accepted(&self) -> bool {
        self.train_gain > LEAST_GAIN && self.holdout_errors > LEAST_ERRORS
    }

    /// Why it was not accepted.
    pub fn why_not(&self) -> String {
        if self.train_gain <= LEAST_GAIN {
            format!(
                "gains {:.1} in log-likelihood after the cost of its parameters; {LEAST_GAIN} are asked for",
                self.train_gain
            )
        } else {
            format!(
                "gains {:.1} standard errors on the hold-out; {LEAST_ERRORS} are asked for",
                self.holdout_errors
            )
        }
    }
}

/// Scores all candidates against the refitted nominal model, best first.
pub fn score(nominal: &Fit, candidates: Vec<Candidate>, holdout: &Signals) -> Vec<Scored> {
    // One noise model for all: that of the most likely model. The nominal one's would take slow effects for noise.
    let likely = candidates.iter().map(|c| &c.fit).chain([nominal]);
    let likely = likely.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)).unwrap_or(nominal);
    let whitener = likely.whitener.clone();
    let reference = holdout::block_likelihoods(nominal, holdout, &whitener).unwrap_or_default();
    // What is left of the best is the noise; the nominal model's own error may be far more correlated than that.
    let white = if nominal.model.whitens() { nominal.white() } else { likely.white() };
    let share = effective_samples(&white) / white.len().max(1) as f64;
    let cost = 0.5 * libm::log((white.len() as f64 * share).max(2.0));
    let mut scored: Vec<Scored> = candidates
        .into_iter()
        .map(|candidate| {
            let extra = candidate.fit.model.physical().saturating_sub(nominal.model.physical()) as f64;
            let raw = candidate.fit.log_likelihood - nominal.log_likelihood;
            let blocks = holdout::block_likelihoods(&candidate.fit, holdout, &whitener).unwrap_or_default();
            let (mean, errors) = holdout::gain(&blocks, &reference);
            let usable = blocks.len() == reference.len() && !blocks.is_empty();
            Scored {
                train_gain: raw * share - extra * cost,
                holdout_gain: if usable { mean * blocks.len() as f64 * share } else { f64::NEG_INFINITY },
                holdout_errors: if usable { errors } else { f64::NEG_INFINITY },
                candidate,
            }
        })
        .collect();
    scored.sort_by(|a, b| b.total().total_cmp(&a.total()));
    scored
}

/// Accepted rivals that the recordings can't tell from the winner, by margin or by what is known of the kinds.
pub fn ties<'a>(winner: &Scored, others: &'a [Scored]) -> Vec<&'a Scored> {
    let hysteretic = |s: &Scored| matches!(s.candidate.kind.name, "backlash" | "stiction");
    others
        .iter()
        .filter(|rival| {
            let margin =
                if hysteretic(winner) && hysteretic(rival) { MARGIN_HYSTERETIC } else { MARGIN_SMOOTH };
            rival.accepted() && winner.total() - rival.total() < margin
        })
        .collect()
}
