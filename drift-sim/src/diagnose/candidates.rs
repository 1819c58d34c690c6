//! Fits the candidates: one step from each kind's best starting points, a short search from the better ones, a full one
//! for those that could still win.

use crate::cores::AcrossCores as _;

use crate::physics::{Kind, Term};

use super::fit::{Effort, Fit};
use super::screen::Trial;
use super::signals::Signals;
use super::sticking_valve;
use super::whiten::Whitener;

/// A kind of physics, fitted together with the nominal parameters.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The last term of the model.
    pub kind: &'static Kind,
    /// The fit.
    pub fit: Fit,
}

/// Starting points of a kind that are followed beyond one step.
const FOLLOWED: usize = 3;
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

/// Candidates with their place among all.
type Ranked = Vec<(usize, Candidate)>;

/// Fits the kinds that the screening hands on, on top of `base`; `stated` is the loop file's own plant.
pub fn fit_all(trials: &[Vec<Trial>], stated: &Fit, base: &Fit, signals: &Signals) -> Fitted {
    let mut looked: Vec<Candidate> = trials.par_iter().filter_map(|trials| look(trials, signals)).collect();
    sort(&mut looked);
    branch(&mut looked, stated, signals);
    twin(&mut looked, signals);
    sort(&mut looked);
    let mut looked = looked.into_iter();
    let Some((plain, leader)) = looked.next().and_then(|leader| polish(leader, signals)) else {
        return Fitted::default();
    };
    let gained = |c: &Candidate| c.fit.log_likelihood - base.log_likelihood;
    let within_reach = within_reach(base, std::slice::from_ref(&leader));
    let (close, far): (Ranked, Ranked) =
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

/// The gain in log-likelihood, before a search to the end, from which a candidate may still win against these.
pub(super) fn within_reach(base: &Fit, fitted: &[Candidate]) -> f64 {
    let gained = fitted.iter().map(|c| c.fit.log_likelihood - base.log_likelihood);
    WITHIN_REACH * gained.fold(0.0, f64::max)
}

fn sort(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| b.fit.log_likelihood.total_cmp(&a.fit.log_likelihood));
}

/// One step from each start, a short search from the best of them; the most likely end, with a noise model of its own.
fn look(trials: &[Trial], signals: &Signals) -> Option<Candidate> {
    let kind = trials.first()?.term.kind;
    let mut begun: Vec<Fit> = trials
        .par_iter()
        .filter_map(|trial| {
            let model = trial.model.clone().coarse();
            Some(Fit::start(&model, signals, &Whitener::none())?.search(signals, Effort::STEP))
        })
        .collect();
    begun.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    begun.truncate(FOLLOWED);
    begun
        .into_par_iter()
        .map(|fit| Candidate { kind, fit: fit.search(signals, Effort::LOOK).renoised() })
        .max_by(|a, b| a.fit.log_likelihood.total_cmp(&b.fit.log_likelihood))
}

/// Stiction once more where a hysteresis leads; see [`sticking_valve`].
fn branch(looked: &mut Vec<Candidate>, stated: &Fit, signals: &Signals) {
    let Some(leader) = looked.first() else { return };
    let Some((point, _)) = leader.fit.model.loop_at(&leader.fit.model.x) else { return };
    let width = match point.physics.last() {
        Some(term) if term.kind.name == "backlash" => term.value("width"),
        Some(term) => term.value("stick_band").map(|band| 2.0 * band),
        None => None,
    };
    let Some(width) = width.filter(|width| *width > 0.0) else { return };
    let Ok(kind) = Kind::named("stiction") else { return };
    if let Some(fit) = sticking_valve::fit(stated, width, signals) {
        keep_better(looked, Candidate { kind, fit: fit.renoised() });
    }
}

/// The candidate in place of a less likely one of its kind.
fn keep_better(looked: &mut Vec<Candidate>, found: Candidate) {
    match looked.iter_mut().find(|c| c.kind == found.kind) {
        Some(old) if old.fit.log_likelihood < found.fit.log_likelihood => *old = found,
        Some(_) => {}
        None => looked.push(found),
    }
}

/// A lag of the sensor is a lag of the loop, as far as r, y and u show: what one has found is a start for the other.
fn twin(looked: &mut Vec<Candidate>, signals: &Signals) {
    let Some(sensor) = looked.iter().find(|c| c.kind.name == "sensor_lag").cloned() else { return };
    let Ok(kind) = Kind::named("unmodelled_lag") else { return };
    let Some((point, _)) = sensor.fit.model.loop_at(&sensor.fit.model.x) else { return };
    let Some(lag) = point.physics.last().and_then(|term| term.value("time_constant_s")) else { return };
    let Ok(term) = Term::new(kind.name, &[("time_constant_s", lag)]) else { return };
    let model = sensor.fit.model.without_term(point.physics.len().saturating_sub(1));
    let model = model.with_term(&term, false, signals.duration_s());
    let Some(found) = look(&[Trial { model, term, share: 0.0 }], signals) else { return };
    keep_better(looked, found);
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
