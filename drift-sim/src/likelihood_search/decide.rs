//! The decision: which kinds explain the recordings, and whether one of them, or one family, is left alone.

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::inner_product::dot;
use crate::estimate::likelihood::Data;
use crate::estimate::whiten::gain_by;
use crate::physics::{Family, Kind, Place, Starts};

use super::options::Options;
use super::rivals::{Field, Rival, begins_at_once, grows};

/// Past innovations from which noise that is of another kind than is reckoned with is foretold.
pub const COLORED: usize = 10;
/// Numbers that the choice of an onset costs: it is the best of very many.
const ONSET_COSTS: f64 = 2.0;
/// Lags over which the innovations' correlation is summed, and the standard errors below which one of them is chance.
const LAGS: usize = 30;
const CHANCE: f64 = 3.0;

/// A kind with what speaks for it.
#[derive(Debug, Clone, Copy)]
pub struct Scored {
    /// Its place in the field.
    pub place: usize,
    /// The kind.
    pub kind: &'static Kind,
    /// Its family on the plant.
    pub family: Option<Family>,
    /// Its free numbers, an onset that is searched for apart.
    pub numbers: usize,
    /// Log-likelihood that it gains over the base, independent samples counting alone.
    pub gain: f64,
    /// The same less the cost of its numbers.
    pub score: f64,
    /// What it loses because the load that stays beside it is unlikely.
    pub lost_to_load: f64,
}

/// What the decision leaves.
#[derive(Debug, Clone, Default)]
pub struct Decision {
    /// All kinds, the best first.
    pub scored: Vec<Scored>,
    /// Kinds that can't be told from the best one; empty where nothing is missing.
    pub set: Vec<&'static Kind>,
    /// The place of what is named, with the others of its family in the set; none where kinds of more than one family are left.
    pub named: Option<(usize, Vec<&'static str>)>,
    /// How many kinds the unseen samples have chosen from; 0 where they had no say.
    pub chosen_among: usize,
}

impl Decision {
    /// What a kind gains after the cost of its numbers; 0 of one that was not tried.
    pub fn score(&self, kind: &Kind) -> f64 {
        self.scored.iter().find(|scored| scored.kind == kind).map_or(0.0, |scored| scored.score)
    }

    /// The same, where what is named can't be told from a kind of this sort: that kind is named instead.
    #[must_use]
    pub fn naming(mut self, is_first: fn(&Kind) -> bool) -> Self {
        let first = self.scored.iter().find(|s| is_first(s.kind) && self.set.contains(&s.kind));
        if let (Some(named), Some(first)) = (&mut self.named, first) {
            let others = self.set.iter().filter(|kind| **kind != first.kind);
            *named = (first.place, others.map(|kind| kind.name).collect());
        }
        self
    }

    /// The kinds that can't be told from the best one, with what each gains.
    pub fn left(&self) -> Vec<(&'static str, f64)> {
        self.set.iter().map(|kind| (kind.name, self.score(kind))).collect()
    }
}

/// All kinds of a field, the best first.
pub fn scored(field: &Field, is_colored: bool) -> Vec<Scored> {
    // Under a coloring that was found beside one kind another one may gain by a coloring of its own.
    let own = |fit: &Fit| if is_colored { gain_by(&fit.rows.z, COLORED) } else { 0.0 };
    let of_base = own(&field.base);
    let share = field.rivals.first().map_or(1.0, |best| independent_share(&best.fit));
    let samples = field.base.rows.count as f64 * share;
    let mut scored: Vec<Scored> = field
        .rivals
        .iter()
        .enumerate()
        .map(|(place, rival)| {
            let gain = share * (field.gain(rival) + own(&rival.fit) - of_base);
            let last = rival.fit.hypothesis.candidates().len() - 1;
            Scored {
                place,
                kind: rival.kind,
                family: rival.kind.family_on(&rival.fit.hypothesis.model.plant),
                numbers: rival.fit.hypothesis.places_of(last).len(),
                gain,
                score: gain - cost(&rival.fit, last, rival.idle, samples),
                lost_to_load: share * field.lost_to_load(rival),
            }
        })
        .collect();
    scored.sort_by(|a, b| b.score.total_cmp(&a.score));
    scored
}

/// Log-likelihood by which two kinds that do the same differ at most: a dead zone and a load on two resting heaters (`.ci/wide 639`) by 0.1, or less.
pub const AS_LIKELY: f64 = 1.0;

/// Judges a field; `least` is what the best kind must gain at least on what was fitted to, after the cost of its numbers. Where it gains less than the options
/// ask for, what it gains on the `unseen` samples, where that is told, may make up for it: chance gains a ratio of x there with a probability of 1 / x at most
/// (see `prove`).
pub fn decide(
    field: &Field,
    options: &Options,
    least: f64,
    data: &Data,
    unseen: impl Fn(&Rival) -> Option<f64>,
) -> Decision {
    let scored = scored(field, data.is_colored());
    let unseen = |best: &Scored| unseen(field.rivals.get(best.place).filter(|rival| rival.ended)?);
    let is_found = |best: &Scored| {
        best.score > least
            && (best.score > options.least_gain
                || unseen(best).is_some_and(|unseen| best.score + unseen > options.least_gain))
    };
    let Some(best) = scored.first().copied().filter(is_found) else {
        return Decision { scored, ..Decision::default() };
    };
    // The cost of its numbers alone puts no kind aside that is as likely as the best one, and no other member of its family; the choice of an onset
    // makes a kind likelier by itself.
    let is_related = |s: &Scored| s.family.is_some() && s.family == best.family;
    // At rest what an actuator lacks since a loop was healthy is a load that is there from the start, which has chosen no onset.
    let may_be_a_load = data.has_healthy() && best.kind.place == Place::Actuator;
    let is_there_from_the_start = |s: &Scored| {
        let fit = field.rivals.get(s.place).map(|rival| &rival.fit);
        fit.and_then(|fit| fit.point.onsets.last()).is_some_and(|onset| has_onset(s.kind) && *onset <= 0.0)
    };
    // Of one family two kinds differ by what a model that is not exact may get wrong, and not by the load that stays beside them: dry friction beside a load does
    // what dry friction does that differs by the direction.
    let inexact = (options.inexact_share * best.gain).max(2.0 * options.margin);
    let is_near = |s: &Scored| {
        s.score > best.score - options.margin
            || (has_points(s.kind) && s.gain >= best.gain)
            || (may_be_a_load && is_there_from_the_start(s) && s.gain > best.gain - AS_LIKELY)
            || (is_related(s) && s.gain + s.lost_to_load > best.gain - inexact)
    };
    let near: Vec<Scored> = scored.iter().copied().filter(is_near).collect();
    // What stands in for something else leaves where that is among them: a gain that falls as far as it may, say, beside a limit that u never leaves.
    let stands_in = |s: &Scored| field.rivals.get(s.place).is_some_and(|rival| rival.fit.is_at_an_end());
    let (standing_in, own): (Vec<Scored>, Vec<Scored>) = near.into_iter().partition(stands_in);
    left_of(scored, if own.is_empty() { &standing_in } else { &own })
}

/// Whether a kind is looked for from points of its own, and not from what was not foretold.
fn has_points(kind: &Kind) -> bool {
    matches!(kind.search, Starts::Grid(_) | Starts::GridLike { .. } | Starts::Peak { .. })
}

/// What is left where these kinds are, the best first: one of them is named where all are of one family.
pub fn left_of(scored: Vec<Scored>, near: &[Scored]) -> Decision {
    let Some(best) = near.first() else { return Decision { scored, ..Decision::default() } };
    let is_related = |s: &Scored| s.family.is_some() && s.family == best.family;
    let one_family = near.iter().all(|s| s.kind == best.kind || is_related(s));
    let set = near.iter().map(|s| s.kind).collect();
    // Of a family the simplest is named; of play that of the actuator, for a valve that sticks or plays is behind one in five loops that swing, a sensor that plays behind few
    // (Desborough & Miller 2002, "Increasing customer value of industrial control performance monitoring").
    let is_rare = |s: &Scored| s.kind.plays_at(Place::Sensor);
    let rank = |s: &Scored| (is_rare(s), s.numbers);
    let simplest = near.iter().min_by(|a, b| rank(a).cmp(&rank(b)).then(b.score.total_cmp(&a.score)));
    let named = simplest.filter(|_| one_family).map(|named| {
        let tied = near.iter().filter(|s| s.kind != named.kind).map(|s| s.kind.name).collect();
        (named.place, tied)
    });
    Decision { scored, set, named, chosen_among: 0 }
}

/// A fit's objective, with what the numbers of its candidates cost.
pub fn priced(fit: &Fit) -> f64 {
    let costs = (0..fit.hypothesis.candidates().len()).map(|candidate| cost_of(fit, candidate));
    fit.objective() + 2.0 * costs.sum::<f64>()
}

/// What the numbers of a fit's candidate cost.
pub fn cost_of(fit: &Fit, candidate: usize) -> f64 {
    cost(fit, candidate, 0, fit.rows.count as f64 * independent_share(fit))
}

/// The cost of a candidate's numbers that are not idle.
fn cost(fit: &Fit, candidate: usize, idle: usize, samples: f64) -> f64 {
    let hypothesis = &fit.hypothesis;
    let is_onset =
        |i: &usize| matches!(hypothesis.free.get(*i).map(|free| free.target), Some(Target::Onset(_)));
    let numbers = hypothesis.places_of(candidate).iter().filter(|i| !is_onset(i)).count();
    let index = hypothesis.stated + candidate;
    let states = fit.point.begun.iter().filter(|begun| begun.term == index).count();
    let numbers = (numbers.saturating_sub(idle) + states) as f64;
    let times = hypothesis.candidates().get(candidate).map_or(0, |term| {
        if term.spans.is_empty() { usize::from(has_onset(term.kind)) } else { 2 * term.spans.len() }
    });
    cost_of_numbers(numbers + ONSET_COSTS * times as f64, samples)
}

/// Whether a kind begins at a time that was chosen for it.
pub fn has_onset(kind: &Kind) -> bool {
    begins_at_once(kind) || grows(kind)
}

/// Half a logarithm of the samples for each number, as in Schwarz's criterion.
pub fn cost_of_numbers(numbers: f64, samples: f64) -> f64 {
    0.5 * numbers * libm::log(samples.max(2.0))
}

/// What part of a fit's innovations counts as independent: one where they are white.
pub fn independent_share(fit: &Fit) -> f64 {
    let z = &fit.rows.z;
    let squares = dot(z, z);
    let chance = CHANCE / libm::sqrt(fit.rows.count.max(1) as f64);
    let correlation = |lag: usize| -> f64 { dot(z, z.get(lag..).unwrap_or(&[])) / squares.max(1e-300) };
    let sum: f64 = (1..=LAGS).map(correlation).filter(|r| r.abs() > chance).map(f64::abs).sum();
    1.0 / (1.0 + 2.0 * sum)
}
