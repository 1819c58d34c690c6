//! The diagnosis where the plant had to be identified or the control law is unknown.
//!
//! Such a plant is a guess of its own, and without a law no closed loop can be simulated. A wide search would take whatever
//! the linear plant lacks for some physics of the library. So only few effects compete, each with a proof of its own: a hidden
//! limit ([`identify`](super::identify)), a sticking valve ([`valve`](super::valve)), loads and sensor biases that come and go
//! ([`spans`](super::spans)). The law being unknown, the proof is that y follows the recorded u better: of a limit on samples that were
//! not fitted, of spans by how well the others predict each. Spans are events of their own, so they are looked for in the
//! whole recording, and so are their sizes.

use crate::physics::{Place, Term};
use crate::{Error, Result};

use super::candidates::Candidate;
use super::closed_loop::error_at;
use super::conclude::Ending;
use super::fit::{Effort, Fit, mean_square};
use super::holdout;
use super::identify::Identified;
use super::model::{Free, Model, Target};
use super::select::{self, Scored, Winner};
use super::signals::deviation;
use super::spans::{self, Acting};
use super::valve::Valve;
use super::whiten::{Whitener, effective_samples};
use super::{Case, Diagnosis, Fits, Rejected, controller_replay};

/// Standard errors of its weakest span by which what comes and goes must be there.
const LEAST_ERRORS: f64 = 4.0;

/// Squared error that some of the terms a plant was identified with may leave, over what all of them leave.
const MUCH_LEFT: f64 = 4.0;
/// Part of the squared error that a constant load may leave, and the same over what refitted numbers leave.
const NEARLY_ALL_LEFT: f64 = 1.0 / 16.0;
const AS_GOOD_AS_REFITTED: f64 = 2.0;

fn lost() -> Error {
    Error::new("the plant can't follow the recorded u: it diverges")
}

/// The model with the plant's numbers held, all but its offset.
fn at_its_operating_point(model: &Model) -> Model {
    plant_held(model, |free| free.name != "plant.offset")
}

/// The model with all of the plant's numbers held.
fn as_stated(model: &Model) -> Model {
    plant_held(model, |_| true)
}

fn plant_held(model: &Model, which: impl Fn(&Free) -> bool) -> Model {
    let held = |free: &&Free| matches!(free.target, Target::Plant(_)) && which(free);
    let targets: Vec<Target> = model.free.iter().filter(held).map(|free| free.target).collect();
    targets.into_iter().fold(model.clone(), |model, target| model.held(target))
}

/// The fit with the terms that stand, and those that do not.
struct Proven {
    base: Fit,
    named: Vec<Winner>,
    /// Where something is, where those that stand leave much that all together explain: their numbers would make up for the others.
    located: Option<Place>,
    rejected: Vec<Rejected>,
}

impl Diagnosis {
    /// Of events that were looked for in the whole recording nothing was held out.
    fn nothing_held_out(mut self) -> Self {
        self.holdout = Fits::default();
        self.improvement = None;
        self
    }
}

impl Case<'_> {
    /// The diagnosis with the few effects that an identified plant or an unknown law leave room for.
    pub(super) fn run_recorded(&self, identified: Option<&Identified>) -> Result<Diagnosis> {
        let stated = Fit::start(&Model::refit(self.nominal, self.train), self.train, &Whitener::none())
            .ok_or_else(lost)?;
        let refit = stated.clone().search(self.train, Effort::FULL);
        let missing = self.missing_drive(&refit);
        let controller = controller_replay::replay(self.nominal, self.train);
        let with = identified.map_or(&[][..], |found| &found.with);
        let Proven { base, named, located, rejected } = self.proven(&stated, &refit, with);
        // A plant from the very recording has taken up part of what comes and goes in it.
        if identified.is_none()
            && named.is_empty()
            && let Some(found) = self.run_spans(&stated)?
        {
            return Ok(found);
        }
        if identified.is_none()
            && let Some((without, scored)) = self.constant_load(&stated, &refit)
        {
            let base = scored.candidate.fit.clone().renoised();
            let tied = vec!["sensor_bias"];
            let named = vec![Winner { scored, tied }];
            let refit = without.renoised();
            return self.conclude(Ending {
                stated,
                refit,
                base,
                named,
                located: None,
                rejected,
                missing,
                controller,
            });
        }
        let (refit, base) = (refit.renoised(), base.renoised());
        self.conclude(Ending { stated, refit, base, named, located, rejected, missing, controller })
    }

    /// A load that is there all the time and was not when the plant's numbers were found: the fit without it and the load. A plant rests a
    /// little elsewhere every day, so that it must be nearly all of what the stated numbers do not explain.
    fn constant_load(&self, stated: &Fit, refit: &Fit) -> Option<(Fit, Scored)> {
        let fit = |model: &Model| {
            Some(Fit::start(model, self.train, &Whitener::none())?.search(self.train, Effort::FULL))
        };
        let held = as_stated(&stated.model);
        let without = fit(&held)?;
        let level = 0.1 * deviation(&self.train.u) * self.nominal.plant.drive_gain().abs();
        let load = Term::new("load_step", &[("level", level)]).ok()?;
        let with = fit(&held.with_term(&load, false, self.train.duration_s()))?;
        let left = mean_square(&with.residual);
        let nearly_all = left < NEARLY_ALL_LEFT * mean_square(&without.residual)
            && left < AS_GOOD_AS_REFITTED * mean_square(&refit.residual);
        let scored = self.score_free_run(&without, Candidate { kind: load.kind, fit: with.clone() })?;
        // What is left without it is one long error, worth a sample or two by its own correlation; the noise is what is left with it.
        let worth = effective_samples(&with.residual);
        let gained = libm::log(mean_square(&without.residual) / left.max(1e-300));
        let scored = Scored { train_gain: 0.5 * (worth * gained - libm::log(worth.max(2.0))), ..scored };
        (nearly_all && scored.accepted() && self.matters(&without, &with)).then_some((without, scored))
    }

    /// The diagnosis with what comes and goes, over the whole recording; `None` where nothing does.
    fn run_spans(&self, stated: &Fit) -> Result<Option<Diagnosis>> {
        let (model, _) = stated.model.loop_at(&stated.model.x).ok_or_else(lost)?;
        let steps = spans::steps(&model, self.whole).unwrap_or_default();
        let acting: Vec<Acting> = spans::terms(&steps, self.whole)
            .into_iter()
            .filter(|a| a.errors > LEAST_ERRORS && a.gain > self.event_gain)
            .collect();
        if acting.is_empty() {
            return Ok(None);
        }
        let case = Case { train: self.whole, ..*self };
        let stated = Fit::start(&Model::refit(self.nominal, self.whole), self.whole, &Whitener::none());
        let stated = stated.ok_or_else(lost)?;
        let refit = stated.clone().search(self.whole, Effort::FULL).renoised();
        // The plant stays as stated but for its operating point: what disturbs the loop tells little of the plant.
        let with = acting.iter().fold(at_its_operating_point(&stated.model), |model, acting| {
            model.with_term(&acting.term, false, self.whole.duration_s())
        });
        let base = Fit::start(&with, self.whole, &Whitener::none()).ok_or_else(lost)?;
        let base = base.renoised().search(self.whole, Effort::FULL).settle(self.whole, Effort::FULL);
        // Over all of it, for an event in the part that is not held out helps nothing there; and against all numbers refitted.
        let closer = match (error_at(&base.model, self.whole), error_at(&refit.model, self.whole)) {
            (Some(with), Some(without)) => with < without,
            (with, _) => with.is_some(),
        };
        if !closer || !self.helps(&refit, &base) {
            return Ok(None);
        }
        let named = acting.into_iter().map(|acting| {
            let candidate = Candidate { kind: acting.term.kind, fit: base.clone() };
            let (train_gain, holdout_errors) = (acting.gain, acting.errors);
            Winner::alone(Scored { candidate, train_gain, holdout_gain: 0.0, holdout_errors })
        });
        let missing = case.missing_drive(&refit);
        let controller = controller_replay::replay(self.nominal, self.whole);
        let named = named.collect();
        let rejected = Vec::new();
        let ending = Ending { stated, refit, base, named, located: None, rejected, missing, controller };
        case.conclude(ending).map(|found| Some(found.nothing_held_out()))
    }

    /// The diagnosis of a valve that sticks: its numbers stay as they were found, the plant's are refitted; `None` where y is followed no
    /// better with it.
    pub(super) fn run_valve(&self, valve: &Valve) -> Result<Option<Diagnosis>> {
        let start = |model: &Model| Fit::start(model, self.train, &Whitener::none()).ok_or_else(lost);
        let stated = start(&Model::refit(self.nominal, self.train))?;
        let refit = stated.clone().search(self.train, Effort::FULL).renoised();
        let term = self.nominal.physics.len();
        let model = stated.model.with_term(&valve.term, false, self.train.duration_s());
        let model = model.held(Target::Term { term, parameter: 0 });
        let model = model.held(Target::Term { term, parameter: 1 });
        let base = start(&model)?.search(self.train, Effort::FULL).renoised();
        // A noise model may hide that the linear plant by itself follows y better.
        if mean_square(&base.residual) > mean_square(&refit.residual) {
            return Ok(None);
        }
        let candidate = Candidate { kind: valve.term.kind, fit: base.clone() };
        let scored = self.score_free_run(&refit, candidate.clone());
        let scored = Scored {
            train_gain: valve.gain,
            holdout_gain: 0.0,
            holdout_errors: scored.map_or(f64::NAN, |scored| scored.holdout_errors),
            candidate,
        };
        let missing = self.missing_drive(&refit);
        let named = vec![Winner { scored, tied: valve.tied.clone() }];
        let rejected = Vec::new();
        let ending =
            Ending { stated, refit, base, named, located: None, rejected, missing, controller: None };
        let mut found = self.conclude(ending)?;
        if let Some(named) = found.physics.first_mut() {
            named.half_widths.clone_from(&valve.half_widths);
        }
        Ok(Some(found.nothing_held_out()))
    }

    /// What the plant was identified with, each term against the best fit without it; one that does not stand goes, and the others are judged
    /// again.
    fn proven(&self, stated: &Fit, refit: &Fit, with: &[Term]) -> Proven {
        let mut with = with.to_vec();
        let mut rejected = Vec::new();
        let mut all_leave = f64::INFINITY;
        let mut located = None;
        while !with.is_empty() {
            let Some(fit) = self.fit_with(stated, &with) else { break };
            let left = mean_square(&fit.residual);
            all_leave = all_leave.min(left);
            let judged = |(gone, term): (usize, &Term)| {
                let others: Vec<Term> = with
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| *i != gone)
                    .map(|(_, term)| term.clone())
                    .collect();
                let base = if others.is_empty() { refit.clone() } else { self.fit_with(stated, &others)? };
                let scored = self.score_free_run(&base, Candidate { kind: term.kind, fit: fit.clone() })?;
                Some((scored.accepted() && self.matters(&base, &fit), scored))
            };
            let judged: Option<Vec<(bool, Scored)>> = with.iter().enumerate().map(judged).collect();
            let Some(judged) = judged else { break };
            let weakest = (judged.iter().enumerate().filter(|(_, (stands, _))| !stands))
                .min_by(|a, b| a.1.1.train_gain.total_cmp(&b.1.1.train_gain));
            let Some((weakest, (_, scored))) = weakest else {
                if left > MUCH_LEFT * all_leave {
                    located = judged.first().map(|(_, scored)| scored.candidate.kind.place);
                    break;
                }
                let named = judged.into_iter().map(|(_, scored)| Winner::alone(scored)).collect();
                return Proven { base: fit, named, located, rejected };
            };
            rejected.extend(select::losers(std::slice::from_ref(scored), None, Vec::new()));
            with.remove(weakest);
        }
        Proven { base: refit.clone(), named: Vec::new(), located, rejected }
    }

    fn fit_with(&self, stated: &Fit, with: &[Term]) -> Option<Fit> {
        let duration_s = self.train.duration_s();
        let model =
            with.iter().fold(stated.model.clone(), |model, term| model.with_term(term, false, duration_s));
        let across = model.across_the_gap();
        let starts = across.iter().filter_map(|model| Fit::start(model, self.train, &Whitener::none()));
        let best = starts.min_by(|a, b| a.variance.total_cmp(&b.variance))?;
        Some(best.search(self.train, Effort::FULL))
    }

    /// Scores a candidate by how much better its free run follows y. A noise model would not do: where the linear plant is only
    /// about right, it takes the slow misfit for noise, and with it most of what tells the two apart. The price is fewer
    /// independent samples: as many as the correlation of what is left allows.
    fn score_free_run(&self, base: &Fit, candidate: Candidate) -> Option<Scored> {
        let residuals = [&base.residual, &candidate.fit.residual];
        let worth = residuals.map(|e| effective_samples(e)).into_iter().fold(f64::INFINITY, f64::min);
        let ratio = mean_square(&base.residual) / mean_square(&candidate.fit.residual).max(1e-300);
        let extra = candidate.fit.model.physical().saturating_sub(base.model.physical()) as f64;
        let blocks = |fit: &Fit| holdout::block_likelihoods(fit, self.holdout, &Whitener::none());
        let (with, without) = (blocks(&candidate.fit)?, blocks(base)?);
        let (mean, errors) = holdout::gain(&with, &without);
        let share = worth / base.residual.len().max(1) as f64;
        Some(Scored {
            train_gain: 0.5 * (worth * libm::log(ratio) - extra * libm::log(worth.max(2.0))),
            holdout_gain: mean * with.len() as f64 * share,
            holdout_errors: errors,
            candidate,
        })
    }
}
