//! Fits the candidates: one step from each kind's best starting points, a short search from the better ones, a full one
//! for those that could still win.

use rayon::prelude::*;

use crate::physics::{Kind, Term};

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

/// Kinds looked at after the screening, of those that it puts first.
const LOOKED_AT: usize = 14;
/// Starting points of a kind that are followed beyond one step.
const FOLLOWED: usize = 3;
/// Candidates fitted to the end.
const FINALISTS: usize = 5;

/// Fits the kinds that the screening puts first; the finalists first, by falling likelihood.
pub fn fit_all(trials: &[Vec<Trial>], signals: &Signals) -> Vec<Candidate> {
    let mut ranked: Vec<&Vec<Trial>> = trials.iter().collect();
    let best = |trials: &[Trial]| trials.iter().map(|t| t.share).fold(f64::NEG_INFINITY, f64::max);
    ranked.sort_by(|a, b| best(b).total_cmp(&best(a)));
    ranked.truncate(LOOKED_AT);
    let mut looked: Vec<Candidate> = ranked.par_iter().filter_map(|trials| look(trials, signals)).collect();
    branch(&mut looked, signals);
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

/// A short search from the better starts; the most likely end, with a noise model of its own.
fn look(trials: &[Trial], signals: &Signals) -> Option<Candidate> {
    let kind = trials.first()?.term.kind;
    let mut begun: Vec<Fit> = trials
        .par_iter()
        .filter_map(|trial| {
            Some(Fit::start(&trial.model, signals, &Whitener::none())?.search(signals, Effort::STEP))
        })
        .collect();
    begun.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    begun.truncate(FOLLOWED);
    begun
        .into_par_iter()
        .map(|fit| Candidate { kind, fit: fit.search(signals, Effort::LOOK).renoised() })
        .max_by(|a, b| a.fit.log_likelihood.total_cmp(&b.fit.log_likelihood))
}

/// Stiction once more from where backlash ended: both are hysteresis, and the jumps show only once the width and the
/// plant's own numbers are about right.
fn branch(looked: &mut Vec<Candidate>, signals: &Signals) {
    let Some(play) = looked.iter().find(|c| c.kind.name == "backlash") else { return };
    let Some((point, _)) = play.fit.model.loop_at(&play.fit.model.x) else { return };
    let Some(width) = point.physics.last().and_then(|term| term.value("width")) else { return };
    if width <= 0.0 {
        return;
    }
    let plain = play.fit.model.without_term(point.physics.len().saturating_sub(1));
    let sizes =
        [0.5, 0.6, 0.7, 0.85, 1.0].into_iter().flat_map(|band| [0.1, 0.3, 0.5].map(|jump| (band, jump)));
    let trials: Vec<Trial> = sizes
        .filter_map(|(band, jump)| {
            let band = band * width;
            let term = Term::new("stiction", &[("stick_band", band), ("slip_jump", jump * band)]).ok()?;
            Some(Trial { model: plain.with_term(&term, false, signals.duration_s()), term, share: 0.0 })
        })
        .collect();
    let Some(found) = look(&trials, signals) else { return };
    match looked.iter_mut().find(|c| c.kind == found.kind) {
        Some(old) if old.fit.log_likelihood < found.fit.log_likelihood => *old = found,
        Some(_) => {}
        None => looked.push(found),
    }
}

/// To the end: first on the plain error, then with the noise model.
fn polish(fit: Fit, signals: &Signals) -> Fit {
    let plain = fit.with_whitener(Whitener::none()).search(signals, Effort::FULL);
    plain.settle(signals, Effort::FULL)
}
