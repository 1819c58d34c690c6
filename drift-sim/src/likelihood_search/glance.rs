//! A look at every kind of physics beside a base: where the fit of each begins, what it promises there, and short fits from there, of those rounds in which
//! something may be found.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::likelihood::Data;
use crate::physics::{KINDS, Kind, Scales, Start, Starts};
use crate::stage;

use super::decide::cost_of;
use super::nominal;
use super::rivals::{Sketch, begins_at_once, grows, is_searched, last_kind, shared_point, stuck};
use super::starts::{Base, Begin, begins, neutral};

/// Starts of a kind from each base, and how far apart two of them begin, as part of the recording.
const STARTS: usize = 2;
const APART: f64 = 0.03;
/// Slides from each start, and steps of a short fit.
const SLIDES: usize = 2;
const SHORT: usize = 3;
/// Part of what a start promises that a slide from it must keep.
const KEPT: f64 = 0.5;
/// Gain of a short fit from which its shared numbers are tried for the other kinds.
const LEADS: f64 = 15.0;
/// Log-likelihood that a start must promise in a later round.
const PROMISES: f64 = 4.0;
/// Part of what is needed that a start or a fit must come to for the first round, or a later one, to go on. The best of all onsets gains 8 to 12 nats by
/// chance, and 18 are needed.
const NEAR_FIRST: f64 = 0.3;
const NEAR_LATER: f64 = 0.6;
/// Part of the best one's gain, at its start, from which on a kind's fit goes on, where the best one gains this much.
const FOLLOWED: f64 = 0.03;
const FAR_AHEAD: f64 = 1000.0;
/// By how much a start may understate what its kind gains: the most that was seen on generated loops is 3.8 times (a limit that u seldom reaches).
const UNDERSTATED: f64 = 4.0;

/// Log-likelihood that a fit gains over a base.
pub fn gain_over(base: &Fit, fit: &Fit) -> f64 {
    0.5 * (base.objective() - fit.objective())
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

    /// Whether one of these fits, each with what it gains or promises, comes near enough to what it needs for the round to go on. Under a coloring each
    /// kind may gain by one of its own besides.
    pub fn goes_on<'a>(self, data: &Data, mut fits: impl Iterator<Item = (&'a Fit, f64)>) -> bool {
        let part = match self {
            Self::First(_) => NEAR_FIRST,
            Self::Later(_) => NEAR_LATER,
        };
        data.is_colored() || fits.any(|(fit, gain)| gain >= part * self.needed(fit))
    }
}

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

    /// What a kind gains at its start or promises, after what it needs; 0 where that is not enough.
    fn most(&self) -> f64 {
        let begun = self.begun.iter().map(|begun| (&begun.fit, begun.promise));
        let all = begun.chain(self.offered.iter().map(|(_, fit)| (fit, 0.0)));
        all.map(|(fit, promise)| gain_over(&self.seen, fit).max(promise) - self.round.needed(fit))
            .fold(0.0, f64::max)
    }

    /// The objective that base and kinds come to, at most and at least, with what the plant costs.
    pub fn bounds(&self, cost: f64) -> (f64, f64) {
        let (most, seen) = (self.most(), self.seen.objective());
        (seen - 2.0 * most + cost, seen - 2.0 * UNDERSTATED * (most + LEADS) + cost)
    }

    /// Short fits from there.
    pub fn sketched(self, data: &Data) -> Sketch {
        let Self { seen, begun, offered, round } = self;
        let top = begun.iter().map(|begun| gain_over(&seen, &begun.fit)).fold(0.0, f64::max);
        let most = |begun: &Begun| gain_over(&seen, &begun.fit).max(begun.promise);
        // Where one kind may be named, its rivals leave by evidence against them alone: a slide at rest says little of dry friction, say.
        let goes_on = round.goes_on(data, begun.iter().map(|begun| (&begun.fit, most(begun))));
        let leading = if top > FAR_AHEAD { FOLLOWED * top } else { f64::NEG_INFINITY };
        let short = begun.into_par_iter().map(|mut begun| {
            if goes_on && most(&begun) >= leading {
                begun.fit.descend(data, SHORT, &stuck(&begun.fit.hypothesis));
            }
            (begun.kind, at_least_idle(&seen, begun.fit, data))
        });
        let short: Vec<(&'static Kind, Fit)> = short.collect();
        let mut sketch = Sketch { short: second_round(short, &seen, data), seen, round };
        offered.into_iter().for_each(|(kind, fit)| sketch.offer(kind, fit));
        sketch
    }
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
    let widened = fit.hypothesis.widen(&base.hypothesis, &base.point);
    let point = fit.hypothesis.started(&widened, &Start::of(neutral(kind)), onset_of(&fit).unwrap_or(0.0));
    match Fit::at(&fit.hypothesis, &point, data) {
        Some(idle) if idle.objective() < fit.objective() => idle,
        _ => fit,
    }
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
    let gain = |fit: &Fit| gain_over(base, fit);
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
