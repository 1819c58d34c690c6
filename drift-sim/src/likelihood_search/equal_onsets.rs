//! Onsets that a recording does not tell apart: where nothing moves when a term begins, it may as well have begun some time before or after. Elsewhere, where
//! something moves then, they foretell different things.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;

use super::rivals::begins_at_once;

/// Rise of the objective up to which an onset counts as likely as the found one: the numbers beside it, which were fitted for that one, would make up for it (two onsets of a loss of gain
/// in an arm at rest that are as likely when they are fitted differ by 60 when they are not).
const RISE: f64 = 80.0;
/// Onsets that are taken, at most.
const MOST: f64 = 300.0;
/// Halvings in which the first and the last of them are found, and doublings of their distance that may be less likely one after the other: between two onsets that are as likely
/// one may lie that is not, where noise moved something then.
const HALVINGS: usize = 6;
const LESS_LIKELY: usize = 4;

/// The fit with each of the other onsets of its terms that are as likely.
pub fn of(fit: &Fit, data: &Data) -> Vec<Fit> {
    let terms = fit.hypothesis.candidates().iter().enumerate();
    let beginning = terms.filter(|(_, term)| term.spans.is_empty() && begins_at_once(term.kind));
    beginning.flat_map(|(candidate, _)| of_term(fit, candidate, data)).collect()
}

fn of_term(fit: &Fit, candidate: usize, data: &Data) -> Vec<Fit> {
    let ts = fit.hypothesis.model.sample_time_s;
    let Some(onset_s) = fit.point.onsets.get(candidate).copied() else { return Vec::new() };
    let moved = |by_s: f64| {
        let mut point = fit.point.clone();
        *point.onsets.get_mut(candidate)? += by_s;
        fit.hypothesis.may_begin(candidate, onset_s + by_s).then_some(())?;
        let moved = Fit::at(&fit.hypothesis, &point, data)?;
        (moved.objective() < fit.objective() + RISE).then_some(moved)
    };
    let reach_s = |side: f64| {
        let (mut near, mut far, mut next, mut less_likely) = (0.0, ts, ts, 0);
        while less_likely < LESS_LIKELY {
            if moved(side * next).is_some() {
                (near, far, less_likely) = (next, 2.0 * next, 0);
            } else {
                less_likely += 1;
            }
            next *= 2.0;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            if moved(side * middle).is_some() { near = middle } else { far = middle }
        }
        near
    };
    let (earliest, latest) = (-reach_s(-1.0), reach_s(1.0));
    let step = ((latest - earliest) / MOST).max(ts);
    let onsets = (0..=(2.0 * MOST) as usize).map(|i| earliest + step * i as f64);
    let onsets: Vec<f64> =
        onsets.take_while(|by_s| *by_s <= latest).filter(|by_s| by_s.abs() > 0.5 * ts).collect();
    onsets.into_par_iter().filter_map(moved).collect()
}
