//! Fits the candidates: a short search from each kind's best starting points, a full one for those that could still win.

use rayon::prelude::*;

use crate::physics::Kind;

use super::fit::{Effort, Fit};
use super::screen::Trial;
use super::signals::Signals;
use super::whiten::Whitener;

/// A kind of physics, fitted together with the nominal parameters.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The last term of the model.
    pub kind: &'static Kind,
    /// The fit.
    pub fit: Fit,
}

/// Candidates fitted to the end.
const FINALISTS: usize = 7;

/// Fits every kind; the finalists first, by falling likelihood.
pub fn fit_all(trials: &[Vec<Trial>], signals: &Signals) -> Vec<Candidate> {
    let mut looked: Vec<Candidate> = trials.par_iter().filter_map(|trials| look(trials, signals)).collect();
    sort(&mut looked);
    let finish = looked.len().min(FINALISTS);
    let rest = looked.split_off(finish);
    let mut finished: Vec<Candidate> =
        looked.into_par_iter().map(|c| Candidate { fit: polish(c.fit, signals), ..c }).collect();
    sort(&mut finished);
    finished.extend(rest);
    finished
}

fn sort(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| b.fit.log_likelihood.total_cmp(&a.fit.log_likelihood));
}

/// A short search from each start; the most likely end, with a noise model of its own.
fn look(trials: &[Trial], signals: &Signals) -> Option<Candidate> {
    trials
        .iter()
        .filter_map(|trial| {
            let fit = Fit::start(&trial.model, signals, &Whitener::none())?.search(signals, Effort::LOOK);
            Some(Candidate { kind: trial.term.kind, fit: fit.renoised() })
        })
        .max_by(|a, b| a.fit.log_likelihood.total_cmp(&b.fit.log_likelihood))
}

/// To the end: first on the plain error, then with the noise model.
fn polish(fit: Fit, signals: &Signals) -> Fit {
    let plain = fit.with_whitener(Whitener::none()).search(signals, Effort::FULL);
    plain.settle(signals, Effort::FULL)
}
