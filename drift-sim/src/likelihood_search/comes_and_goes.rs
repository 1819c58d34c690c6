//! What comes and goes: a load after u, or a sensor's bias, of one size whenever it is on. When it is, is read off the whole recording, for every recording has its own
//! times; how large it is, is fitted to what a fit may see, and proven beyond.

use crate::control_loop::Loop;
use crate::cores::AcrossCores as _;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Hypothesis, Point};
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::physics::Term;

use super::decide::cost_of;
use super::missing_drive;
use super::nominal;
use super::parts::Parts;
use super::two_levels::{TwoLevels, two_levels};
use super::without::without;
use super::{Case, Searched, law, spans};

/// Samples in which steps are looked for.
const ENOUGH: usize = 5_000;
/// Steps of the fit of their sizes.
const STEPS: usize = 12;
/// Steps by which edges are moved, in samples.
const EDGE_STEPS: [f64; 4] = [8.0, 4.0, 2.0, 1.0];
/// Rounds in which edges and numbers are fitted by turns.
const ROUNDS: usize = 2;
/// Times that are tried for an edge that no jump shows, and again about the best of them.
const TIMES: usize = 32;
/// Edges at most that are read off jumps, each of which is moved for itself, and those of them that no jump shows: more are looked for where doubt is left.
const MOST_EDGES: usize = 16;
const MOST_MISSING: usize = 2;
/// Samples within which a jump that goes the same way is the one before, found again: it was not quite where it seemed to be.
const SAME: usize = 100;
/// Part of a recording that is seen at most where the rest is to prove what comes and goes.
const MOST_SEEN: f64 = 0.9;

/// What comes and goes in a recording, with its times, in the means of the first of so many samples that show it; `None` of more than one, which have times of their own.
pub fn of(case: &Case<'_>, factors: impl IntoIterator<Item = usize>) -> Option<Vec<Term>> {
    if case.recordings.len() > 1 {
        return None;
    }
    let parts = Parts::new(case.recordings, None, case.options)?;
    let model = law::examine(case.nominal, &parts.recordings).model;
    let duration_s = parts.recordings.first().map_or(0.0, Signals::duration_s);
    // In the recording's own samples a load may be lost in what is fast.
    let mut found = factors.into_iter().filter_map(|factor| {
        let plants = Searched::of(&parts, case.healthy, &model, factor).plants(case.options);
        let plant = plants.into_iter().next()?.refined()?;
        Some(found_beside(&plant.nominal, &plant.data, case.options.least_gain))
    });
    found.find(|terms| comes_and_goes(terms, duration_s))
}

/// Whether anything comes and goes: what begins or ends once is a term of the library.
fn comes_and_goes(terms: &[Term], duration_s: f64) -> bool {
    let edges = terms.iter().flat_map(|term| &term.spans).flat_map(|(from, to)| [*from, *to]);
    edges.filter(|edge| *edge > 0.0 && *edge < duration_s).count() > 1
}

/// A way in which something may come and go: its terms, and those edges of the last one that no jump shows.
pub struct Way {
    terms: Vec<Term>,
    unseen: Vec<Unseen>,
}

impl Way {
    /// Whether a jump shows each of its edges.
    pub fn is_shown(&self) -> bool {
        self.unseen.is_empty()
    }
}

/// An edge of which is known between which times it is.
#[derive(Clone, Copy)]
struct Unseen {
    span: usize,
    is_end: bool,
    between_s: (f64, f64),
}

/// What comes and goes beside a base, its edges where the recording is likeliest; none where nothing does, or nothing that pays for its times.
fn found_beside(base: &Fit, data: &Data, least: f64) -> Vec<Term> {
    let ways = [by_steps(base, data), by_levels(base, data)].into_iter().flatten();
    let ways = ways.map(|terms| Way { terms, unseen: Vec::new() }).collect();
    likeliest_of(ways, base, data, least)
}

/// Of recordings that may have it the first alone, whose times they are.
pub fn of_first(data: &Data) -> Data {
    data.counting(|recording| recording == 0 || recording >= data.healthy_from)
}

/// Of these ways in which something may come and go beside a base the likeliest, its edges where the recording is likeliest; none where none pays.
pub fn likeliest_of(ways: Vec<Way>, base: &Fit, data: &Data, least: f64) -> Vec<Term> {
    let whole = &of_first(&data.whole());
    let fits = ways.into_iter().filter_map(|way| {
        let mut fit = begun(base, &way, whole)?;
        for _ in 0..ROUNDS {
            fit = settled(with_edges_moved(with_unseen_found(fit, &way.unseen, whole), whole), whole);
        }
        judged(fit, base, whole, least)
    });
    let best = fits.min_by(|a, b| a.objective().total_cmp(&b.objective()));
    let realised = best.and_then(|fit| fit.hypothesis.realise(&fit.point));
    let mut physics = realised.map(|realised| realised.model.physics).unwrap_or_default();
    physics.split_off(base.hypothesis.model.physics.len().min(physics.len()))
}

/// The ways in which a load of one level may come and go whose edges these jumps are, at samples and in the drive's unit; none where they are no such jumps. Between two that go the same
/// way one is missing, and so is one beside an odd number of them.
pub fn by_jumps(jumps: &[(usize, f64)], base: &Fit, data: &Data) -> Vec<Way> {
    let (Some(realised), Some(signals)) = (base.hypothesis.realise(&base.point), data.recordings.first())
    else {
        return Vec::new();
    };
    let jumps = in_order(jumps);
    let mean = jumps.iter().map(|(_, size)| size.abs()).sum::<f64>() / jumps.len().max(1) as f64;
    // It is added before the plant's dead time, behind which the filter sees it.
    let at_s =
        |at: usize| ((at as f64 - 0.5) * signals.sample_time_s - realised.model.plant.delay_s()).max(0.0);
    let (Some((first, size)), Some((last, _))) = (jumps.first().copied(), jumps.last()) else {
        return Vec::new();
    };
    let mut edges: Vec<(f64, f64)> = vec![(at_s(first), at_s(first))];
    for pair in jumps.windows(2) {
        let ((a, before), (b, after)) = (pair[0], pair[1]);
        if before * after > 0.0 {
            edges.push((at_s(a), at_s(b)));
        }
        edges.push((at_s(b), at_s(b)));
    }
    let missing = edges.iter().filter(|(from, to)| from < to).count() + edges.len() % 2;
    if edges.len() < 2 || edges.len() > MOST_EDGES || missing > MOST_MISSING {
        return Vec::new();
    }
    // What the filter takes from the drive is minus what is added to u.
    let level = -mean * size.signum() / realised.model.plant.drive_gain();
    let end_s = signals.duration_s() + signals.sample_time_s;
    let ways = if edges.len().is_multiple_of(2) {
        vec![way(level, &edges)]
    } else {
        let to_the_end: Vec<_> = edges.iter().copied().chain([(at_s(*last), end_s)]).collect();
        let from_the_start: Vec<_> = std::iter::once((0.0, at_s(first))).chain(edges).collect();
        vec![way(level, &to_the_end), way(-level, &from_the_start)]
    };
    ways.into_iter().flatten().collect()
}

/// Jumps in order, each once.
fn in_order(jumps: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let mut jumps = jumps.to_vec();
    jumps.sort_by_key(|(at, _)| *at);
    jumps.dedup_by(|next, one| next.0 - one.0 < SAME && next.1 * one.1 > 0.0);
    jumps
}

/// The way of a level that is on from the first of these edges to the second, and so on, each somewhere between two times.
fn way(level: f64, edges: &[(f64, f64)]) -> Option<Way> {
    let middle = |(from, to): (f64, f64)| 0.5 * (from + to);
    let spans: Vec<(f64, f64)> =
        edges.chunks_exact(2).map(|pair| (middle(pair[0]), middle(pair[1]))).collect();
    let unseen = edges.iter().enumerate().filter(|(_, (from, to))| from < to);
    let unseen = unseen.map(|(edge, between_s)| Unseen {
        span: edge / 2,
        is_end: edge % 2 == 1,
        between_s: *between_s,
    });
    let term = Term::new("injected_signal", &[("level", level)]).ok()?;
    Some(Way { terms: vec![term.within(&spans)], unseen: unseen.collect() })
}

/// The fit with each unseen edge of its last term where the recording is likeliest.
fn with_unseen_found(mut fit: Fit, unseen: &[Unseen], data: &Data) -> Fit {
    let Some(term) = fit.hypothesis.model.physics.len().checked_sub(1) else { return fit };
    for Unseen { span, is_end, between_s: (from_s, to_s) } in unseen.iter().copied() {
        let edge = Edge { term, span, is_end };
        let (mut low_s, mut high_s) = (from_s, to_s);
        for _ in 0..2 {
            // A signal is often on, or off, for a short while: the times are closer to one another near either end.
            let part = |i: usize| 0.5 - 0.5 * libm::cos(std::f64::consts::PI * i as f64 / TIMES as f64);
            let at_s = |i: usize| low_s + part(i) * (high_s - low_s);
            let tried = (0..=TIMES).collect::<Vec<_>>().into_par_iter();
            let tried = tried.filter_map(|i| Some((i, edge.at(&fit, at_s(i), data)?)));
            let best = tried.min_by(|a, b| a.1.objective().total_cmp(&b.1.objective()));
            let Some((i, best)) = best.filter(|(_, best)| best.objective() <= fit.objective()) else { break };
            fit = best;
            (low_s, high_s) = (at_s(i.saturating_sub(1)), at_s((i + 1).min(TIMES)));
        }
    }
    fit
}

/// A fit with these, those that pay; `None` where none does.
pub fn beside(base: &Fit, terms: &[Term], data: &Data, least: f64) -> Option<Fit> {
    judged(settled(fitted(base, terms, data)?, data), base, data, least)
}

/// The part of the recording that a fit beside these sees: the usual one, or as much as shows one of them begin and end; all of it, of which nothing is left to prove them, where that is
/// nearly all, or where some act beyond it alone.
pub fn seen_part(terms: &[Term], duration_s: f64, usual: f64) -> f64 {
    let spans = || terms.iter().flat_map(|term| &term.spans);
    let mut edges_s: Vec<f64> =
        spans().flat_map(|(from, to)| [*from, *to]).filter(|edge| *edge > 0.0).collect();
    edges_s.sort_by(f64::total_cmp);
    let (Some(second), next) = (edges_s.get(1), edges_s.get(2)) else { return 1.0 };
    let shown = (0.5 * (second + next.unwrap_or(&duration_s).min(duration_s))) / duration_s;
    let seen = if *second < usual * duration_s { usual } else { shown };
    let is_beyond = |term: &Term| term.spans.iter().all(|(from, _)| *from >= seen * duration_s);
    if seen > MOST_SEEN || terms.iter().any(is_beyond) { 1.0 } else { seen }
}

/// Steps of a load and of a bias that shapes tell apart.
fn by_steps(base: &Fit, data: &Data) -> Option<Vec<Term>> {
    let signals = data.recordings.first()?;
    let factor = (signals.len() / ENOUGH).max(1);
    let signals = signals.coarser(factor);
    let model = base.hypothesis.realise(&base.point)?.model;
    let model = Loop { sample_time_s: signals.sample_time_s, ..model };
    let steps = spans::steps(&model, &signals)?;
    let terms = spans::terms(&steps, &signals);
    (!terms.is_empty()).then_some(terms)
}

/// A load that is at one of two levels, by the load that the filter saw.
fn by_levels(base: &Fit, data: &Data) -> Option<Vec<Term>> {
    let signals = data.recordings.first()?;
    let missing = missing_drive::of(base, data, 1)?;
    let drive_gain = base.hypothesis.realise(&base.point)?.model.plant.drive_gain();
    let TwoLevels { level, spans } = two_levels(&missing.value)?;
    // Between two samples, so that rounding can't move an edge to the next.
    let at = |sample: usize| if sample == 0 { 0.0 } else { (sample as f64 - 0.5) * signals.sample_time_s };
    let spans: Vec<(f64, f64)> = spans.iter().map(|(from, to)| (at(*from), at(*to))).collect();
    let term = Term::new("injected_signal", &[("level", level / drive_gain)]).ok()?;
    (level != 0.0).then(|| vec![term.within(&spans)])
}

/// The fit with these terms, their edges as they are.
fn fitted(base: &Fit, terms: &[Term], data: &Data) -> Option<Fit> {
    begun(base, &Way { terms: terms.to_vec(), unseen: Vec::new() }, data)
}

/// The fit with the terms of a way, those of their edges that no jump shows where they are likeliest.
fn begun(base: &Fit, Way { terms, unseen }: &Way, data: &Data) -> Option<Fit> {
    let hypothesis: Hypothesis =
        terms.iter().cloned().fold(base.hypothesis.clone(), |wider, term| wider.with(term));
    let from = |point: &Point| {
        let fit = Fit::at(&hypothesis, &hypothesis.widen(&base.hypothesis, point), data)?;
        let mut fit = with_unseen_found(fit, unseen, data);
        fit.descend(data, STEPS, &[]);
        Some(fit)
    };
    // The base's noise has swallowed what comes and goes.
    let quiet = nominal::quiet(base, data).and_then(|quiet| from(&quiet.point));
    let found = [from(&base.point), quiet].into_iter().flatten();
    found.min_by(|a, b| a.objective().total_cmp(&b.objective()))
}

fn settled(mut fit: Fit, data: &Data) -> Fit {
    nominal::under_other_noise(&mut fit, data);
    fit.descend(data, STEPS, &[]);
    fit
}

/// The fit without those that don't pay.
fn judged(mut fit: Fit, base: &Fit, data: &Data, least: f64) -> Option<Fit> {
    let stated = base.hypothesis.candidates().len();
    let mut index = stated;
    while index < fit.hypothesis.candidates().len() {
        let less = without(&fit, index, data)?;
        let gain = 0.5 * (less.objective() - fit.objective()) - cost_of(&fit, index);
        if gain > least {
            index += 1;
        } else {
            fit = less;
        }
    }
    (fit.hypothesis.candidates().len() > stated).then_some(fit)
}

/// The edges of all spans where the recording is likeliest: each alone, and all together, as a plant's delay moves them.
fn with_edges_moved(mut fit: Fit, data: &Data) -> Fit {
    let ts = data.recordings.first().map_or(0.0, |signals| signals.sample_time_s);
    let edges = Edge::all_of(&fit.hypothesis);
    let groups: Vec<&[Edge]> = edges.chunks(1).chain([&edges[..]]).collect();
    for by in EDGE_STEPS {
        for group in &groups {
            let ways = [-by * ts, by * ts].into_par_iter();
            let ways = ways.filter_map(|by_s| Some((by_s, moved(group, &fit, by_s, data)?)));
            let better = ways.min_by(|a, b| a.1.objective().total_cmp(&b.1.objective()));
            let Some((by_s, better)) = better else { continue };
            fit = better;
            while let Some(better) = moved(group, &fit, by_s, data) {
                fit = better;
            }
        }
    }
    fit
}

/// The fit with these edges moved, if that is likelier. An edge that the recording does not reach has nothing to be judged by.
fn moved(edges: &[Edge], fit: &Fit, by_s: f64, data: &Data) -> Option<Fit> {
    let end_s = data.recordings.first()?.duration_s();
    let mut hypothesis = fit.hypothesis.clone();
    for edge in edges {
        let side = edge.side(&mut hypothesis).filter(|side| **side < end_s && **side > 0.0);
        side.into_iter().for_each(|side| *side = (*side + by_s).max(0.0));
    }
    let next = with_edges(hypothesis, fit, data)?;
    (next.objective() < fit.objective()).then_some(next)
}

/// A fit with other edges; `None` where no span or nothing between two is left.
fn with_edges(hypothesis: Hypothesis, fit: &Fit, data: &Data) -> Option<Fit> {
    let least_s = 2.0 * data.recordings.first()?.sample_time_s;
    let is_apart = |spans: &[(f64, f64)]| spans.windows(2).all(|pair| matches!(pair, [a, b] if a.1 < b.0));
    let lasts = |spans: &[(f64, f64)]| spans.iter().all(|(from, to)| to - from >= least_s);
    let all = || hypothesis.model.physics.iter().map(|term| &term.spans[..]);
    if !all().all(|spans| is_apart(spans) && lasts(spans)) {
        return None;
    }
    Fit::at(&hypothesis, &fit.point, data)
}

/// An edge of a span.
struct Edge {
    term: usize,
    span: usize,
    is_end: bool,
}

impl Edge {
    fn all_of(hypothesis: &Hypothesis) -> Vec<Self> {
        let terms = hypothesis.model.physics.iter().enumerate();
        let spans = terms.flat_map(|(term, of)| (0..of.spans.len()).map(move |span| (term, span)));
        spans.flat_map(|(term, span)| [false, true].map(|is_end| Self { term, span, is_end })).collect()
    }

    fn side<'a>(&self, hypothesis: &'a mut Hypothesis) -> Option<&'a mut f64> {
        let span = hypothesis.model.physics.get_mut(self.term)?.spans.get_mut(self.span)?;
        Some(if self.is_end { &mut span.1 } else { &mut span.0 })
    }

    /// The fit with this edge at a time.
    fn at(&self, fit: &Fit, at_s: f64, data: &Data) -> Option<Fit> {
        let mut hypothesis = fit.hypothesis.clone();
        *self.side(&mut hypothesis)? = at_s;
        with_edges(hypothesis, fit, data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recording of 100 s: a load that begins at 17 s and stays is none that comes and goes; one that ends as well, or two that begin, are.
    #[test]
    fn what_begins_once_does_not_come_and_go() {
        let on =
            |spans: &[(f64, f64)]| Term::new("injected_signal", &[("level", 1.0)]).unwrap().within(spans);
        let does = |terms: &[Term]| comes_and_goes(terms, 100.0);
        assert!(!does(&[]));
        assert!(
            !does(&[on(&[(17.0, 100.0)])]) && !does(&[on(&[(0.0, 17.0)])]) && !does(&[on(&[(0.0, 100.0)])])
        );
        assert!(does(&[on(&[(17.0, 40.0)])]) && does(&[on(&[(0.0, 17.0), (40.0, 100.0)])]));
        assert!(does(&[on(&[(17.0, 100.0)]), on(&[(40.0, 100.0)])]));
    }

    /// Four jumps, one of which was found again three samples later.
    #[test]
    fn a_jump_that_was_found_again_counts_once() {
        let jumps = [(900, -2.0), (903, -1.9), (500, 2.1), (1_400, 1.8), (2_000, -2.2)];
        assert_eq!(in_order(&jumps), [(500, 2.1), (900, -2.0), (1_400, 1.8), (2_000, -2.2)]);
    }

    /// A recording of 100 s, of which a fit sees 70 usually: as long as it sees the signal begin and end, else until between its end and what follows; all of it where that is
    /// nearly all.
    #[test]
    fn a_fit_sees_the_signal_begin_and_end() {
        let on =
            |spans: &[(f64, f64)]| [Term::new("injected_signal", &[("level", 1.0)]).unwrap().within(spans)];
        let seen = |spans: &[(f64, f64)]| seen_part(&on(spans), 100.0, 0.7);
        assert_eq!(seen(&[(10.0, 30.0), (75.0, 90.0)]), 0.7);
        assert_eq!(seen(&[(20.0, 72.0), (76.0, 90.0)]), 0.74);
        assert_eq!(seen(&[(20.0, 95.0)]), 1.0);
        assert_eq!(seen(&[(75.0, 80.0), (85.0, 90.0)]), 0.825);
        assert_eq!(seen(&[(0.0, 30.0), (60.0, 90.0)]), 0.7);
    }
}
