//! Starts on a grid.

use crate::estimate::hypothesis::{Hypothesis, Point};
use crate::physics::{Kind, Start};

use super::super::climb::{Steps, climb_together};
use super::{Base, Begin, wider};

/// Points of a grid from which a narrow peak is climbed, steps of each, and their reach.
const CLIMBED: usize = 8;
const STEPS: usize = 20;
const REACH: f64 = 0.15;
/// What the best point of a grid must promise for a climb. Of 126 climbs from less, on generated loops, four came to 10 or more (up to 159), and none where
/// a valve sticks or plays.
const WORTH_A_CLIMB: f64 = 10.0;

/// Logarithm of a gain from which a start is tried with it as well.
const OTHER_GAIN: f64 = 0.2;

/// Each of the points, by one simulation; where an actuator passes less of u there, also with a plant that makes up for it.
pub fn points(base: &Base<'_>, kind: &'static Kind, starts: &[Start]) -> Option<Vec<Begin>> {
    let hypothesis = wider(base, kind, starts.first()?.parameters.clone());
    let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
    let before = actuated(base, &base.fit.hypothesis, &base.fit.point);
    let made_up = starts.iter().filter_map(|start| {
        let after = actuated(base, &hypothesis, &hypothesis.started(&from, start, 0.0));
        let gain = -libm::log(slope(before.as_ref()?, after.as_ref()?));
        (gain > OTHER_GAIN && gain.is_finite()).then(|| Start { gain: start.gain + gain, ..start.clone() })
    });
    let made_up: Vec<Start> = made_up.collect();
    let points: Vec<Point> =
        starts.iter().chain(&made_up).map(|start| hypothesis.started(&from, start, 0.0)).collect();
    let scored = base.scores(&hypothesis, &points).into_iter().zip(points);
    let begins = scored.filter_map(|(score, point)| {
        Some(Begin { score: score?, hypothesis: hypothesis.clone(), point, onset_s: 0.0 })
    });
    Some(begins.collect())
}

/// The best of the points.
pub fn highest(base: &Base<'_>, kind: &'static Kind, starts: &[Start]) -> Option<Vec<Begin>> {
    let mut begins = points(base, kind, starts)?;
    begins.sort_by(|a, b| b.score.total_cmp(&a.score));
    begins.truncate(CLIMBED);
    Some(begins)
}

/// The same, of one form with their parameters, the best first: each at the end of a climb where one promises something.
pub fn peaks(base: &Base<'_>, kind: &'static Kind, begun: Vec<(Vec<f64>, Begin)>) -> Option<Vec<Begin>> {
    let (parameters, begins): (Vec<Vec<f64>>, Vec<Begin>) = begun.into_iter().unzip();
    if begins.first()?.score < WORTH_A_CLIMB {
        return Some(begins);
    }
    let hypothesis = begins.first()?.hypothesis.clone();
    let from = parameters.into_iter().zip(begins.iter().map(|begin| begin.score)).collect();
    // A climb moves the kind's own numbers alone: the plant's stay as they are in its start.
    let points = |moved: &[Vec<f64>]| -> Vec<Point> {
        let moved = begins.iter().zip(moved);
        moved.map(|(begin, own)| hypothesis.started(&begin.point, &Start::of(own.clone()), 0.0)).collect()
    };
    let steps = Steps { count: STEPS, reach: REACH, seed: 0 };
    let ends = climb_together(kind, from, steps, |moved| base.scores(&hypothesis, &points(moved)));
    let own: Vec<Vec<f64>> = ends.iter().map(|(own, _)| own.clone()).collect();
    let ended = points(&own).into_iter().zip(ends);
    let ended =
        ended.map(|(point, (_, score))| Begin { score, hypothesis: hypothesis.clone(), point, onset_s: 0.0 });
    Some(ended.collect())
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
