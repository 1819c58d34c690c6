//! Starts on a grid, and of what acts in proportion to its parameter.

use crate::estimate::hypothesis::{Hypothesis, Point};
use crate::physics::{Kind, Start};

use super::super::climb::{Steps, climb};
use super::forecast::Forecast;
use super::{Base, Begin, neutral, wider};

/// Size of a trial of what acts in proportion, in the parameter's own scale.
const TRIAL: f64 = 0.02;

/// Samples of the first recording by which a narrow peak is looked for.
const FORECAST: usize = 8_000;
/// Points of a grid from which it is climbed, steps of each, and their reach.
const CLIMBED: usize = 6;
const STEPS: usize = 40;
const REACH: f64 = 0.15;

/// Logarithm of a gain from which a start is tried with it as well.
const OTHER_GAIN: f64 = 0.2;

/// Each of the points, by one simulation; where an actuator passes less of u there, also with a plant that makes up for it.
pub fn points(base: &Base<'_>, kind: &'static Kind, starts: &[Start]) -> Option<Vec<Begin>> {
    let hypothesis = wider(base, kind, starts.first()?.parameters.clone());
    let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let starts = with_made_up(base, &hypothesis, &from, starts);
    let points = starts.iter().map(|start| hypothesis.started(&from, start, 0.0));
    Some(simulated(base, &hypothesis, points.collect()))
}

/// The starts, and those once more with a plant that makes up for what an actuator does not pass.
fn with_made_up(base: &Base<'_>, hypothesis: &Hypothesis, from: &Point, starts: &[Start]) -> Vec<Start> {
    let before = actuated(base, &base.fit.hypothesis, &base.fit.point);
    let made_up = starts.iter().filter_map(|start| {
        let after = actuated(base, hypothesis, &hypothesis.started(from, start, 0.0));
        let gain = -libm::log(slope(before.as_ref()?, after.as_ref()?));
        (gain > OTHER_GAIN && gain.is_finite()).then(|| Start { gain: start.gain + gain, ..start.clone() })
    });
    let made_up: Vec<Start> = made_up.collect();
    starts.iter().cloned().chain(made_up).collect()
}

/// What points are worth by simulation.
fn simulated(base: &Base<'_>, hypothesis: &Hypothesis, points: Vec<Point>) -> Vec<Begin> {
    let scored = base.scores(hypothesis, &points).into_iter().zip(points);
    let begins = scored.filter_map(|(score, point)| {
        Some(Begin { score: score?, hypothesis: hypothesis.clone(), point, onset_s: 0.0 })
    });
    begins.collect()
}

/// The best of the points, each at the end of a climb: both are judged by forecasts, and what the climbs end at by simulation.
pub fn peaks(base: &Base<'_>, kind: &'static Kind, starts: &[Start]) -> Option<Vec<Begin>> {
    let hypothesis = wider(base, kind, neutral(kind));
    let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let forecast = Forecast::new(base, (&hypothesis, &from), FORECAST)?;
    let squares = |start: &Start, own: &[f64]| Some(-forecast.squares_under(own, start.gain)?);
    let starts = with_made_up(base, &hypothesis, &from, starts);
    let judged = starts.iter().filter_map(|start| Some((squares(start, &start.parameters)?, start)));
    let mut judged: Vec<(f64, &Start)> = judged.collect();
    judged.sort_by(|a, b| b.0.total_cmp(&a.0));
    judged.truncate(CLIMBED);
    let ended = judged.into_iter().zip(0..).map(|((worth, start), seed)| {
        let steps = Steps { count: STEPS, reach: REACH, seed };
        // A climb moves the kind's own numbers alone: the plant's stay as they are in its start.
        let (own, _) = climb(kind, (start.parameters.clone(), worth), steps, |own| squares(start, own));
        hypothesis.started(&from, &Start { parameters: own, ..start.clone() }, 0.0)
    });
    Some(simulated(base, &hypothesis, ended.collect()))
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

/// What leaves the actuator's terms in the first recording.
fn actuated(base: &Base<'_>, hypothesis: &Hypothesis, point: &Point) -> Option<Vec<f64>> {
    let realised = hypothesis.realise(point)?;
    Some(crate::simulate::actuated(&realised.model, &base.data.recordings.first()?.u))
}

/// The slope of one signal over another.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len().max(1) as f64;
    let (of_x, of_y) = (mean(x), mean(y));
    let sum = |a: &[f64], of_a: f64| -> f64 { a.iter().zip(x).map(|(a, x)| (a - of_a) * (x - of_x)).sum() };
    sum(y, of_y) / sum(x, of_x)
}
