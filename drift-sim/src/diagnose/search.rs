//! The search for missing physics in a loop whose plant is stated: refit, then rounds of screening, fitting and selection, each
//! on top of what was named before.

use crate::physics::{Kind, Place};
use crate::{Error, Result};

use super::candidates::{self, Candidate};
use super::closed_loop::error_at;
use super::conclude::Ending;
use super::fit::{Effort, Fit};
use super::missing_drive::MissingDrive;
use super::model::Model;
use super::select::{self, Scored, Winner};
use super::whiten::Whitener;
use super::{
    Case, Diagnosis, Rejected, by_direction, constant_load, controller_replay, features, injected, observer,
    screen,
};

/// Terms named together at most.
const MOST_TERMS: usize = 3;
/// A tie of more kinds is no name.
const MOST_TIED: usize = 3;
/// Part of a richer friction's gain in the closed loop that makes plain dry friction the name to begin with.
const NEARLY_ALL: f64 = 0.9;
/// Closed-loop error of the plain fit, over that of the whitened one, below which the noise model does harm.
const PLAINER: f64 = 0.97;

impl Case<'_> {
    pub(super) fn run(&self) -> Result<Diagnosis> {
        let stated_model = Model::refit(self.nominal, self.train);
        let stated = Fit::start(&stated_model, self.train, &Whitener::none()).ok_or_else(|| {
            Error::new("the nominal model can't follow the recorded u: it diverges")
                .allowed("a loop file whose units, signs and sample time fit the recording")
        })?;
        let refit = stated.clone().search(self.train, Effort::FULL).settle(self.train, Effort::FULL);
        let missing = self.missing_drive(&refit);
        let controller = controller_replay::replay(self.nominal, self.train);

        let under = constant_load::under(&refit, self.train)
            .map(|fit| fit.search(self.train, Effort::FULL).settle(self.train, Effort::FULL));
        let from = under.as_ref().and_then(|_| constant_load::under(&stated, self.train));
        let mut load_is_open = under.is_some();
        let mut base = under.unwrap_or_else(|| refit.clone());
        let mut named: Vec<Winner> = Vec::new();
        let mut rejected = Vec::new();
        let mut located = None;
        // What is left of y tells more than the closed loop, but once a term is named, also what no term explains is in it.
        let begin = !is_white(&base.residual) || self.unexplained(&base);
        let mut rounds = 0;
        while rounds < MOST_TERMS && if rounds == 0 { begin } else { self.unexplained(&base) } {
            let from = if rounds == 0 { from.as_ref().unwrap_or(&stated).clone() } else { base.clone() };
            rounds += 1;
            let left = self.missing_drive(&base);
            let scored;
            (base, scored) = self.round(&from, base, left.as_ref());
            let (winner, losers) = self.pick(&base, &scored);
            if named.is_empty() {
                rejected = losers;
            }
            let Some(winner) = winner else { break };
            if winner.tied.len() > MOST_TIED {
                located = Some(winner.scored.candidate.kind.place);
                break;
            }
            base = winner.scored.candidate.fit.clone();
            named.push(winner);
            if std::mem::take(&mut load_is_open) {
                // Now, before a richer term may take its place.
                (base, named) = self.judge_load(base, named);
            }
            if is_white(&base.residual) {
                // There is nothing more to find.
                break;
            }
        }
        if load_is_open {
            (base, named) = self.judge_load(base, named);
        }
        let refit = if base.model.whitens() { refit } else { refit.plain(self.train) };
        self.conclude(Ending { stated, refit, base, named, located, rejected, missing, controller })
    }

    /// The constant load that was laid under the search stays as a term, the first, or goes.
    fn judge_load(&self, base: Fit, mut named: Vec<Winner>) -> (Fit, Vec<Winner>) {
        let Some(without) = constant_load::without(&base, self.nominal.physics.len(), self.train) else {
            return (base, named);
        };
        let Ok(kind) = Kind::named("load_step") else { return (base, named) };
        let scored = select::score(&without, vec![Candidate { kind, fit: base.clone() }], self.holdout);
        match scored.into_iter().find(|s| s.accepted() && self.matters(&without, &s.candidate.fit)) {
            Some(load) => {
                named.insert(0, Winner::alone(load));
                (base, named)
            }
            None => (without, named),
        }
    }

    pub(super) fn missing_drive(&self, refit: &Fit) -> Option<MissingDrive> {
        let (model, _) = refit.model.loop_at(&refit.model.x)?;
        let linear = model.plant.linear().ok()??;
        let error = observer::undone(&model.plant, &refit.residual, self.train.sample_time_s);
        MissingDrive::of(&linear, &error, self.train.sample_time_s)
    }

    /// All kinds that are not in the model yet, scored against the base.
    fn round(&self, stated: &Fit, base: Fit, missing: Option<&MissingDrive>) -> (Fit, Vec<Scored>) {
        let signatures = features::signatures(self.nominal, self.train, missing);
        let stands = self.nominal.physics.len();
        let present: Vec<&str> = (base.model.nominal.physics.iter().enumerate())
            // A load that begins later may come on top of the constant one.
            .filter(|(i, t)| !(*i == stands && t.kind.name == "load_step" && t.onset_s == 0.0))
            .map(|(_, t)| t.kind.name)
            .collect();
        let by_direction = by_direction::trials(&base.model, self.train.duration_s());
        let wanted = |kind: &Kind| {
            kind.place != Place::Controller
                && !["injected_signal", "sensor_noise", "quantization"].contains(&kind.name)
                && !present.contains(&kind.name)
                && (by_direction.is_empty()
                    || !["directional_friction", "stribeck_friction"].contains(&kind.name))
        };
        let mut trials = screen::screen(stated, &base, self.train, &signatures, wanted, 1);
        if !by_direction.is_empty() && !present.contains(&"directional_friction") {
            trials.push(by_direction.clone());
        }
        let fitted = candidates::fit_all(&trials, stated, &base, self.train);
        let plain = !base.model.whitens() || self.is_plainer(&fitted);
        let (base, mut fitted) =
            if plain { (base.plain(self.train), fitted.plain) } else { (base, fitted.whitened) };
        let special = self.special(stated, &base).into_iter();
        fitted.extend(
            special.map(|c| Candidate { fit: if plain { c.fit.plain(self.train) } else { c.fit }, ..c }),
        );
        let scored = select::score(&base, fitted, self.holdout);
        (base, scored)
    }

    /// Whether the closed loop comes closer to the training part with the numbers of the plain fits.
    fn is_plainer(&self, fitted: &candidates::Fitted) -> bool {
        let error = |candidates: &[Candidate]| error_at(&candidates.first()?.fit, self.train);
        match (error(&fitted.plain), error(&fitted.whitened)) {
            (Some(plain), Some(whitened)) => plain < PLAINER * whitened,
            (plain, whitened) => plain.is_some() && whitened.is_none(),
        }
    }

    /// Effects that no prediction of y shows: noise that changes, a grid of values.
    fn special(&self, stated: &Fit, base: &Fit) -> Vec<Candidate> {
        // A refit may bend the nominal model so far towards a strong signal that its levels no longer stand apart.
        let injected = [base, stated].into_iter();
        injected
            .filter_map(|from| injected::candidate(from, base, self.train, self.whole))
            .max_by(|a, b| a.fit.log_likelihood.total_cmp(&b.fit.log_likelihood))
            .into_iter()
            .collect()
    }

    /// The winner with what it is tied with, and why each of the others lost.
    fn pick(&self, base: &Fit, scored: &[Scored]) -> (Option<Winner>, Vec<Rejected>) {
        let mut vetoed: Vec<Rejected> = Vec::new();
        let mut stands = |s: &&Scored| {
            s.accepted()
                && match self.veto(base, &s.candidate.fit) {
                    Some(why) => {
                        vetoed.push(Rejected {
                            kind: s.candidate.kind.name,
                            why: why.into(),
                            smallest: None,
                        });
                        false
                    }
                    None => true,
                }
        };
        let best = scored.iter().find(&mut stands);
        let best = best.map(|best| {
            let simpler = select::simplest(best, scored).or_else(|| self.nearly_all(base, best, scored));
            simpler.filter(&mut stands).unwrap_or(best)
        });
        let winner = best.map(|best| select::with_ties(best, scored));
        let rejected = select::losers(scored, winner.as_ref(), vetoed);
        (winner, rejected)
    }

    /// Plain dry friction, where it takes nearly all of what a richer friction takes: what that adds is looked for in the rest.
    fn nearly_all<'s>(&self, base: &Fit, winner: &Scored, scored: &'s [Scored]) -> Option<&'s Scored> {
        if winner.candidate.kind.name != "directional_friction" {
            return None;
        }
        let left = |fit: &Fit| error_at(fit, self.train);
        let dry = scored.iter().find(|s| s.candidate.kind.name == "coulomb_friction")?;
        let (before, with_dry, with_rich) =
            (left(base)?, left(&dry.candidate.fit)?, left(&winner.candidate.fit)?);
        (before - with_dry > NEARLY_ALL * (before - with_rich)).then_some(dry)
    }
}

fn is_white(residual: &[f64]) -> bool {
    Whitener::of(residual).order() == 0
}
