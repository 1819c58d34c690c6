//! Which candidate, if any: false alarms are controlled first, then rivals are compared.
//!
//! A term is accepted only if all of these hold: it gains on the training part by far more than its parameters cost
//! (Bayesian criterion on the effective number of samples); it gains on the hold-out by more than two standard errors over
//! contiguous blocks; and in closed loop it moves u by a part that matters. What comes within the margin of the winner is
//! a tie, not a loser.

use super::Rejected;
use super::candidates::Candidate;
use super::fit::Fit;
use super::holdout;
use super::signals::Signals;
use super::whiten::independent_share;

/// What a term must gain beyond its cost, in log-likelihood.
pub(super) const LEAST_GAIN: f64 = 12.0;
/// Standard errors by which the hold-out must gain.
const LEAST_ERRORS: f64 = 2.0;
/// Rivals closer than this in log-likelihood over both recordings are tied: smooth ones, and those with a hidden state.
const MARGIN_SMOOTH: f64 = 5.0;
const MARGIN_HYSTERETIC: f64 = 10.0;
/// Part of the winner's gain that tells two kinds with as many numbers apart at the least: closer than this, it is how two
/// simulators discretise that decides (a lag before or behind a servo, on generated loops: 0.0002).
const SAME_PHYSICS: f64 = 5e-4;

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
    let share = independent_share(&white);
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

/// A candidate that is named, and the kinds that these recordings can't tell from it.
#[derive(Debug, Clone)]
pub struct Winner {
    /// The candidate.
    pub scored: Scored,
    /// The kinds.
    pub tied: Vec<&'static str>,
}

impl Winner {
    /// Tied with nothing.
    pub fn alone(scored: Scored) -> Self {
        Self { scored, tied: Vec::new() }
    }
}

/// The accepted rival with the fewest numbers within the margin of the best, where it has fewer than that.
pub fn simplest<'a>(best: &Scored, scored: &'a [Scored]) -> Option<&'a Scored> {
    let numbers = |s: &Scored| s.candidate.fit.model.physical();
    scored
        .iter()
        .filter(|s| s.accepted() && best.total() - s.total() < margin(best, s) && numbers(s) < numbers(best))
        .min_by_key(|s| numbers(s))
}

/// The winner with what comes within the margin.
pub fn with_ties(winner: &Scored, scored: &[Scored]) -> Winner {
    let mut tied: Vec<&'static str> = Vec::new();
    for rival in ties(winner, scored) {
        let kind = rival.candidate.kind.name;
        // A load that acts throughout and one that begins later are of one kind.
        if !tied.contains(&kind) {
            tied.push(kind);
        }
    }
    // Of two that commute exactly, the loop's own name stands for both.
    let lag = scored.iter().find(|s| s.candidate.kind.name == "unmodelled_lag");
    if let Some(lag) =
        lag.filter(|_| winner.candidate.kind.name == "sensor_lag" && tied.contains(&"unmodelled_lag"))
    {
        tied.retain(|kind| *kind != "unmodelled_lag");
        tied.push("sensor_lag");
        return Winner { scored: lag.clone(), tied };
    }
    Winner { scored: winner.clone(), tied }
}

/// Accepted rivals that the recordings can't tell from the winner.
fn ties<'a>(winner: &'a Scored, scored: &'a [Scored]) -> impl Iterator<Item = &'a Scored> {
    let numbers = |s: &Scored| s.candidate.fit.model.physical();
    scored.iter().filter(move |rival| {
        let margin = margin(winner, rival);
        let close = if numbers(rival) <= numbers(winner) {
            margin.max(SAME_PHYSICS * winner.total())
        } else {
            margin
        };
        rival.candidate.kind != winner.candidate.kind
            && rival.accepted()
            && (winner.total() - rival.total()).abs() < close
    })
}

fn margin(one: &Scored, other: &Scored) -> f64 {
    let hysteretic = |s: &Scored| matches!(s.candidate.kind.name, "backlash" | "stiction");
    if hysteretic(one) && hysteretic(other) { MARGIN_HYSTERETIC } else { MARGIN_SMOOTH }
}

/// How far a rival lies behind the winner.
fn behind(rival: &Scored, winner: &Scored) -> String {
    let (by, name) = (winner.total() - rival.total(), winner.candidate.kind.name);
    if by < 0.0 {
        return format!("{:.1} more likely, but {name} does nearly all of it with fewer numbers", -by);
    }
    format!("{by:.1} less likely than {name} over both recordings")
}

/// Why each of the others lost; `vetoed` are those that the closed loop spoke against.
pub fn losers(scored: &[Scored], winner: Option<&Winner>, vetoed: Vec<Rejected>) -> Vec<Rejected> {
    let lost = |s: &Scored| {
        let kind = s.candidate.kind.name;
        if winner.is_some_and(|w| w.scored.candidate.kind == s.candidate.kind || w.tied.contains(&kind)) {
            return None;
        }
        let veto = vetoed.iter().find(|veto| veto.kind == kind);
        Some(veto.cloned().unwrap_or_else(|| Rejected {
            kind,
            why: match winner {
                Some(winner) if s.accepted() => behind(s, &winner.scored),
                _ => s.why_not(),
            },
            smallest: None,
        }))
    };
    scored.iter().filter_map(lost).collect()
}
