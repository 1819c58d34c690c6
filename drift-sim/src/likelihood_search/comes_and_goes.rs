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
use super::search::without;
use super::two_levels::{TwoLevels, two_levels};
use super::{Case, Searched, law, plants, spans};

/// Samples in which steps are looked for.
const ENOUGH: usize = 5_000;
/// Steps of the fit of their sizes.
const STEPS: usize = 12;
/// Steps by which edges are moved, in samples.
const EDGE_STEPS: [f64; 4] = [8.0, 4.0, 2.0, 1.0];

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
        let Searched { parts, healthy, model } = Searched::of(&parts, case.healthy, &model, factor);
        let plants = plants::likeliest(&model, &parts.recordings, &parts.fitted, &healthy, case.options);
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

/// What comes and goes beside a base, its edges where the recording is likeliest; none where nothing does, or nothing that pays for its times.
fn found_beside(base: &Fit, data: &Data, least: f64) -> Vec<Term> {
    let whole = &data.whole();
    let ways = [by_steps(base, data), by_levels(base, data)].into_iter().flatten();
    let fits = ways.filter_map(|terms| {
        let fit = with_edges_moved(fitted(base, &terms, whole)?, whole);
        judged(settled(fit, whole), base, whole, least)
    });
    let best = fits.min_by(|a, b| a.objective().total_cmp(&b.objective()));
    let realised = best.and_then(|fit| fit.hypothesis.realise(&fit.point));
    let mut physics = realised.map(|realised| realised.model.physics).unwrap_or_default();
    physics.split_off(base.hypothesis.model.physics.len().min(physics.len()))
}

/// A fit with these, those that pay; `None` where none does.
pub fn beside(base: &Fit, terms: &[Term], data: &Data, least: f64) -> Option<Fit> {
    judged(settled(fitted(base, terms, data)?, data), base, data, least)
}

/// Whether some of these act where nothing is fitted alone: their sizes are then of the whole recording.
pub fn are_beyond(terms: &[Term], until_s: f64) -> bool {
    terms.iter().any(|term| term.spans.iter().all(|(from, _)| *from >= until_s))
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
    let hypothesis: Hypothesis =
        terms.iter().cloned().fold(base.hypothesis.clone(), |wider, term| wider.with(term));
    let from = |point: &Point| {
        let mut fit = Fit::at(&hypothesis, &hypothesis.widen(&base.hypothesis, point), data)?;
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

/// The edges of all spans where the recording is likeliest.
fn with_edges_moved(mut fit: Fit, data: &Data) -> Fit {
    let ts = data.recordings.first().map_or(0.0, |signals| signals.sample_time_s);
    let edges: Vec<Edge> = Edge::all_of(&fit.hypothesis);
    for by in EDGE_STEPS {
        for edge in &edges {
            let ways = [-by * ts, by * ts].into_par_iter();
            let ways = ways.filter_map(|by_s| Some((by_s, edge.moved(&fit, by_s, data)?)));
            let better = ways.min_by(|a, b| a.1.objective().total_cmp(&b.1.objective()));
            let Some((by_s, better)) = better else { continue };
            fit = better;
            while let Some(better) = edge.moved(&fit, by_s, data) {
                fit = better;
            }
        }
    }
    fit
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

    /// The fit with this edge moved, if that is likelier. An edge that the recording does not reach has nothing to be judged by.
    fn moved(&self, fit: &Fit, by_s: f64, data: &Data) -> Option<Fit> {
        let signals = data.recordings.first()?;
        let mut hypothesis = fit.hypothesis.clone();
        let spans = &mut hypothesis.model.physics.get_mut(self.term)?.spans;
        let span = spans.get_mut(self.span)?;
        let side = if self.is_end { &mut span.1 } else { &mut span.0 };
        if *side >= signals.duration_s() {
            return None;
        }
        *side = (*side + by_s).max(0.0);
        let apart = spans.windows(2).all(|pair| matches!(pair, [a, b] if a.1 < b.0));
        if !apart || spans.iter().any(|(from, to)| to - from < 2.0 * signals.sample_time_s) {
            return None;
        }
        let next = Fit::at(&hypothesis, &fit.point, data)?;
        (next.objective() < fit.objective()).then_some(next)
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
}
