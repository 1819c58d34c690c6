//! Starts on a grid, and of what acts in proportion to its parameter.

use crate::physics::{Kind, Start};

use super::{Base, Begin, neutral, wider};

/// Size of a trial of what acts in proportion, in the parameter's own scale.
const TRIAL: f64 = 0.02;

/// Each of the points, by one simulation.
pub fn points(base: &Base<'_>, kind: &'static Kind, starts: &[Start]) -> Option<Vec<Begin>> {
    let hypothesis = wider(base, kind, starts.first()?.parameters.clone());
    let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let begins = starts.iter().filter_map(|start| {
        let point = hypothesis.started(&from, start, 0.0);
        let score = base.score(&hypothesis, &point)?;
        Some(Begin { score, hypothesis: hypothesis.clone(), point, onset_s: 0.0 })
    });
    Some(begins.collect())
}

/// The size that one small trial tells.
pub fn proportional(base: &Base<'_>, kind: &'static Kind) -> Option<Vec<Begin>> {
    let hypothesis = wider(base, kind, neutral(kind));
    let mut point = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let place = *hypothesis.places_of(hypothesis.candidates().len() - 1).first()?;
    let (x, score) = base.proportional(&base.response(&hypothesis, &point, place, TRIAL)?);
    let free = hypothesis.free.get(place)?;
    *point.x.get_mut(place)? = x.clamp(free.low, free.high);
    Some(vec![Begin { score, hypothesis, point, onset_s: 0.0 }])
}
