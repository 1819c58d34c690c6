//! A look at every kind of physics beside a base: where the fit of each begins, what it promises there, and short fits from there, of those rounds in which
//! something may be found.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::likelihood::Data;
use crate::physics::{Family, KINDS, Kind, Scales, Start, Starts};
use crate::plant::Plant;
use crate::stage;

use super::decide::cost_of;
use super::nominal;
use super::rivals::{Sketch, begins_at_once, grows, is_searched, last_kind, shared_point, stuck};
use super::starts::{Base, Begin, at_onset, begins, begins_of_size, climbed, neutral};

/// Starts of a kind from each base, and how far apart two of them begin, as part of the recording.
const STARTS: usize = 2;
const APART: f64 = 0.03;
/// Slides from each start, and steps of a short fit.
const SLIDES: usize = 2;
const SHORT: usize = 3;
/// Steps of a fit behind a limit, of a plant that was guessed from what goes into it.
const LONG: usize = 6;
/// Part of what a start promises that a slide from it must keep.
const KEPT: f64 = 0.5;
/// Gain of a short fit from which its shared numbers are tried for the other kinds.
const LEADS: f64 = 15.0;
/// Part of the drive that the numbers of a grid are about.
const PART_OF_DRIVE: f64 = 0.3;
/// Log-likelihood that a start must promise in a later round.
const PROMISES: f64 = 4.0;
/// Part of what is needed that a start or a fit must come to for the first round, or a later one, to go on. The best of all onsets gains 8 to 12 nats by
/// chance, and 18 are needed.
const NEAR_FIRST: f64 = 0.3;
const NEAR_LATER: f64 = 0.6;
/// Part of the best one's gain, at its start, from which on a kind's fit goes on, where the best one gains this much.
const FOLLOWED: f64 = 0.03;
const FAR_AHEAD: f64 = 300.0;
/// By how much a start may understate what its kind gains: the most that was seen on generated loops is 3.8 times (a limit that u seldom reaches).
const UNDERSTATED: f64 = 4.0;

/// Deviations from what was taken as likely at which a plant's number has left it.
const LEFT: f64 = 3.0;

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
            .filter(|kind| is_searched(kind, &base.hypothesis) && !present(kind))
            .collect();
        let mut seen = base.clone();
        seen.descend(data, SHORT, &[]);
        let is_quiet_tried = matches!(round, Round::First(_)) || has_left_what_is_stated(&seen);
        let quiet = if is_quiet_tried { nominal::quiet(&seen, data) } else { None };
        let bases: Vec<Base<'_>> = [Some(&seen), quiet.as_ref()]
            .into_iter()
            .flatten()
            .filter_map(|fit| Base::new(fit, data))
            .collect();
        stage::begins("every kind of physics, at a glance", kinds.len());
        let starts = kinds.into_par_iter().map(|kind| {
            let of_each = bases.iter().map(|base| begins(base, kind)).collect();
            stage::step();
            (kind, of_each)
        });
        let starts: Vec<(&'static Kind, Vec<Vec<Begin>>)> = starts.collect();
        let lead = Lead::of_starts(&starts, &seen);
        let climbs = starts.into_par_iter().map(|(kind, of_each)| {
            let promise = promise(of_each.iter().flatten());
            let of_each = bases.iter().zip(of_each);
            (kind, of_each.map(|(base, begun)| lead.climbed(base, kind, begun, promise)).collect())
        });
        let starts: Vec<(&'static Kind, Vec<Vec<Begin>>)> = climbs.collect();
        let lead = Lead::of_starts(&starts, &seen);
        let begun = starts.into_par_iter().filter_map(|(kind, of_each)| {
            let promise = promise(of_each.iter().flatten());
            let each = bases.iter().zip(of_each);
            let is_behind = lead.leaves_behind(kind, promise);
            let begun = each.filter_map(|(base, starts)| {
                let beside = Beside { base, data, is_first: matches!(round, Round::First(_)), is_behind };
                beside.best_of(kind, starts, round)
            });
            let fit = begun.reduce(|a, b| if b.objective() < a.objective() { b } else { a })?;
            Some(Begun { kind, fit, promise })
        });
        let begun = begun.collect();
        Some(Self { seen, begun, offered: Vec::new(), round })
    }

    /// A kind's fit that was found another way.
    pub fn offer(&mut self, kind: &'static Kind, fit: Fit) {
        self.offered.push((kind, fit));
    }

    /// What the kinds gain where they begin, and what they gain or promise there; the most of each after what it needs, 0 where that is not enough.
    fn most(&self) -> (f64, f64) {
        let begun = self.begun.iter().map(|begun| (&begun.fit, begun.promise));
        let all = begun.chain(self.offered.iter().map(|(_, fit)| (fit, 0.0)));
        let each = all.map(|(fit, promise)| {
            let (gain, needed) = (gain_over(&self.seen, fit), self.round.needed(fit));
            (gain - needed, gain.max(promise) - needed)
        });
        each.fold((0.0, 0.0), |most, one| (most.0.max(one.0), most.1.max(one.1)))
    }

    /// The objective that base and kinds come to, at most and at least, with what the plant costs. What is only promised may not come.
    pub fn bounds(&self, cost: f64) -> (f64, f64) {
        let ((gained, promised), seen) = (self.most(), self.seen.objective());
        (seen - 2.0 * gained + cost, seen - 2.0 * UNDERSTATED * (promised + LEADS) + cost)
    }

    /// Short fits from there.
    pub fn sketched(self, data: &Data) -> Sketch {
        let Self { seen, begun, offered, round } = self;
        let most = |begun: &Begun| gain_over(&seen, &begun.fit).max(begun.promise);
        // Where one kind may be named, its rivals leave by evidence against them alone: a slide at rest says little of dry friction, say.
        let goes_on = round.goes_on(data, begun.iter().map(|begun| (&begun.fit, most(begun))));
        let lead = Lead::of(begun.iter().map(|begun| (begun.kind, gain_over(&seen, &begun.fit))), &seen);
        let short = begun.into_par_iter().map(|mut begun| {
            if goes_on && !lead.leaves_behind(begun.kind, most(&begun)) {
                begun.fit.descend(data, SHORT, &stuck(&begun.fit.hypothesis));
            }
            (begun.kind, at_least_idle(&seen, begun.fit, data))
        });
        let short: Vec<(&'static Kind, Fit)> = short.collect();
        Sketch { short, offered, seen, round }
    }
}

/// Where the fit of a kind begins: the best of what has slid from each base's starts, and what the best start promised.
struct Begun {
    kind: &'static Kind,
    fit: Fit,
    promise: f64,
}

/// What the best of a kind's starts promises.
fn promise<'a>(starts: impl Iterator<Item = &'a Begin>) -> f64 {
    starts.map(|begin| 0.5 * begin.score).fold(0.0, f64::max)
}

/// The kind that promises or gains most of a round, and what others must to be followed beside it.
struct Lead<'a> {
    plant: &'a Plant,
    family: Option<Family>,
    followed: f64,
}

impl<'a> Lead<'a> {
    /// Of kinds with what each promises or gains beside a base.
    fn of(kinds: impl Iterator<Item = (&'static Kind, f64)>, base: &'a Fit) -> Self {
        let plant = &base.hypothesis.model.plant;
        let best = kinds.max_by(|a, b| a.1.total_cmp(&b.1));
        let family = best.and_then(|(kind, _)| kind.family_on(plant));
        let top = best.map_or(0.0, |(_, top)| top);
        Self { plant, family, followed: if top > FAR_AHEAD { FOLLOWED * top } else { f64::NEG_INFINITY } }
    }

    /// The same of kinds with their starts from each base.
    fn of_starts(starts: &[(&'static Kind, Vec<Vec<Begin>>)], base: &'a Fit) -> Self {
        Self::of(starts.iter().map(|(kind, of_each)| (*kind, promise(of_each.iter().flatten()))), base)
    }

    /// The starts of a kind that promises so much. A narrow peak is climbed where the points about it are not too far behind those of another kind.
    fn climbed(&self, base: &Base<'_>, kind: &'static Kind, begun: Vec<Begin>, promise: f64) -> Vec<Begin> {
        if self.leaves_behind(kind, promise) { begun } else { climbed(base, kind, begun) }
    }

    /// Whether a kind is too far behind to be followed. One of the best one's family never is: it may do the same from numbers that its starts do not show.
    fn leaves_behind(&self, kind: &Kind, promise: f64) -> bool {
        promise < self.followed && (self.family.is_none() || kind.family_on(self.plant) != self.family)
    }
}

/// What a kind is tried beside.
struct Beside<'a> {
    base: &'a Base<'a>,
    data: &'a Data,
    /// Whether nothing is named yet.
    is_first: bool,
    /// Whether the kind is too far behind another one for its starts to be followed.
    is_behind: bool,
}

impl Beside<'_> {
    /// The best of what a kind's starts lead to.
    fn best_of(&self, kind: &'static Kind, starts: Vec<Begin>, round: Round) -> Option<Fit> {
        let duration = self.data.recordings.first()?.duration_s();
        // Each start of a limit is followed by a long fit behind it, which comes to where the next start of as many limits would.
        let most = match kind.search {
            _ if self.is_behind || self.is_identified_before(kind) => 1,
            _ if moves_the_plant(kind, &self.base.fit.hypothesis.scales) => usize::MAX,
            _ => STARTS,
        };
        let mut best: Option<Fit> = None;
        let mut tried: Vec<(f64, Vec<bool>)> = Vec::new();
        let least = round.promising();
        for begin in starts.into_iter().filter(|begin| 0.5 * begin.score > least) {
            let is_near = |onset: &f64| (onset - begin.onset_s).abs() < APART * duration;
            if begins_at_once(kind) && tried.iter().any(|(onset, _)| is_near(onset)) {
                continue;
            }
            // One limit and two lead to different fits, whatever each promises.
            let limited = if self.is_behind { Vec::new() } else { limited(&begin, kind) };
            if tried.iter().filter(|(_, of)| *of == limited).count() == most {
                continue;
            }
            tried.push((begin.onset_s, limited));
            best = better(best, self.tried(&begin, kind));
        }
        best
    }

    /// Whether a plant was guessed from what goes into a limit of this kind: behind the limit it is another one, far from linear.
    fn is_identified_before(&self, kind: &Kind) -> bool {
        let is_limit = kind.parameters.iter().all(|parameter| parameter.limits);
        is_limit && self.base.fit.hypothesis.is_guessed && self.is_first && !self.is_behind
    }

    /// A fit from a start. The length of a wave that promises something is too far from linear for a slide, and so is what moves the plant; where a slide does not keep
    /// what its start promises, the base's numbers are too far from linear themselves (a random load had swallowed what is found now).
    fn tried(&self, begin: &Begin, kind: &Kind) -> Option<Fit> {
        if moves_the_plant(kind, &self.base.fit.hypothesis.scales) {
            // There are many of these starts, and the best of them goes on.
            return descended(begin, self.data, 1);
        }
        if self.is_identified_before(kind) {
            let slid = self.base.slid(begin, SLIDES, &stuck(&begin.hypothesis));
            return better(slid, descended(begin, self.data, LONG));
        }
        // A wave is followed however far behind it seems: where a loop rests the plant's numbers answer to it in the wave's place, and what they miss without it is far more.
        let is_wave = matches!(kind.search, Starts::Wave(_));
        if is_wave && begin.score > LEADS {
            return descended(begin, self.data, SHORT);
        }
        let slid = self.base.slid(begin, SLIDES, &stuck(&begin.hypothesis));
        let kept =
            slid.as_ref().is_some_and(|fit| self.base.fit.objective() - fit.objective() > KEPT * begin.score);
        if is_wave || kept || self.is_behind || begin.score < 2.0 * LEADS {
            return slid;
        }
        better(slid, descended(begin, self.data, SHORT))
    }
}

/// Which of several limits u passes where a fit begins; none of another kind.
fn limited(begin: &Begin, kind: &Kind) -> Vec<bool> {
    if kind.parameters.iter().filter(|parameter| parameter.limits).count() < 2 {
        return Vec::new();
    }
    let scales = &begin.hypothesis.scales;
    let passes = |limit: &f64| *limit > scales.u_lowest && *limit < scales.u_highest;
    begin.parameters().map_or(Vec::new(), |parameters| parameters.iter().map(passes).collect())
}

/// Whether a plant's number is far from where it was taken as likely: it may have taken up what is missing.
fn has_left_what_is_stated(fit: &Fit) -> bool {
    fit.hypothesis.free.iter().zip(&fit.point.x).any(|(free, x)| {
        matches!(free.target, Target::Plant(_)) && free.prior.is_some_and(|prior| x.abs() > LEFT * prior)
    })
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
    let moves = |start: &Start| start.gain != 0.0 || start.time != 0.0;
    kind.search.grid(scales).is_some_and(|points| points.iter().any(moves))
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

/// Every kind again from the shared numbers of the best one; what begins at once, or grows from some time on, also from when the best of those begins, and one of its family from its
/// size.
pub fn second_round(
    mut short: Vec<(&'static Kind, Fit)>,
    base: &Fit,
    data: &Data,
) -> Vec<(&'static Kind, Fit)> {
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
    let drive = level_of(&best).map(|level| level / PART_OF_DRIVE);
    let lead = Lead::of(std::iter::once((leader, gain_over(&shared, &best))), &shared);
    short.par_iter_mut().filter(|(kind, _)| *kind != leader).for_each(|(kind, fit)| {
        let alike = match kind.search {
            Starts::Onset(_) => step,
            Starts::Ramp(_) => ramp,
            _ => None,
        };
        let alike = alike.filter(|(of, _)| of != kind);
        let is_behind = |begin: &Begin| lead.leaves_behind(kind, 0.5 * begin.score);
        let begun = begins(&from, kind);
        let promise = promise(begun.iter());
        let from_best = lead.climbed(&from, kind, begun, promise).into_iter().next().and_then(|begin| {
            Beside { base: &from, data, is_first: false, is_behind: is_behind(&begin) }.tried(&begin, kind)
        });
        // A slide won't do from where the best one begins: what takes its place moves the plant's numbers far.
        let alike = alike.and_then(|(_, onset_s)| at_onset(&from, kind, onset_s));
        let with_best = alike.and_then(|begin| match is_behind(&begin) {
            true => from.slid(&begin, SLIDES, &stuck(&begin.hypothesis)),
            false => descended(&begin, data, SHORT),
        });
        let is_related = kind.is_related(leader);
        let of_size = drive.filter(|_| is_related).and_then(|drive| {
            let begin = begins_of_size(&from, kind, drive).into_iter().next()?;
            descended(&begin, data, SHORT)
        });
        for tried in [from_best, with_best, of_size].into_iter().flatten() {
            if tried.objective() < fit.objective() {
                *fit = tried;
            }
        }
    });
    short
}

/// The first number of the last candidate that is a part of the drive.
fn level_of(fit: &Fit) -> Option<f64> {
    let term = fit.hypothesis.realise(&fit.point)?.model.physics.pop()?;
    let mut numbers = term.kind.parameters.iter().zip(&term.parameters);
    let (_, level) = numbers.find(|(parameter, _)| parameter.unit == "{drive}")?;
    Some(level.abs())
}

/// When the last candidate begins.
fn onset_of(fit: &Fit) -> Option<f64> {
    Some(fit.hypothesis.realise(&fit.point)?.model.physics.last()?.onset_s)
}
