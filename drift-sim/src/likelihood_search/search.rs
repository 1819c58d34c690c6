//! The search: kind after kind is named as long as one, or one family, is left alone and gains on what nothing has seen; what was named
//! before is judged again beside what came after.

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::likelihood::Data;
use crate::physics::{Family, Kind, Starts, Term};

use super::all_samples;
use super::beside_friction::{BesideFriction, is_friction_first};
use super::decide::{Decision, Scored, cost_of, decide, independent_share};
use super::found::{Choice, Contender, Found};
use super::glance::Round;
use super::guarantee::decide_surely;
use super::jumping_load::is_jump;
use super::less_seen::gained_again;
use super::moved_by_disturbances::may_be_the_law;
use super::nominal;
use super::offset;
use super::options::Options;
use super::prove::{Gained, gained};
use super::raggedness::shaken;
use super::rivals::{Field, Rival, field};
use super::standing_load;
use super::without::without;

/// Part of the innovations that must count as independent for the noise model to hold: below it the machine is another than any of the
/// hypotheses, and their likelihoods are not to be compared. Further terms may make up for some of it.
const LEAST_INDEPENDENT: f64 = 0.6;
/// Part beside the likeliest kind below which they do not, but for friction, behind which much may be hidden: of 130 searches, 30 of them of real recordings, none that began below 0.3 came
/// to the part above.
const BEYOND_REPAIR: f64 = 0.25;

/// The search on one nominal fit.
pub struct Search<'a> {
    /// The data.
    pub data: &'a Data,
    /// The numbers that decide.
    pub options: &'a Options,
    /// Whether a late response is the plant's own: nothing tells how late it was.
    pub is_plant_open: bool,
}

/// What speaks for one of several named terms.
struct Judged {
    /// Its place among them.
    index: usize,
    /// The loop without it.
    without: Fit,
    /// What it gains on what nothing has seen.
    unseen: Option<Gained>,
    /// Whether it pays for its numbers.
    pays: bool,
    /// How many kinds the unseen samples have chosen it from.
    among: usize,
}

impl Judged {
    /// The unseen gain in standard errors. Where the rest can't be simulated, nothing is proven.
    fn errors(&self) -> f64 {
        self.unseen.map_or(f64::NEG_INFINITY, Gained::errors)
    }
}

/// Contenders that are kept beside those that a decision left, and all that are kept.
const KEPT_BESIDE: usize = 3;
const KEPT: usize = 7;

impl Search<'_> {
    /// Nothing is looked for.
    pub fn nominal_only(&self, base: Fit) -> Found {
        let refit_gain = self.refit_gain(&base);
        Found {
            predicted: predicted(&base, self.data),
            refit_gain,
            base,
            best: None,
            named: Vec::new(),
            standing_load: None,
            set: Vec::new(),
            contenders: Vec::new(),
            is_proven: false,
            is_noise: true,
            rivals: Vec::new(),
            quantum: None,
            comes_and_goes: Vec::new(),
        }
    }

    /// What a field decides, of kinds that gain so much at least.
    pub fn decide(&self, field: &Field, least: f64) -> Decision {
        match self.options.guarantee {
            Some(alpha) => decide_surely(field, self.data, alpha),
            None => {
                // A plant that is identified is never quite the true one, and what it lacks gains a little on any samples.
                let unseen = |rival: &Rival| {
                    let gained = (!self.is_plant_open).then(|| gained(&rival.fit, &field.base, self.data));
                    Some(gained??.independent)
                };
                let decision = decide(field, self.options, least, self.data, unseen);
                let decision = if decision.named.is_none() && decision.set.len() > 1 {
                    all_samples::decided_again(decision, field, self.data, self.options)
                } else {
                    decision
                };
                // Of a load that jumps it may be one jump more.
                if self.data.jumps().count() > 0 { decision.naming(is_jump) } else { decision }
            }
        }
    }

    /// The search from the first field on.
    pub fn run(&self, first: Field) -> Found {
        let likeliest = first.rivals.first().map_or(&first.base, |best| &best.fit);
        let decision = self.decide(&first, f64::NEG_INFINITY);
        let rivals = as_listed(&decision.scored);
        let contenders = contenders(&first, &decision);
        let mut found = Found { rivals, contenders, ..self.nominal_only(first.base.clone()) };
        let set = decision.left();
        let is_beyond_repair = independent_share(likeliest) < BEYOND_REPAIR;
        if is_beyond_repair && !is_friction_first(likeliest) {
            return Found { set, is_noise: false, ..found };
        }
        let begun = is_beyond_repair.then(|| found.clone());
        self.take(&mut found, &first, decision);
        let alone = found.clone();
        self.follow(&mut found, None);
        if let Some(begun) = begun.filter(|_| !found.best.as_ref().is_some_and(noise_holds)) {
            return Found { set, is_noise: false, ..begun };
        }
        if !set.is_empty() {
            let reached = found.best.as_ref().unwrap_or(likeliest);
            let friction = BesideFriction::searched(self, &first, &found, reached);
            let instead = friction.and_then(|friction| friction.instead_of(reached, self.options.margin));
            found = instead.unwrap_or(found);
        }
        // Where causes are left, what is left beside the likeliest of them counts.
        let left = if found.set.is_empty() { &found.base } else { likeliest };
        found.is_noise = noise_holds(found.best.as_ref().unwrap_or(left));
        self.prove(&mut found);
        if self.is_plant_open && alone.names_play() && !found.names_play() {
            found = self.proven_alone(alone).unwrap_or(found);
        }
        found.standing_load = self.standing_load(&found);
        found
    }

    /// One of the named terms without what was found beside it, where it is proven so: beside a guessed plant what a valve's model lacks makes up noise and hysteresis of the sensor, by which
    /// the valve is lost.
    pub fn proven_alone(&self, mut alone: Found) -> Option<Found> {
        alone.is_noise = noise_holds(alone.best.as_ref()?);
        self.prove(&mut alone);
        alone.best.is_some().then_some(alone)
    }

    /// The search beside the candidates of this fit, from a field beside them on, if that is known.
    pub fn beside(&self, base: Fit, with: Fit, known: Option<Field>) -> Found {
        let mut found = self.nominal_only(base);
        for index in 0..with.hypothesis.candidates().len() {
            let Some(less) = without(&with, index, self.data) else { continue };
            let gain = gain_after_cost(&with, &less, index);
            found.named.push(Choice { tied: Vec::new(), gain, unseen: None, among: 0 });
        }
        found.best = Some(with);
        self.follow(&mut found, known);
        found.is_noise = noise_holds(found.best.as_ref().unwrap_or(&found.base));
        let is_any_unseen = self
            .data
            .recordings
            .iter()
            .zip(&self.data.fitted)
            .any(|(signals, fitted)| *fitted < signals.len());
        if is_any_unseen {
            self.prove(&mut found);
        }
        found.standing_load = self.standing_load(&found);
        found
    }

    /// What speaks for a load that is there from the start beside what is named. An unknown plant may have it by itself, and a healthy recording shares it.
    fn standing_load(&self, found: &Found) -> Option<Choice> {
        let best = found.best.as_ref().filter(|_| !self.is_plant_open && !self.data.has_healthy())?;
        // A stated offset takes up what the model lacks of the others.
        let has_offset = offset::of(&best.hypothesis.model.plant).is_some();
        let least = if has_offset { self.further_gain(best) } else { self.options.least_gain };
        standing_load::judged(best, self.data, least.max(self.options.least_share * strongest(found)))
    }

    /// Names kind after kind beside what is named already; the first of a field, if that is known.
    pub fn follow(&self, found: &mut Found, mut known: Option<Field>) {
        while !found.named.is_empty() && found.named.len() < self.options.most_terms {
            let Some(best) = found.best.clone() else { break };
            let least = (self.options.least_share * strongest(found)).max(self.further_gain(&best));
            let round = Round::Later(least);
            let Some(next) = known.take().or_else(|| field(&best, self.data, round)) else { break };
            let decision = self.decide(&next, least);
            if self.plays_again(&best, &decision, &next) {
                break;
            }
            if self.plants_own(&decision, &next).is_some() || self.is_lost_in_raggedness(&decision, &next) {
                break;
            }
            let before = found.named.len();
            let set = std::mem::take(&mut found.set);
            self.take(found, &next, decision);
            found.set = set;
            if found.named.len() == before {
                break;
            }
            self.reconsider(found);
        }
    }

    /// What a further term must gain beside a fit.
    fn further_gain(&self, beside: &Fit) -> f64 {
        let Options { least_gain, further_gain, further_samples, .. } = *self.options;
        let part = beside.rows.count as f64 / further_samples as f64;
        (further_gain * part.min(1.0)).max(least_gain)
    }

    /// Whether a rival may be what the law turned round lacks, and no physics.
    fn may_be_the_law(&self, rival: &Rival) -> bool {
        may_be_the_law(rival.kind, &rival.fit, self.data)
    }

    /// Whether a decision names play beside play on a guessed plant: slips that scatter look like a sensor's play.
    fn plays_again(&self, best: &Fit, decision: &Decision, field: &Field) -> bool {
        let plays = |kind: &Kind| kind.family == Some(Family::Play);
        self.is_plant_open
            && best.hypothesis.candidates().iter().any(|term| plays(term.kind))
            && named(decision, field).is_some_and(|rival| plays(rival.kind))
    }

    /// Whether what a decision names gains no more than a ragged likelihood may.
    fn is_lost_in_raggedness(&self, decision: &Decision, field: &Field) -> bool {
        let Some(rival) = named(decision, field) else { return false };
        let score = decision.score(rival.kind);
        [&field.base, &rival.fit].iter().any(|fit| score < shaken(fit, self.data))
    }

    /// Names what a decision leaves alone; else keeps the set, with its best kind to be proven.
    fn take(&self, found: &mut Found, field: &Field, decision: Decision) {
        let Some(best) = decision.scored.first().and_then(|s| field.rivals.get(s.place)) else { return };
        if decision.set.is_empty() {
            return;
        }
        let named = decision.named.as_ref().and_then(|(place, tied)| Some((field.rivals.get(*place)?, tied)));
        match named.filter(|(rival, _)| !rival.fit.is_at_an_end() && !self.may_be_the_law(rival)) {
            Some((rival, tied)) => {
                let (gain, among) = (decision.score(rival.kind), decision.chosen_among);
                found.named.push(Choice { tied: tied.clone(), gain, unseen: None, among });
                found.best = Some(rival.fit.clone());
            }
            None => {
                found.set = decision.left();
                found.is_proven = !self.may_be_the_law(best)
                    && gained(&best.fit, &field.base, self.data).is_some_and(Gained::is_sure);
            }
        }
    }

    /// Proves each named term on what nothing has seen, against the same loop without it, refitted. What does not gain there for sure, or does not pay for its
    /// numbers beside the other terms any more, is not named, the weakest first.
    fn prove(&self, found: &mut Found) {
        while let Some(best) = found.best.clone() {
            let judged: Vec<Judged> =
                (0..found.named.len()).filter_map(|index| self.judged(found, &best, index)).collect();
            let strongest = strongest_unseen(&best, found.named.iter().map(|choice| choice.unseen));
            let weakest = judged
                .into_iter()
                .filter(|of| {
                    !(of.pays && of.unseen.is_some_and(|unseen| unseen.is_proof(of.among, strongest)))
                })
                .min_by(|a, b| a.errors().total_cmp(&b.errors()));
            let Some(Judged { index, without, .. }) = weakest else { return };
            let dropped = found.named.remove(index);
            if found.named.is_empty() {
                let kind = best.hypothesis.candidates().get(index).map_or("", |term| term.kind.name);
                found.set =
                    std::iter::once(kind).chain(dropped.tied).map(|kind| (kind, dropped.gain)).collect();
                found.is_proven = false;
                found.best = None;
            } else {
                found.best = Some(without);
            }
        }
    }

    /// What speaks for one of the named terms, which its choice keeps; `None` where the loop can't be simulated without it.
    fn judged(&self, found: &mut Found, best: &Fit, index: usize) -> Option<Judged> {
        let is_alone = found.named.len() == 1;
        let without = if is_alone { found.base.clone() } else { without(best, index, self.data)? };
        let choice = found.named.get_mut(index)?;
        let among = choice.among;
        let mut unseen = gained(best, &without, self.data);
        // Beside others it may have to prove more.
        let strongest = if is_alone { f64::NEG_INFINITY } else { f64::INFINITY };
        if !unseen.is_some_and(|unseen| unseen.is_proof(among, strongest)) {
            let onset_s = best.point.onsets.get(index).copied().unwrap_or(0.0);
            let again = gained_again(best, &without, onset_s, self.data);
            let is_surer = |again: &Gained| {
                unseen.is_none_or(|unseen| !unseen.is_sure_among(among) || again.errors() > unseen.errors())
            };
            unseen = again.filter(is_surer).or(unseen);
        }
        choice.unseen = unseen;
        let mut pays = true;
        if best.hypothesis.candidates().len() > 1 {
            choice.gain = gain_after_cost(best, &without, index);
            pays = choice.gain > 0.0;
        }
        pays = pays && self.pays_under_own_noise(best, index, &without);
        Some(Judged { index, without, unseen, pays, among })
    }

    /// Whether a term pays for its numbers where the noise may be another than it was in healthy recordings. Noise of a term's own is none of that.
    fn pays_under_own_noise(&self, best: &Fit, index: usize, without: &Fit) -> bool {
        let is_noise = |term: &Term| matches!(term.kind.search, Starts::NoiseChange);
        if !self.data.has_healthy() || best.hypothesis.candidates().get(index).is_some_and(is_noise) {
            return true;
        }
        let now = self.data.without_healthy();
        let own = |fit: &Fit| nominal::under_own_noise(fit, &now);
        own(best)
            .zip(own(without))
            .is_none_or(|(with, without)| gain_after_cost(&with, &without, index) > 0.0)
    }

    /// Judges the first of two terms again beside the second, against all kinds: what it was taken for may have been both of them.
    fn reconsider(&self, found: &mut Found) {
        let Some(best) = found.best.clone() else { return };
        let Some(choice) = found.named.first().cloned() else { return };
        if best.hypothesis.candidates().len() != 2 {
            return;
        }
        let Some(without) = without(&best, 0, self.data) else { return };
        let Some(again) = field(&without, self.data, Round::Later(self.options.least_gain)) else { return };
        let decision = self.decide(&again, f64::NEG_INFINITY);
        let Some((place, tied)) = decision.named.clone() else { return };
        let Some(Rival { kind, fit, .. }) = again.rivals.get(place) else { return };
        // Without the first term the second may be lost in what is left: what was found beside it explains less then than both did.
        let with_cost_of = |fit: &Fit, candidate: usize| fit.objective() + 2.0 * cost_of(fit, candidate);
        if with_cost_of(fit, 1) > with_cost_of(&best, 0) + 2.0 * self.options.margin {
            return;
        }
        found.best = Some(fit.clone());
        // The order of the candidates is that of the fit: the second comes first now.
        found.named.swap(0, 1);
        if let Some(last) = found.named.last_mut() {
            *last = Choice {
                tied,
                gain: decision.score(kind),
                unseen: choice.unseen,
                among: decision.chosen_among,
            };
        }
    }

    /// What the nominal loop's own numbers gain by being refitted.
    fn refit_gain(&self, base: &Fit) -> f64 {
        let plant: Vec<usize> = (0..base.hypothesis.free.len())
            .filter(|i| {
                base.hypothesis
                    .free
                    .get(*i)
                    .is_some_and(|f| matches!(f.target, Target::Plant(_) | Target::ConstantLoad))
            })
            .collect();
        let mut point = base.point.clone();
        for place in &plant {
            if let Some(x) = point.x.get_mut(*place) {
                *x = 0.0;
            }
        }
        let Some(mut stated) = Fit::at(&base.hypothesis, &point, self.data) else { return f64::INFINITY };
        stated.descend(self.data, 4, &plant);
        0.5 * (stated.objective() - base.objective())
    }
}

/// Log-likelihood that a candidate of a fit gains over the fit without it, after the cost of its numbers.
fn gain_after_cost(with: &Fit, without: &Fit, index: usize) -> f64 {
    0.5 * independent_share(with) * (without.objective() - with.objective()) - cost_of(with, index)
}

/// What the strongest named term gains, of those that change what is foretold: how noisy a sensor is leaves nothing unexplained beside it.
fn strongest(found: &Found) -> f64 {
    let Some(best) = &found.best else { return 0.0 };
    let named = best.hypothesis.candidates().iter().zip(&found.named);
    let foretells = named.filter(|(term, _)| !matches!(term.kind.search, Starts::NoiseChange));
    foretells.map(|(_, choice)| choice.gain).fold(0.0, f64::max)
}

/// The most that one of several terms gains on what nothing has seen, of those that change what is foretold. What comes and goes was found in another way, and its edges are no measure of what
/// is beside it (a real drive's friction under pulses gains 1.4 standard errors).
fn strongest_unseen(best: &Fit, unseen: impl Iterator<Item = Option<Gained>>) -> f64 {
    let named = best.hypothesis.candidates().iter().zip(unseen);
    let foretells =
        named.filter(|(term, _)| !matches!(term.kind.search, Starts::NoiseChange) && term.spans.is_empty());
    let gains = foretells.filter_map(|(_, unseen)| Some(unseen?.independent));
    gains.fold(f64::NEG_INFINITY, f64::max)
}

/// All kinds with what they gain, the best first. Those that are as far as a thousandth of a nat go by their names: what is less is rounding, and another on another
/// processor.
fn as_listed(scored: &[Scored]) -> Vec<(&'static str, f64)> {
    let mut listed: Vec<&Scored> = scored.iter().collect();
    let thousandths = |s: &Scored| libm::round(1000.0 * s.score);
    listed.sort_by(|a, b| thousandths(b).total_cmp(&thousandths(a)).then(a.kind.name.cmp(b.kind.name)));
    listed.into_iter().map(|s| (s.kind.name, s.gain)).collect()
}

/// The fits that a decision left, and the next ones.
fn contenders(field: &Field, decision: &Decision) -> Vec<Contender> {
    let is_left = |kind: &Kind| decision.set.contains(&kind);
    let left = decision.scored.iter().filter(|s| is_left(s.kind));
    let beside = decision.scored.iter().filter(|s| !is_left(s.kind)).take(KEPT_BESIDE);
    let of = |s: &Scored| {
        let rival = field.rivals.get(s.place)?;
        Some(Contender { fit: rival.fit.clone(), score: s.score, is_left: is_left(s.kind) })
    };
    left.chain(beside).take(KEPT).filter_map(of).collect()
}

/// Whether what a fit leaves is noise of the kind that is reckoned with.
pub fn noise_holds(fit: &Fit) -> bool {
    independent_share(fit) >= LEAST_INDEPENDENT
}

/// The rival that a decision names.
pub fn named<'a>(decision: &Decision, field: &'a Field) -> Option<&'a Rival> {
    let (place, _) = decision.named.as_ref()?;
    field.rivals.get(*place)
}

/// Part of the drive's variance that is u's, beside a load that drifts and jumps.
pub fn predicted(fit: &Fit, data: &Data) -> f64 {
    let place = fit.hypothesis.place(Target::LoadSize);
    let drifts = libm::exp(place.and_then(|i| fit.point.x.get(i)).copied().unwrap_or(0.0));
    let jumps = data.jumps().level_deviation(fit.rows.sensor_sd) / fit.hypothesis.scales.drive;
    1.0 / (1.0 + drifts * drifts + jumps * jumps)
}
