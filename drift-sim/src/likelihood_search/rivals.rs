//! Fits of all kinds of physics beside a base: what explains the recordings, each kind at the best point that can be found.

use rayon::prelude::*;

use crate::estimate::fit::{Fit, SLID_GAIN, Tangent};
use crate::estimate::hypothesis::{Hypothesis, Point, Target, is_noise};
use crate::estimate::likelihood::Data;
use crate::physics::{KINDS, Kind, Parameter, Place, Scales, Start, Starts};
use crate::stage;

use super::decide::cost_of;
use super::needle::at_needle;
use super::nominal;
use super::starts::{Base, Begin, begins};

/// Starts of a kind from each base, and how far apart two of them begin, as part of the recording.
const STARTS: usize = 2;
const APART: f64 = 0.03;
/// Slides from each start.
const SLIDES: usize = 2;
/// Gain of a short fit below which a kind is not fitted to the end.
const LEAST: f64 = 3.0;
/// Steps of a short fit, of a longer one and of one that is to end.
const SHORT: usize = 3;
const LONG: usize = 12;
const AGAIN: usize = 5;
const POLISH: usize = 30;
/// Part of the best one's gain from which on a kind's fit is polished.
const NEAR: f64 = 0.8;
/// Part of the best one's gain, and gain, from which on a needle is searched for.
const NEEDLED: f64 = 0.5;
const LEAST_NEEDLED: f64 = 60.0;
/// A kind is fitted to the end where its short fit gains more than this part of the best one's, or comes this close to it.
const WORTH: f64 = 0.15;
const CLOSE: f64 = 60.0;
/// Samples by which an onset is moved to and fro at the end.
const SETTLED: f64 = 12.0;
/// Part of what a start promises that a slide from it must keep.
const KEPT: f64 = 0.5;
/// Gain of a short fit from which its shared numbers are tried for the other kinds.
const LEADS: f64 = 15.0;

/// A kind at its best point.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The kind.
    pub kind: &'static Kind,
    /// Its fit: the base with the kind as the last candidate.
    pub fit: Fit,
    /// Whether it was fitted to the end: else it was far behind.
    pub ended: bool,
}

impl Rival {
    /// This kind as a rival has what it does; that rival's own fit where it is of this kind.
    fn like(&self, other: &Self, data: &Data) -> Option<Fit> {
        if other.kind == self.kind {
            return Some(other.fit.clone());
        }
        let Starts::Peak { like, .. } = self.kind.search else { return None };
        let term = other.fit.hypothesis.realise(&other.fit.point)?.model.physics.pop()?;
        let hypothesis = &self.fit.hypothesis;
        let point = hypothesis.started(&with_shared(&self.fit, &other.fit), &Start::of(like(&term)?), 0.0);
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

/// Whether the likelihood of y is where a kind is looked for.
pub fn is_searched(kind: &Kind) -> bool {
    kind.place != Place::Controller && !matches!(kind.search, Starts::Apart)
}

fn begins_at_once(kind: &Kind) -> bool {
    matches!(kind.search, Starts::Onset(_) | Starts::NoiseChange)
}

fn grows(kind: &Kind) -> bool {
    matches!(kind.search, Starts::Ramp(_))
}

/// Numbers that a descent can't move: those of a last term that has no slope.
pub fn stuck(hypothesis: &Hypothesis) -> Vec<usize> {
    let Some(last) = hypothesis.candidates().len().checked_sub(1) else { return Vec::new() };
    let places = hypothesis.places_of(last);
    let is_peak =
        hypothesis.candidates().last().is_some_and(|term| matches!(term.kind.search, Starts::Peak { .. }));
    if is_peak { places } else { Vec::new() }
}

/// The kind of a fit's last candidate.
pub fn last_kind(fit: &Fit) -> Option<&'static Kind> {
    fit.hypothesis.candidates().last().map(|term| term.kind)
}

/// Which round of a search it is, and what a kind must gain in it after the cost of its numbers.
#[derive(Debug, Clone, Copy)]
pub enum Round {
    /// The first kind is looked for: from more starts.
    First(f64),
    /// A further one.
    Later(f64),
}

impl Round {
    /// The gain that is needed, the cost of the numbers of a fit's last candidate in it.
    fn needed(self, fit: &Fit) -> f64 {
        let (Self::First(least) | Self::Later(least)) = self;
        least + cost_of(fit, fit.hypothesis.candidates().len() - 1)
    }

    /// What a start must promise to be tried.
    fn promising(self) -> f64 {
        match self {
            Self::First(_) => f64::NEG_INFINITY,
            Self::Later(_) => PROMISES,
        }
    }

    /// The part of it that a start or a fit must come to for the round to go on. The best of all onsets gains 8 to 12 nats by chance, and 18 are needed.
    fn hopeful(self) -> f64 {
        match self {
            Self::First(_) => 0.3,
            Self::Later(_) => 0.6,
        }
    }
}

/// Log-likelihood that a start must promise in a later round.
const PROMISES: f64 = 4.0;
/// Part of the best one's gain, at its start, from which on a kind's fit goes on, where the best one gains this much.
const FOLLOWED: f64 = 0.03;
const FAR_AHEAD: f64 = 1000.0;

/// Where the kinds of a round begin beside a base, and what each promises: what a look at them costs least.
pub struct Glance {
    /// The base, fitted again.
    seen: Fit,
    begun: Vec<Begun>,
    /// Fits that were found another way.
    offered: Vec<(&'static Kind, Fit)>,
    round: Round,
}

impl Glance {
    /// At the kinds that a base has not; `None` where it can't be simulated.
    pub fn of(base: &Fit, data: &Data, round: Round) -> Option<Self> {
        let present = |kind: &Kind| base.hypothesis.candidates().iter().any(|term| term.kind == kind);
        let kinds: Vec<&'static Kind> = KINDS
            .iter()
            .copied()
            .filter(|kind| is_searched(kind) && (kind.applies)(&base.hypothesis.model.plant))
            .filter(|kind| !present(kind))
            .collect();
        let mut seen = base.clone();
        seen.descend(data, SHORT, &[]);
        let quiet = if matches!(round, Round::First(_)) { nominal::quiet(&seen, data) } else { None };
        let bases: Vec<Base<'_>> = [Some(&seen), quiet.as_ref()]
            .into_iter()
            .flatten()
            .filter_map(|fit| Base::new(fit, data))
            .collect();
        stage::begins("every kind of physics, at a glance", kinds.len());
        let begun = kinds.into_par_iter().filter_map(|kind| {
            let begun = Begun::of(&bases, kind, data, round);
            stage::step();
            begun
        });
        let begun = begun.collect();
        Some(Self { seen, begun, offered: Vec::new(), round })
    }

    /// A kind's fit that was found another way.
    pub fn offer(&mut self, kind: &'static Kind, fit: Fit) {
        self.offered.push((kind, fit));
    }

    fn gain(&self, fit: &Fit) -> f64 {
        0.5 * (self.seen.objective() - fit.objective())
    }

    /// What a kind gains at its start or promises, after what it needs; 0 where that is not enough.
    fn most(&self) -> f64 {
        let begun = self.begun.iter().map(|begun| (&begun.fit, begun.promise));
        let all = begun.chain(self.offered.iter().map(|(_, fit)| (fit, 0.0)));
        all.map(|(fit, promise)| self.gain(fit).max(promise) - self.round.needed(fit)).fold(0.0, f64::max)
    }

    /// The objective that base and kinds come to, at most, and at least: what a start promises may be a fourth of what its fit gains.
    pub fn bounds(&self) -> (f64, f64) {
        let most = self.most();
        (self.seen.objective() - 2.0 * most, self.seen.objective() - 2.0 * UNDERSTATED * (most + LEADS))
    }

    /// Short fits from there.
    pub fn sketched(self, data: &Data) -> Sketch {
        let Self { seen, begun, offered, round } = self;
        let gain = |fit: &Fit| 0.5 * (seen.objective() - fit.objective());
        let top = begun.iter().map(|begun| gain(&begun.fit)).fold(0.0, f64::max);
        // Where one kind may be named, its rivals leave by evidence against them alone: a slide at rest says little of dry friction, say. Under a coloring
        // each may gain by one of its own besides.
        let is_near =
            |begun: &Begun, part: f64| gain(&begun.fit).max(begun.promise) >= part * round.needed(&begun.fit);
        let is_open = data.is_colored() || begun.iter().any(|begun| is_near(begun, round.hopeful()));
        let leading = if top > FAR_AHEAD { FOLLOWED * top } else { f64::NEG_INFINITY };
        let short = begun.into_par_iter().map(|begun| {
            let Begun { kind, mut fit, promise } = begun;
            if is_open && gain(&fit).max(promise) >= leading {
                fit.descend(data, SHORT, &stuck(&fit.hypothesis));
            }
            (kind, at_least_idle(&seen, fit, data))
        });
        let short: Vec<(&'static Kind, Fit)> = short.collect();
        let mut sketch = Sketch { short: second_round(short, &seen, data), seen, round };
        offered.into_iter().for_each(|(kind, fit)| sketch.offer(kind, fit));
        sketch
    }
}

/// By how much a start may understate what its kind gains: seen on generated loops, where it was half as much at most.
const UNDERSTATED: f64 = 4.0;

/// Short fits of the kinds of a round beside a base.
pub struct Sketch {
    /// The base, fitted again.
    seen: Fit,
    short: Vec<(&'static Kind, Fit)>,
    round: Round,
}

impl Sketch {
    /// A kind's fit that was found another way, where it is better.
    fn offer(&mut self, kind: &'static Kind, fit: Fit) {
        match self.short.iter_mut().find(|(of, _)| *of == kind) {
            Some((_, known)) if known.objective() <= fit.objective() => {}
            Some((_, known)) => *known = fit,
            None => self.short.push((kind, fit)),
        }
    }

    /// The least objective of base and kinds, with the cost of a kind's numbers and what it must gain at `least`: a plant that needs no physics is
    /// preferred to one that does.
    pub fn least_objective(&self, least: f64) -> f64 {
        let with =
            |fit: &Fit| fit.objective() + 2.0 * (least + cost_of(fit, fit.hypothesis.candidates().len() - 1));
        self.short.iter().map(|(_, fit)| with(fit)).fold(self.seen.objective(), f64::min)
    }

    /// The kinds that may be the one, fitted to the end on all of the data.
    pub fn finished(self, base: &Fit, data: &Data) -> Field {
        let gains: Vec<f64> =
            self.short.iter().map(|(_, fit)| 0.5 * (self.seen.objective() - fit.objective())).collect();
        let top = gains.iter().copied().fold(0.0, f64::max);
        let round = self.round;
        let is_near = |(fit, gain): (&Fit, &f64)| *gain >= round.hopeful() * round.needed(fit);
        let is_open = data.is_colored() || self.short.iter().map(|(_, fit)| fit).zip(&gains).any(is_near);
        stage::begins("every kind of physics, to the end", self.short.len());
        let rivals: Vec<Rival> = self
            .short
            .into_par_iter()
            .zip(gains)
            .map(|((kind, mut fit), gain)| {
                let ended = is_open && gain > (WORTH * top).min(top - CLOSE).max(LEAST);
                if ended {
                    to_the_end(&mut fit, kind, data);
                }
                stage::step();
                Rival { kind, fit, ended }
            })
            .collect();
        let mut field = Field { base: base.clone(), rivals };
        if matches!(round, Round::Later(_)) && field.rivals.iter().all(|rival| !rival.ended) {
            field.sort();
            return field;
        }
        field.share(data);
        field.search_needles(data);
        field
    }
}

/// The kinds of a round beside a base.
pub fn field(base: &Fit, data: &Data, round: Round) -> Option<Field> {
    Some(Glance::of(base, data, round)?.sketched(data).finished(base, data))
}

/// Where the fit of a kind begins: the best of what has slid from each base's starts, and what the best start promised.
struct Begun {
    kind: &'static Kind,
    fit: Fit,
    promise: f64,
}

impl Begun {
    fn of(bases: &[Base<'_>], kind: &'static Kind, data: &Data, round: Round) -> Option<Self> {
        let slid = bases.iter().filter_map(|base| Self::from(base, kind, data, round));
        slid.reduce(|a, b| {
            let promise = a.promise.max(b.promise);
            Self { promise, ..if b.fit.objective() < a.fit.objective() { b } else { a } }
        })
    }

    fn from(base: &Base<'_>, kind: &'static Kind, data: &Data, round: Round) -> Option<Self> {
        let duration = data.recordings.first()?.duration_s();
        let most = if moves_the_plant(kind, &base.fit.hypothesis.scales) { usize::MAX } else { STARTS };
        let mut best: Option<Fit> = None;
        let mut promise = 0.0;
        let mut tried: Vec<f64> = Vec::new();
        let least = round.promising();
        for begin in begins(base, kind).into_iter().filter(|begin| 0.5 * begin.score > least) {
            let is_near = |onset: &f64| (onset - begin.onset_s).abs() < APART * duration;
            if begins_at_once(kind) && tried.iter().any(is_near) {
                continue;
            }
            promise = f64::max(promise, 0.5 * begin.score);
            tried.push(begin.onset_s);
            best = better(best, tried_from(base, &begin, kind, data));
            if tried.len() == most {
                break;
            }
        }
        Some(Self { kind, fit: best?, promise })
    }
}

/// A kind's fit, or the kind doing nothing where that is likelier.
fn at_least_idle(base: &Fit, fit: Fit, data: &Data) -> Fit {
    if fit.objective() <= base.objective() {
        return fit;
    }
    let Some(kind) = last_kind(&fit) else { return fit };
    let neutral: Vec<f64> = kind.parameters.iter().map(|parameter| parameter.neutral).collect();
    let widened = fit.hypothesis.widen(&base.hypothesis, &base.point);
    let point = fit.hypothesis.started(&widened, &Start::of(neutral), onset_of(&fit).unwrap_or(0.0));
    let idle = Fit::at(&fit.hypothesis, &point, data);
    better(Some(fit.clone()), idle).unwrap_or(fit)
}

/// Whether a kind's starts move the plant's numbers with its own: what the base's numbers can't follow along a straight line.
fn moves_the_plant(kind: &Kind, scales: &Scales) -> bool {
    match kind.search {
        Starts::Grid(points) => points(scales).iter().any(|start| start.gain != 0.0 || start.time != 0.0),
        _ => false,
    }
}

/// A fit from a start. A wave's length is too far from linear for a slide, and so is what moves the plant; where a slide does not keep what its start
/// promises, the base's numbers are too far from linear themselves (a random load had swallowed what is found now).
fn tried_from(base: &Base<'_>, begin: &Begin, kind: &Kind, data: &Data) -> Option<Fit> {
    if moves_the_plant(kind, &base.fit.hypothesis.scales) {
        // There are many of these starts, and the best of them goes on.
        return descended(begin, data, 1);
    }
    if !matches!(kind.search, Starts::Wave(_)) {
        let slid = base.slid(begin, SLIDES, &stuck(&begin.hypothesis));
        let gained = slid.as_ref().map_or(f64::NEG_INFINITY, |fit| base.fit.objective() - fit.objective());
        if begin.score < 2.0 * LEADS || gained > KEPT * begin.score {
            return slid;
        }
        return better(slid, descended(begin, data, SHORT));
    }
    descended(begin, data, SHORT)
}

fn descended(begin: &Begin, data: &Data, steps: usize) -> Option<Fit> {
    let mut fit = Fit::at(&begin.hypothesis, &begin.point, data)?;
    fit.descend(data, steps, &stuck(&begin.hypothesis));
    Some(fit)
}

fn better(a: Option<Fit>, b: Option<Fit>) -> Option<Fit> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.objective() < a.objective() { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// Every kind again from the shared numbers of the best one; what begins at once, or grows from some time on, also from when the best of those begins.
fn second_round(mut short: Vec<(&'static Kind, Fit)>, base: &Fit, data: &Data) -> Vec<(&'static Kind, Fit)> {
    let gain = |fit: &Fit| 0.5 * (base.objective() - fit.objective());
    let Some((leader, best)) =
        short.iter().min_by(|a, b| a.1.objective().total_cmp(&b.1.objective())).cloned()
    else {
        return short;
    };
    if gain(&best) < LEADS {
        return short;
    }
    let Some(shared) = Fit::at(&base.hypothesis, &shared_point(base, &best), data) else { return short };
    let Some(from) = Base::new(&shared, data) else { return short };
    let earliest = |is_of: fn(&Kind) -> bool| {
        let likely = short.iter().filter(|(kind, fit)| is_of(kind) && gain(fit) > LEADS);
        let (kind, fit) = likely.min_by(|a, b| a.1.objective().total_cmp(&b.1.objective()))?;
        Some((*kind, onset_of(fit)?))
    };
    let (step, ramp) = (earliest(begins_at_once), earliest(grows));
    short.par_iter_mut().filter(|(kind, _)| *kind != leader).for_each(|(kind, fit)| {
        let mut tried: Vec<Option<Fit>> = begins(&from, kind)
            .first()
            .map(|begin| tried_from(&from, begin, kind, data))
            .into_iter()
            .collect();
        let alike = if begins_at_once(kind) { step } else { ramp.filter(|_| grows(kind)) };
        if let Some((_, onset_s)) = alike.filter(|(of, _)| of != kind) {
            for side in [0.15, -0.15] {
                tried.push(at_onset(fit, &from, onset_s, side, data));
            }
        }
        for trial in tried.into_iter().flatten() {
            if trial.objective() < fit.objective() {
                *fit = trial;
            }
        }
    });
    short
}

/// When the last candidate begins.
fn onset_of(fit: &Fit) -> Option<f64> {
    Some(fit.hypothesis.realise(&fit.point)?.model.physics.last()?.onset_s)
}

/// A kind from another's onset.
fn at_onset(fit: &Fit, from: &Base<'_>, onset_s: f64, size: f64, data: &Data) -> Option<Fit> {
    let hypothesis = fit.hypothesis.clone();
    let mut point = hypothesis.widen(&from.fit.hypothesis, &from.fit.point);
    let place = *hypothesis.places_of(hypothesis.candidates().len() - 1).first()?;
    let free = hypothesis.free.get(place)?;
    *point.x.get_mut(place)? = size.clamp(free.low, free.high);
    let last = hypothesis.model.physics.len() - 1;
    match hypothesis.place(Target::Onset(last)) {
        Some(onset) => *point.x.get_mut(onset)? = hypothesis.free.get(onset)?.x_of(onset_s),
        None => *point.onsets.last_mut()? = onset_s,
    }
    descended(&Begin { score: 0.0, hypothesis, point, onset_s }, data, SHORT)
}

/// The base's point with the numbers that it shares with another fit.
fn shared_point(base: &Fit, other: &Fit) -> Point {
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
    let is_rough = |i: &usize| fit.hypothesis.free.get(*i).is_some_and(|free| !free.smooth);
    let rough: Vec<usize> = places.into_iter().filter(is_rough).collect();
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
        fit.descend(data, AGAIN, &fixed);
    }
}

/// Moves the onset of a last candidate by few samples, the other numbers with it, until that helps no more.
fn settle_onset(fit: &mut Fit, data: &Data) {
    let last = fit.hypothesis.candidates().len() - 1;
    let width = SETTLED * fit.hypothesis.model.sample_time_s;
    for _ in 0..AGAIN {
        let before = fit.point.onsets.clone();
        let Some(tangent) = fit.tangent(data, &[]) else { return };
        fit.search_onset(data, last, width, Some(&tangent));
        if fit.point.onsets == before {
            return;
        }
        fit.descend(data, AGAIN, &[]);
    }
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
        self.rivals.par_iter_mut().filter(|rival| rival.ended).for_each(|rival| {
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
        let least = (NEEDLED * self.rivals.first().map_or(0.0, |best| self.gain(best))).max(LEAST_NEEDLED);
        let likely: Vec<Rival> =
            self.rivals.iter().filter(|rival| self.gain(rival) > least).cloned().collect();
        for rival in self.rivals.iter_mut().filter(|rival| !stuck(&rival.fit.hypothesis).is_empty()) {
            let origins: Vec<Fit> = likely.iter().filter_map(|other| rival.like(other, data)).collect();
            for origin in origins {
                let found = at_needle(origin, rival.kind, data);
                if found.objective() < rival.fit.objective() {
                    *rival = Rival { kind: rival.kind, fit: found, ended: true };
                }
            }
        }
        self.sort();
    }

    /// The likeliest, each to where no step gains any more: what decides between them is their distance.
    fn polish(&mut self, data: &Data) {
        let top = self.rivals.first().map_or(0.0, |best| self.gain(best));
        let near: Vec<bool> = self.rivals.iter().map(|rival| self.gain(rival) > NEAR * top).collect();
        let near = self.rivals.par_iter_mut().zip(near).filter(|(rival, near)| rival.ended && *near);
        near.for_each(|(rival, _)| {
            let fixed = stuck(&rival.fit.hypothesis);
            rival.fit.descend(data, POLISH, &fixed);
            nominal::under_other_noise(&mut rival.fit, data);
            if begins_at_once(rival.kind) {
                settle_onset(&mut rival.fit, data);
            }
        });
        nominal::under_other_noise(&mut self.base, data);
        self.sort();
    }

    /// Log-likelihood that a rival gains over the base. That a load which stays is unlikely speaks for none of them: what takes its place is no
    /// likelier.
    pub fn gain(&self, rival: &Rival) -> f64 {
        let relief = constant_load_row(&self.base) - constant_load_row(&rival.fit);
        0.5 * (self.base.objective() - rival.fit.objective() - relief.max(0.0))
    }
}

/// What the prior of the load that stays adds to a fit's objective.
fn constant_load_row(fit: &Fit) -> f64 {
    let hypothesis = &fit.hypothesis;
    let row = hypothesis.place(Target::ConstantLoad).and_then(|i| hypothesis.prior_rows(&fit.point).nth(i));
    row.map_or(0.0, |row| row * row)
}

/// A fit's point with the plant's, the load's and the noise's numbers of another.
fn with_shared(fit: &Fit, other: &Fit) -> Point {
    let mut point = fit.point.clone();
    for (free, x) in fit.hypothesis.free.iter().zip(&mut point.x) {
        let shared = is_noise(free.target)
            || matches!(free.target, Target::Plant(_) | Target::ConstantLoad | Target::Late);
        if shared && let Some(value) = other.hypothesis.place(free.target).and_then(|i| other.point.x.get(i))
        {
            *x = *value;
        }
    }
    point
}
