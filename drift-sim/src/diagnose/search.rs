//! The search for missing physics in a loop whose plant is stated: refit, then rounds of screening, fitting and selection, each
//! on top of what was named before.

use crate::cores::AcrossCores as _;

use crate::physics::Kind;
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
    screen, sensor_effects,
};

/// Terms named together at most.
const MOST_TERMS: usize = 3;
/// A tie of more kinds is no name.
const MOST_TIED: usize = 3;
/// Part of a richer friction's gain in the closed loop that makes plain dry friction the name to begin with.
const NEARLY_ALL: f64 = 0.9;
/// Closed-loop error of the plain fit, over that of the whitened one, below which the noise model does harm.
const PLAINER: f64 = 0.97;

/// Kinds followed where two terms must be found at once, and the part of the closed loop's error that each may leave.
const LEADERS: usize = 3;
const CLOSER: f64 = 0.95;
/// Part of the closed loop's error that a pair may leave, for it to take the place of what was named alone.
const MUCH_CLOSER: f64 = 0.7;

/// One search for one more term.
struct Round {
    base: Fit,
    scored: Vec<Scored>,
    /// The candidates that bring the closed loop closest.
    leaders: Vec<Candidate>,
}

impl Case<'_> {
    pub(super) fn run(&self) -> Result<Diagnosis> {
        let stated_model = Model::refit(self.nominal, self.train);
        let stated = Fit::start(&stated_model, self.train, &Whitener::none()).ok_or_else(|| {
            Error::new("the nominal model can't follow the recorded u: it diverges")
                .allowed("a loop file whose units, signs and sample time fit the recording")
        })?;
        let searched = stated.clone().search(self.train, Effort::FULL);
        // What rounding leaves is no noise that a noise model could describe.
        let rounding = sensor_effects::grid(&searched, self.train, self.holdout);
        let (stated, refit) = match &rounding {
            Some(_) => (stated.unwhitened(), searched.unwhitened()),
            None => (stated, searched.settle(self.train, Effort::FULL)),
        };
        let missing = self.missing_drive(&refit);
        let controller = controller_replay::replay(self.nominal, self.train);

        let under = constant_load::under(&refit, self.train)
            .map(|fit| fit.search(self.train, Effort::FULL).settle(self.train, Effort::FULL));
        let from = under.as_ref().and_then(|_| constant_load::under(&stated, self.train));
        let laid_under = under.is_some();
        let mut load_is_open = laid_under;
        let mut base = under.unwrap_or_else(|| refit.clone());
        let mut named: Vec<Winner> = Vec::new();
        let mut rejected = Vec::new();
        let mut located = None;
        // What is left of y tells more than the closed loop, but once a term is named, also what no term explains is in it.
        let begin = match &rounding {
            Some(rounding) => self.unexplained(&rounding.beside(&base)),
            None => !is_white(&base.residual) || self.unexplained(&base),
        };
        if laid_under && !begin {
            // Nothing is missing but perhaps the load; where it is, others may do as well.
            (base, named) = self.judge_load(base, named);
            load_is_open = false;
            if let Some(load) = named.pop() {
                let round = self.round(&stated, refit.clone(), Some(load.scored.candidate));
                let (winner, losers) = self.pick(&round.base, &round.scored);
                rejected = losers;
                match winner {
                    Some(winner) if winner.tied.len() <= MOST_TIED => {
                        base = winner.scored.candidate.fit.clone();
                        named.push(winner);
                    }
                    winner => {
                        located = winner.map(|winner| winner.scored.candidate.kind.place);
                        base = round.base;
                    }
                }
            }
        }
        let (mut rounds, mut first) = (0, None);
        while named.len() < MOST_TERMS && if rounds == 0 { begin } else { self.unexplained(&base) } {
            let from = if rounds == 0 { from.as_ref().unwrap_or(&stated).clone() } else { base.clone() };
            rounds += 1;
            let round = self.round(&from, base, None);
            base = round.base.clone();
            let (winner, losers) = self.pick(&base, &round.scored);
            if rounds == 1 {
                rejected = losers;
            }
            let found = match winner {
                Some(winner) if winner.tied.len() > MOST_TIED => {
                    located = Some(winner.scored.candidate.kind.place);
                    break;
                }
                Some(winner) => vec![winner],
                None => Vec::new(),
            };
            if rounds == 1 {
                first = Some(round);
            }
            let Some(last) = found.last() else { break };
            base = last.scored.candidate.fit.clone();
            named.extend(found);
            if std::mem::take(&mut load_is_open) {
                // Now, before a richer term may take its place.
                (base, named) = self.judge_load(base, named);
            }
            if is_white(&base.residual) {
                // There is nothing more to find.
                break;
            }
        }
        if let Some(first) = first.filter(|_| named.len() < 2 && self.far_off(&base)) {
            let pair = self.pair(&first);
            if let Some(last) = pair.last().filter(|last| self.closer(&last.scored.candidate.fit, &base)) {
                base = last.scored.candidate.fit.clone();
                named = pair;
                load_is_open = false;
                if laid_under {
                    (base, named) = self.judge_load(base, named);
                }
            }
        }
        (base, named) = self.that_stand(base, named);
        if load_is_open {
            (base, named) = self.judge_load(base, named);
        }
        let refit = if base.model.whitens() { refit } else { refit.plain(self.train) };
        self.conclude(Ending { stated, refit, base, named, located, rejected, missing, controller })
    }

    /// The constant load that was laid under the search stays as a term, the first, or goes.
    fn judge_load(&self, base: Fit, mut named: Vec<Winner>) -> (Fit, Vec<Winner>) {
        let Ok(kind) = Kind::named("load_step") else { return (base, named) };
        let Some((without, load)) = self.without(kind, self.nominal.physics.len(), &base) else {
            return (base, named);
        };
        if load.accepted() && self.matters(&without, &base) {
            named.insert(0, Winner::alone(load));
            return (base, named);
        }
        (without, named)
    }

    pub(super) fn missing_drive(&self, refit: &Fit) -> Option<MissingDrive> {
        let (model, _) = refit.model.loop_at(&refit.model.x)?;
        let linear = model.plant.linear().ok()??;
        let error = observer::undone(&model.plant, &refit.residual, self.train.sample_time_s);
        MissingDrive::of(&linear, &error, self.train.sample_time_s)
    }

    /// All kinds that are not in the model yet, and one that is fitted already, scored against the base.
    fn round(&self, stated: &Fit, base: Fit, also: Option<Candidate>) -> Round {
        let missing = self.missing_drive(&base);
        let signatures = features::signatures(self.nominal, self.train, missing.as_ref());
        let stands = self.nominal.physics.len();
        let found = || base.model.nominal.physics.iter().enumerate();
        let present: Vec<&str> = found()
            // A load that begins later may come on top of the constant one.
            .filter(|(i, t)| !(*i == stands && t.kind.name == "load_step" && t.onset_s == 0.0))
            .map(|(_, t)| t.kind.name)
            .collect();
        let onsets: Vec<f64> = found().map(|(_, term)| term.onset_s).filter(|onset| *onset > 0.0).collect();
        let by_direction = by_direction::trials(&base.model, self.train.duration_s());
        let wanted = |kind: &Kind| {
            screen::is_predicted(kind)
                && !present.contains(&kind.name)
                && (by_direction.is_empty()
                    || !["directional_friction", "stribeck_friction"].contains(&kind.name))
        };
        let mut trials = screen::screen(stated, &base, self.train, &signatures, wanted, &onsets);
        if !by_direction.is_empty() && !present.contains(&"directional_friction") {
            trials.push(by_direction.clone());
        }
        let fitted = candidates::fit_all(&trials, stated, &base, self.train);
        let leaders = self.leaders(&base, &fitted);
        let plain = !base.model.whitens() || self.is_plainer(&fitted);
        let (base, mut fitted) =
            if plain { (base.plain(self.train), fitted.plain) } else { (base, fitted.whitened) };
        let special = self.special(stated, &base, &fitted).into_iter().chain(also);
        fitted.extend(
            special.map(|c| Candidate { fit: if plain { c.fit.plain(self.train) } else { c.fit }, ..c }),
        );
        let scored = select::score(&base, fitted, self.holdout);
        Round { base, scored, leaders }
    }

    /// The candidates of different kinds with which the closed loop comes closest to the training part.
    fn leaders(&self, base: &Fit, fitted: &candidates::Fitted) -> Vec<Candidate> {
        let Some(without) = error_at(&base.model, self.train) else { return Vec::new() };
        let mut judged: Vec<(f64, &Candidate)> = fitted
            .plain
            .par_iter()
            .chain(&fitted.whitened)
            .filter_map(|c| Some((error_at(&c.fit.model, self.train)?, c)))
            .filter(|(error, _)| *error < CLOSER * without)
            .collect();
        judged.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut leaders: Vec<Candidate> = Vec::new();
        for (_, candidate) in judged {
            if leaders.len() < LEADERS && leaders.iter().all(|leader| leader.kind != candidate.kind) {
                leaders.push(candidate.clone());
            }
        }
        leaders
    }

    /// Whether a fit leaves much less of the closed loop's error on the training part.
    fn closer(&self, fit: &Fit, than: &Fit) -> bool {
        match (error_at(&fit.model, self.train), error_at(&than.model, self.train)) {
            (Some(error), Some(other)) => error < MUCH_CLOSER * other,
            (error, _) => error.is_some(),
        }
    }

    /// Of several terms those that still stand beside the others. A constant load was judged when it was named.
    fn that_stand(&self, mut base: Fit, mut named: Vec<Winner>) -> (Fit, Vec<Winner>) {
        let mut at = 0;
        while named.len() > 1 && at < named.len() {
            let kind = named.get(at).map(|winner| winner.scored.candidate.kind);
            let judged = kind.filter(|kind| kind.name != "load_step");
            let term =
                judged.and_then(|kind| base.model.nominal.physics.iter().rposition(|t| t.kind == kind));
            let (Some(kind), Some(term)) = (judged, term) else {
                at += 1;
                continue;
            };
            let Some((without, scored)) = self.without(kind, term, &base) else { break };
            if self.stands(&without, &scored) {
                at += 1;
            } else {
                base = without;
                named.remove(at);
            }
        }
        (base, named)
    }

    /// Two terms at once, where neither stands alone: what the other leaves is no noise. The first is one of those that bring the
    /// closed loop closest, the second is searched on top of it, and each must stand beside the other.
    fn pair(&self, round: &Round) -> Vec<Winner> {
        let follow = |leader: &Candidate| {
            let next = self.round(&leader.fit, leader.fit.clone(), None);
            let (second, _) = self.pick(&next.base, &next.scored);
            let second = second.filter(|second| second.tied.len() <= MOST_TIED)?;
            let first = self.beside(leader.kind, &second.scored.candidate.fit)?;
            let error = error_at(&second.scored.candidate.fit.model, self.train)?;
            Some((error, vec![Winner::alone(first), second]))
        };
        let pairs = round.leaders.iter().filter_map(follow);
        pairs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pair)| pair).unwrap_or_default()
    }

    /// The last term of this kind in a fit, if it stands beside the others.
    fn beside(&self, kind: &'static Kind, with: &Fit) -> Option<Scored> {
        let term = with.model.nominal.physics.iter().rposition(|term| term.kind == kind)?;
        let (without, scored) = self.without(kind, term, with)?;
        self.stands(&without, &scored).then_some(scored)
    }

    fn stands(&self, without: &Fit, scored: &Scored) -> bool {
        scored.accepted() && self.veto(without, &scored.candidate.fit).is_none()
    }

    /// A fit without the term of this place, refitted, and the term scored against that.
    fn without(&self, kind: &'static Kind, term: usize, with: &Fit) -> Option<(Fit, Scored)> {
        let without = with.without_term(term, self.train)?;
        let candidate = Candidate { kind, fit: with.clone() };
        let scored = select::score(&without, vec![candidate], self.holdout).into_iter().next()?;
        Some((without, scored))
    }

    /// Whether the closed loop comes closer to the training part with the numbers of the plain fits.
    fn is_plainer(&self, fitted: &candidates::Fitted) -> bool {
        let error = |candidates: &[Candidate]| error_at(&candidates.first()?.fit.model, self.train);
        match (error(&fitted.plain), error(&fitted.whitened)) {
            (Some(plain), Some(whitened)) => plain < PLAINER * whitened,
            (plain, whitened) => plain.is_some() && whitened.is_none(),
        }
    }

    /// Effects that no prediction of y shows: noise that changes, a grid of values.
    fn special(&self, stated: &Fit, base: &Fit, rivals: &[Candidate]) -> Vec<Candidate> {
        let rival_gain = candidates::within_reach(base, rivals);
        // A refit may bend the nominal model so far towards a strong signal that its levels no longer stand apart.
        let injected = [base, stated].into_iter();
        injected
            .filter_map(|from| injected::candidate(from, base, self.train, self.whole, rival_gain))
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
        let left = |fit: &Fit| error_at(&fit.model, self.train);
        let dry = scored.iter().find(|s| s.candidate.kind.name == "coulomb_friction")?;
        let (before, with_dry, with_rich) =
            (left(base)?, left(&dry.candidate.fit)?, left(&winner.candidate.fit)?);
        (before - with_dry > NEARLY_ALL * (before - with_rich)).then_some(dry)
    }
}

fn is_white(residual: &[f64]) -> bool {
    Whitener::of(residual).order() == 0
}
