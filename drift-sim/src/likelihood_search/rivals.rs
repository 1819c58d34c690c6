//! Fits of all kinds of physics beside a base: what explains the recordings, each kind at the best point that can be found.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::{Fit, SLID_GAIN, Tangent};
use crate::estimate::hypothesis::{Hypothesis, Point, Target, is_noise, is_of_loop};
use crate::estimate::likelihood::Data;
use crate::physics::{Kind, Parameter, Place, Start, Starts};
use crate::stage;

use super::begun;
use super::decide::cost_of;
use super::glance::{Glance, Round, gain_over, second_round};
use super::idle;
use super::needle::{self, at_needle, near_needle, nearest_needle};
use super::nominal;
use super::settled_onsets;
use super::standing_load::prior_row;
use super::steadiness::is_steady;

/// Gain of a short fit below which a kind is not fitted to the end.
const LEAST: f64 = 3.0;
/// Steps of a long fit, of one that goes on and of one that is to end.
const LONG: usize = 12;
const AGAIN: usize = 5;
const POLISH: usize = 30;
/// Part of the best one's gain from which on a kind's fit begins again from the best ones' shared numbers, is polished, and its idle numbers are counted.
const NEAR: f64 = 0.8;
/// Part of the best one's gain from which on a kind's fit goes on over all samples, and steps of the others there.
const ON_ALL: f64 = 0.5;
const BEHIND: usize = 2;
/// Part of the best one's gain from which on a needle is searched for.
const NEEDLED: f64 = 0.5;
/// A kind is fitted to the end where its short fit gains more than this part of the best one's, or comes this close to it.
const WORTH: f64 = 0.3;
const CLOSE: f64 = 60.0;

/// A kind at its best point.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The kind.
    pub kind: &'static Kind,
    /// Its fit: the base with the kind as the last candidate.
    pub fit: Fit,
    /// Whether it was fitted to the end: else it was far behind.
    pub ended: bool,
    /// How many of its numbers the recordings say nothing of; 0 where it is far behind.
    pub idle: usize,
}

impl Rival {
    /// This kind as a rival has what it does; that rival's own fit where it is of this kind.
    fn like(&self, other: &Self, data: &Data) -> Option<Fit> {
        if other.kind == self.kind {
            return Some(other.fit.clone());
        }
        let term = other.fit.hypothesis.realise(&other.fit.point)?.model.physics.pop()?;
        let start = Start::of(self.kind.search.like(&term)?);
        let hypothesis = &self.fit.hypothesis;
        let point = hypothesis.started(&with_shared(&self.fit, &other.fit), &start, 0.0);
        Fit::at(hypothesis, &point, data)
    }
}

/// A base and all kinds beside it.
#[derive(Debug, Clone)]
pub struct Field {
    /// The base, fitted again from the best rivals' shared numbers.
    pub base: Fit,
    /// The kinds, the likeliest first.
    pub rivals: Vec<Rival>,
}

/// Whether the likelihood of y is where a kind is looked for beside a base. How noisy a coarse sensor seems to be depends on how y moves.
pub fn is_searched(kind: &Kind, beside: &Hypothesis) -> bool {
    let is_apart = match kind.search {
        Starts::Apart => true,
        Starts::NoiseChange => beside.scales.is_coarse,
        _ => false,
    };
    kind.place != Place::Controller && !is_apart && (kind.applies)(&beside.model.plant)
}

/// Whether a kind begins at once, at a time that is searched for.
pub fn begins_at_once(kind: &Kind) -> bool {
    matches!(kind.search, Starts::Onset(_) | Starts::NoiseChange)
}

/// Whether a kind grows from such a time on.
pub fn grows(kind: &Kind) -> bool {
    matches!(kind.search, Starts::Ramp(_))
}

/// Numbers that a descent can't move: those of a last term that has no slope.
pub fn stuck(hypothesis: &Hypothesis) -> Vec<usize> {
    let Some(last) = hypothesis.candidates().len().checked_sub(1) else { return Vec::new() };
    let places = hypothesis.places_of(last);
    let is_peak = hypothesis.candidates().last().is_some_and(|term| term.kind.search.is_peak());
    if is_peak { places } else { Vec::new() }
}

/// The kind of a fit's last candidate.
pub fn last_kind(fit: &Fit) -> Option<&'static Kind> {
    fit.hypothesis.candidates().last().map(|term| term.kind)
}

/// Short fits of the kinds of a round beside a base.
pub struct Sketch {
    /// The base, fitted again.
    pub seen: Fit,
    /// A short fit of each kind.
    pub short: Vec<(&'static Kind, Fit)>,
    /// Fits that were found another way.
    pub offered: Vec<(&'static Kind, Fit)>,
    /// The round.
    pub round: Round,
}

impl Sketch {
    /// Every kind again from the shared numbers of the best one, and those that were found another way where they are better.
    fn again(self, data: &Data) -> Self {
        let mut short = second_round(self.short, &self.seen, data);
        for (kind, fit) in self.offered {
            match short.iter_mut().find(|(of, _)| *of == kind) {
                Some((_, known)) if known.objective() <= fit.objective() => {}
                Some((_, known)) => *known = fit,
                None => short.push((kind, fit)),
            }
        }
        Self { short, offered: Vec::new(), ..self }
    }

    /// The least objective of base and kinds, with the cost of a kind's numbers and what it must gain at `least`: a plant that needs no physics is
    /// preferred to one that does.
    pub fn least_objective(&self, least: f64) -> f64 {
        let with =
            |fit: &Fit| fit.objective() + 2.0 * (least + cost_of(fit, fit.hypothesis.candidates().len() - 1));
        let all = self.short.iter().chain(&self.offered);
        all.map(|(_, fit)| with(fit)).fold(self.seen.objective(), f64::min)
    }

    /// The kinds that may be the one, fitted to the end, at last on all samples of the data.
    pub fn finished(self, base: &Fit, data: &Data) -> Option<Field> {
        let (round, look) = (self.round, data.look());
        let mut field = self.again(look).ended(base, look);
        if matches!(round, Round::Later(_)) && field.rivals.iter().all(|rival| !rival.ended) {
            field.sort();
            return field.without_rivals(data);
        }
        field.share(look);
        Some(field.on(data)?.judged(data))
    }

    /// The same on the samples that the short fits have seen.
    fn ended(self, base: &Fit, data: &Data) -> Field {
        let gains: Vec<f64> = self.short.iter().map(|(_, fit)| gain_over(&self.seen, fit)).collect();
        let top = gains.iter().copied().fold(0.0, f64::max);
        let leading = self.short.iter().zip(&gains).max_by(|a, b| a.1.total_cmp(b.1));
        let leading = leading.map(|((kind, _), _)| *kind);
        // What begins at once hides in another one of its family that begins then: a lost gain came to 78 of 420 nats in a short fit beside a bias, a load to 350.
        let begins_like_it =
            |kind: &Kind| begins_at_once(kind) && leading.is_some_and(|leading| kind.is_related(leading));
        let fits = self.short.iter().map(|(_, fit)| fit).zip(gains.iter().copied());
        let goes_on = self.round.goes_on(data, fits);
        stage::begins("every kind of physics, to the end", self.short.len());
        let rivals: Vec<Rival> = self
            .short
            .into_par_iter()
            .zip(gains)
            .map(|((kind, mut fit), gain)| {
                let least =
                    if begins_like_it(kind) { LEAST } else { (WORTH * top).min(top - CLOSE).max(LEAST) };
                let ended = goes_on && gain > least;
                if ended {
                    to_the_end(&mut fit, kind, data);
                }
                stage::step();
                Rival { kind, fit, ended, idle: 0 }
            })
            .collect();
        Field { base: base.clone(), rivals }
    }
}

/// The kinds of a round beside a base.
pub fn field(base: &Fit, data: &Data, round: Round) -> Option<Field> {
    let (look, base) = (data.look(), base.on_look(data)?);
    Glance::of(&base, look, round)?.sketched(look).finished(&base, data)
}

/// The base's point with the numbers that it shares with another fit.
pub fn shared_point(base: &Fit, other: &Fit) -> Point {
    let mut point = base.hypothesis.widen(&other.hypothesis, &other.point);
    point.onsets.truncate(base.hypothesis.candidates().len());
    point
}

/// The long fit of a kind, with the searches that its numbers need.
fn to_the_end(fit: &mut Fit, kind: &Kind, data: &Data) {
    let duration = fit.hypothesis.scales.duration_s;
    let last = fit.hypothesis.candidates().len() - 1;
    let fixed = stuck(&fit.hypothesis);
    let at_once = begins_at_once(kind);
    if at_once {
        fit.search_onset(data, last, duration / 60.0, None);
    }
    fit.descend(data, LONG, &fixed);
    if at_once && let Some(tangent) = fit.tangent(data, &fixed) {
        fit.scan_onset(data, last, &fit.hypothesis.places_of(last), &tangent);
        fit.search_onset(data, last, duration / 25.0, Some(&tangent));
        fit.search_onset(data, last, duration / 200.0, None);
        fit.descend(data, AGAIN, &fixed);
    }
    let places = fit.hypothesis.places_of(last);
    let is_onset =
        |i: &usize| fit.hypothesis.free.get(*i).is_some_and(|free| matches!(free.target, Target::Onset(_)));
    if let Some(onset) = places.iter().copied().find(is_onset)
        && let Some(tangent) = fit.tangent(data, &[onset])
    {
        let others: Vec<usize> = places.iter().copied().filter(|place| *place != onset).collect();
        fit.scan(data, onset, &others, &tangent);
        fit.descend(data, LONG, &fixed);
    }
    fit.look_closer();
    fit.descend(data, AGAIN, &fixed);
    let rough = rough_numbers(fit);
    if !rough.is_empty()
        && let Some(tangent) = fit.tangent(data, &rough)
    {
        if rough.len() > 1 {
            fit.profile(data, &rough, &tangent);
        }
        rough.iter().for_each(|place| fit.profile(data, &[*place], &tangent));
        if let Some(place) = rough.first().filter(|_| kind.parameters.iter().any(is_rough_time)) {
            whole_samples(fit, *place, data, &tangent);
        }
        settle_states(fit, data);
        fit.descend(data, AGAIN, &fixed);
    }
}

/// Places of the last term's numbers along which the likelihood has corners.
fn rough_numbers(fit: &Fit) -> Vec<usize> {
    let Some(last) = fit.hypothesis.candidates().len().checked_sub(1) else { return Vec::new() };
    let is_rough = |i: &usize| fit.hypothesis.free.get(*i).is_some_and(|free| !free.smooth);
    fit.hypothesis.places_of(last).into_iter().filter(is_rough).collect()
}

/// Moves the states in which recordings begin; those of a needle only at its top, for beside it they lead away.
fn settle_states(fit: &mut Fit, data: &Data) {
    if stuck(&fit.hypothesis).is_empty() {
        begun::settle(fit, data);
    }
}

/// Moves the last term's rough numbers by little.
fn rough_again(fit: &mut Fit, data: &Data) {
    let rough = rough_numbers(fit);
    if rough.is_empty() {
        return;
    }
    let Some(tangent) = fit.tangent(data, &rough) else { return };
    rough.iter().for_each(|place| fit.profile(data, &[*place], &tangent));
    fit.descend(data, AGAIN, &stuck(&fit.hypothesis));
    settle_states(fit, data);
}

/// Whether a number is a time along which the likelihood has corners: those of whole samples.
fn is_rough_time(parameter: &Parameter) -> bool {
    !parameter.smooth && parameter.unit == "s"
}

/// Tries the whole samples next to a time, y being late by nothing besides.
fn whole_samples(fit: &mut Fit, place: usize, data: &Data, tangent: &Tangent) {
    let ts = fit.hypothesis.model.sample_time_s;
    let (Some(free), Some(x)) = (fit.hypothesis.free.get(place).cloned(), fit.point.x.get(place)) else {
        return;
    };
    let samples = free.value(*x) / ts;
    for whole in [libm::floor(samples), libm::ceil(samples), libm::ceil(samples) + 1.0] {
        let mut point = fit.point.clone();
        if let Some(x) = point.x.get_mut(place) {
            *x = free.x_of(whole * ts);
        }
        if let Some(x) = fit.hypothesis.place(Target::Late).and_then(|late| point.x.get_mut(late)) {
            *x = 0.0;
        }
        fit.tried(point, data, Some(&tangent.without(place)), SLID_GAIN);
    }
}

impl Field {
    /// The field on all samples, where these fits were on a first look at them.
    fn on(self, data: &Data) -> Option<Self> {
        if !data.has_first_look() {
            return Some(self);
        }
        let near = self.near_the_best_of(ON_ALL);
        let mut base = self.base.on(data)?;
        base.descend(data, LONG, &[]);
        let again = self.rivals.into_par_iter().zip(near).filter_map(|(rival, is_near)| {
            let mut fit = rival.fit.on(data)?;
            let steps = if is_near { LONG } else { BEHIND };
            fit.descend(data, steps, &stuck(&fit.hypothesis));
            if is_near {
                rough_again(&mut fit, data);
            }
            Some(Rival { fit, ..rival })
        });
        let mut field = Self { base, rivals: again.collect() };
        field.sort();
        field.polish(data);
        Some(field)
    }

    /// A base beside which nothing comes near to what it needs.
    fn without_rivals(self, data: &Data) -> Option<Self> {
        if !data.has_first_look() {
            return Some(self);
        }
        Some(Self { base: self.base.on(data)?, rivals: Vec::new() })
    }

    /// What is left to be done on all samples once all fits have ended.
    fn judged(mut self, data: &Data) -> Self {
        self.search_needles(data);
        self.rivals.retain(|rival| !rival.ended || idle::acts(&rival.fit, data));
        let rivals = std::mem::take(&mut self.rivals);
        self.rivals = rivals.into_iter().filter(|rival| !self.is_a_jump(rival)).collect();
        self.count_idle(data);
        self
    }

    /// The likeliest first.
    fn sort(&mut self) {
        self.rivals.sort_by(|a, b| a.fit.objective().total_cmp(&b.fit.objective()));
    }

    /// Once more, from the numbers that the best two share with the others, and sorts.
    fn share(&mut self, data: &Data) {
        self.sort();
        let best: Vec<Fit> = self.rivals.iter().take(2).map(|rival| rival.fit.clone()).collect();
        let of_base: Vec<Fit> = best
            .par_iter()
            .filter_map(|other| {
                let mut fit = Fit::at(&self.base.hypothesis, &shared_point(&self.base, other), data)?;
                fit.descend(data, LONG, &[]);
                Some(fit)
            })
            .collect();
        for fit in of_base {
            if fit.objective() < self.base.objective() {
                self.base = fit;
            }
        }
        self.near_the_best().into_par_iter().for_each(|rival| {
            for other in &best {
                if other.hypothesis.candidates().last().map(|term| term.kind) == Some(rival.kind) {
                    continue;
                }
                let point = with_shared(&rival.fit, other);
                let Some(mut fit) = Fit::at(&rival.fit.hypothesis, &point, data) else { continue };
                let fixed = stuck(&fit.hypothesis);
                fit.descend(data, AGAIN, &fixed);
                if fit.objective() < rival.fit.objective() {
                    rival.fit = fit;
                }
            }
        });
        self.sort();
        self.polish(data);
    }

    /// A kind whose peak is as narrow as a needle, where it or one that does nearly the same is about as likely as the best one: its fit may lie beside
    /// the peak.
    fn search_needles(&mut self, data: &Data) {
        let least =
            (NEEDLED * self.rivals.first().map_or(0.0, |best| self.gain(best))).max(needle::LEAST_GAIN);
        let likely: Vec<Rival> =
            self.rivals.iter().filter(|rival| self.gain(rival) > least).cloned().collect();
        for rival in self.rivals.iter_mut().filter(|rival| !stuck(&rival.fit.hypothesis).is_empty()) {
            let origins: Vec<Fit> = likely.iter().filter_map(|other| rival.like(other, data)).collect();
            let others: Vec<Fit> =
                origins.iter().flat_map(|origin| needle::in_other_forms(origin, data)).collect();
            let origins = origins.into_iter().chain(others);
            let near = origins.map(|origin| near_needle(origin, data));
            let Some(best) = near.min_by(|a, b| a.objective().total_cmp(&b.objective())) else { continue };
            // Beside a guessed plant a valve with numbers enough to choose from does what a motor's friction does.
            let near = if best.hypothesis.is_guessed { best } else { nearest_needle(best, data) };
            let found = at_needle(near, rival.kind, data);
            if found.objective() < rival.fit.objective() {
                *rival = Rival { kind: rival.kind, fit: found, ended: true, idle: 0 };
            }
        }
        self.sort();
        self.follow_needles(data);
    }

    /// A kind that does nearly what a needle does, from where that was found: its own fit may have ended where both are far less likely.
    fn follow_needles(&mut self, data: &Data) {
        let Some(best) = self.rivals.first().filter(|best| !stuck(&best.fit.hypothesis).is_empty()).cloned()
        else {
            return;
        };
        let smooth = self.rivals.iter_mut().filter(|rival| stuck(&rival.fit.hypothesis).is_empty());
        for rival in smooth {
            let Some(mut fit) = rival.like(&best, data) else { continue };
            fit.descend(data, LONG, &[]);
            rough_again(&mut fit, data);
            if fit.objective() < rival.fit.objective() {
                *rival = Rival { kind: rival.kind, fit, ended: true, idle: 0 };
            }
        }
        self.sort();
    }

    /// The likeliest, each to where no step gains any more: what decides between them is their distance.
    pub fn polish(&mut self, data: &Data) {
        self.near_the_best().into_par_iter().for_each(|rival| {
            let fixed = stuck(&rival.fit.hypothesis);
            rival.fit.descend(data, POLISH, &fixed);
            nominal::under_other_noise(&mut rival.fit, data);
            if begins_at_once(rival.kind) {
                settled_onsets::settle(&mut rival.fit, data);
            }
        });
        nominal::under_other_noise(&mut self.base, data);
        self.sort();
    }

    /// Whether a rival would pay for its numbers, and gains by a jump of the load alone.
    fn is_a_jump(&self, rival: &Rival) -> bool {
        let last = rival.fit.hypothesis.candidates().len() - 1;
        let pays = self.gain(rival) > cost_of(&rival.fit, last);
        rival.ended && pays && !is_steady(rival.kind, &rival.fit, &self.base)
    }

    /// Counts the idle numbers of the likeliest.
    fn count_idle(&mut self, data: &Data) {
        self.near_the_best().into_par_iter().for_each(|rival| rival.idle = idle::numbers(&rival.fit, data));
    }

    /// Which were fitted to the end and gain more than this part of what the best one does.
    fn near_the_best_of(&self, part: f64) -> Vec<bool> {
        let top = self.rivals.first().map_or(0.0, |best| self.gain(best));
        self.rivals.iter().map(|rival| rival.ended && self.gain(rival) > part * top).collect()
    }

    /// The likeliest, of those that were fitted to the end.
    fn near_the_best(&mut self) -> Vec<&mut Rival> {
        let near = self.near_the_best_of(NEAR);
        self.rivals.iter_mut().zip(near).filter_map(|(rival, is_near)| is_near.then_some(rival)).collect()
    }

    /// Log-likelihood that a rival gains over the base. That a load which stays is unlikely speaks for none of them: what takes its place is no
    /// likelier.
    pub fn gain(&self, rival: &Rival) -> f64 {
        let relief = prior_row(&self.base) - prior_row(&rival.fit);
        0.5 * (self.base.objective() - rival.fit.objective() - relief.max(0.0))
    }

    /// What a rival loses because the load that stays beside it is larger than beside the base.
    pub fn lost_to_load(&self, rival: &Rival) -> f64 {
        0.5 * (prior_row(&rival.fit) - prior_row(&self.base)).max(0.0)
    }
}

/// A fit's point with the plant's, the load's and the noise's numbers of another.
pub fn with_shared(fit: &Fit, other: &Fit) -> Point {
    let mut point = fit.point.clone();
    for (free, x) in fit.hypothesis.free.iter().zip(&mut point.x) {
        let shared = is_noise(free.target) || is_of_loop(free.target);
        if shared && let Some(value) = other.hypothesis.place(free.target).and_then(|i| other.point.x.get(i))
        {
            *x = *value;
        }
    }
    point
}
