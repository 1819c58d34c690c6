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
/// Points of the grid for stiction, and how many are followed.
const BANDS: usize = 12;
const JUMPS: usize = 6;
const ON_THE_GRID: usize = 10;
/// Candidates fitted to the end.
const FINALISTS: usize = 5;
/// Part of the leader's gain that a rival must have after its short search to be fitted to the end as well.
const WITHIN_REACH: f64 = 0.25;

/// The fitted kinds, by falling likelihood: the finalists, then those that were only looked at.
#[derive(Debug, Clone, Default)]
pub struct Fitted {
    /// Under noise models.
    pub whitened: Vec<Candidate>,
    /// On the prediction error as it is.
    pub plain: Vec<Candidate>,
}

/// Fits the kinds that the screening puts first, on top of `base`; `stated` is the loop file's own plant.
pub fn fit_all(trials: &[Vec<Trial>], stated: &Fit, base: &Fit, signals: &Signals) -> Fitted {
    let mut ranked: Vec<&Vec<Trial>> = trials.iter().collect();
    let best = |trials: &[Trial]| trials.iter().map(|t| t.share).fold(f64::NEG_INFINITY, f64::max);
    ranked.sort_by(|a, b| best(b).total_cmp(&best(a)));
    ranked.truncate(LOOKED_AT);
    let mut looked: Vec<Candidate> = ranked.par_iter().filter_map(|trials| look(trials, signals)).collect();
    sort(&mut looked);
    branch(&mut looked, stated, signals);
    sort(&mut looked);
    let mut looked = looked.into_iter();
    let Some((plain, leader)) = looked.next().and_then(|leader| polish(leader, signals)) else {
        return Fitted::default();
    };
    let gained = |c: &Candidate| c.fit.log_likelihood - base.log_likelihood;
    let within_reach = WITHIN_REACH * gained(&leader);
    let (close, far): (Vec<(usize, Candidate)>, Vec<(usize, Candidate)>) =
        looked.enumerate().partition(|(rank, c)| *rank + 1 < FINALISTS && gained(c) > within_reach);
    let close = close.into_par_iter().filter_map(|(_, c)| polish(c, signals));
    let (mut plain, mut whitened): (Vec<Candidate>, Vec<Candidate>) = close.chain([(plain, leader)]).unzip();
    sort(&mut plain);
    sort(&mut whitened);
    for (_, candidate) in far {
        let Some(fit) = fine(&candidate.fit, signals) else { continue };
        let kind = candidate.kind;
        whitened.push(Candidate { kind, fit: fit.clone().renoised() });
        plain.push(Candidate { kind, fit: Fit { model: fit.model.clone().plain(), ..fit } });
    }
    Fitted { whitened, plain }
}

fn sort(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| b.fit.log_likelihood.total_cmp(&a.fit.log_likelihood));
}

/// A short search from the better starts.
fn look(trials: &[Trial], signals: &Signals) -> Option<Candidate> {
    follow(trials, FOLLOWED, Effort::LOOK, signals)
}

/// One step from each start, on from the best of them; the most likely end, with a noise model of its own.
fn follow(trials: &[Trial], most: usize, effort: Effort, signals: &Signals) -> Option<Candidate> {
    let kind = trials.first()?.term.kind;
    let mut begun: Vec<Fit> = trials
        .par_iter()
        .filter_map(|trial| {
            let model = trial.model.clone().coarse();
            Some(Fit::start(&model, signals, &Whitener::none())?.search(signals, Effort::STEP))
        })
        .collect();
    begun.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    begun.truncate(most);
    begun
        .into_par_iter()
        .map(|fit| Candidate { kind, fit: fit.search(signals, effort).renoised() })
        .max_by(|a, b| a.fit.log_likelihood.total_cmp(&b.fit.log_likelihood))
}

/// Stiction once more where backlash leads: both are hysteresis, and where the stem slips depends so sharply on band and
/// jump that a gradient finds them only from nearby. A grid over both, beside the width that backlash found, from the
/// stated plant: the refitted one has bent towards the hysteresis.
fn branch(looked: &mut Vec<Candidate>, stated: &Fit, signals: &Signals) {
    let Some(leader) = looked.first().filter(|c| ["backlash", "stiction"].contains(&c.kind.name)) else {
        return;
    };
    let Some((point, _)) = leader.fit.model.loop_at(&leader.fit.model.x) else { return };
    let Some(width) = point.physics.last().and_then(|term| term.parameters.first().copied()) else { return };
    let sizes = (0..BANDS).flat_map(|band| (0..JUMPS).map(move |jump| (band as f64, jump as f64)));
    let trials: Vec<Trial> = sizes
        .filter_map(|(band, jump)| {
            let band = (0.55 + 0.05 * band) * width;
            let jump = (0.05 + 0.1 * jump) * band;
            let term = Term::new("stiction", &[("stick_band", band), ("slip_jump", jump)]).ok()?;
            let model = stated.model.with_term(&term, false, signals.duration_s());
            Some(Trial { model, term, share: 0.0 })
        })
        .collect();
    let Some(found) = follow(&trials, ON_THE_GRID, Effort::FULL, signals) else { return };
    match looked.iter_mut().find(|c| c.kind == found.kind) {
        Some(old) if old.fit.log_likelihood < found.fit.log_likelihood => *old = found,
        Some(_) => {}
        None => looked.push(found),
    }
}

/// To the end: on the error as it is, and from there with the noise model.
fn polish(candidate: Candidate, signals: &Signals) -> Option<(Candidate, Candidate)> {
    let plain = fine(&candidate.fit, signals)?.search(signals, Effort::FULL);
    let whitened = plain.clone().settle(signals, Effort::FULL);
    let plain = Fit { model: plain.model.clone().plain(), ..plain };
    Some((Candidate { fit: plain, ..candidate.clone() }, Candidate { fit: whitened, ..candidate }))
}

/// The point of a coarse search as the simulator sees it.
fn fine(fit: &Fit, signals: &Signals) -> Option<Fit> {
    Fit::start(&fit.model.clone().fine(), signals, &Whitener::none())
}
