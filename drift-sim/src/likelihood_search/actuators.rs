//! What an actuator makes of u needs no plant to be computed: a valve that sticks, say, under a plant that is unknown. Each kind of actuator is judged by how
//! well a regression of y on what leaves the actuator foretells the next sample; a plant is then identified behind the likeliest of them. From u itself
//! it would be another plant, one that answers late and little.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::control_loop::Loop;
use crate::estimate::signals::{Signals, held};
use crate::physics::{KINDS, Kind, Place, Scales, Term};
use crate::simulate::actuated;

use super::climb::{Steps, climb};

/// Samples of all recordings that are enough to tell actuators apart.
const ENOUGH: usize = 8_000;
/// Past values of y and of what leaves the actuator in the regression.
const PAST_Y: usize = 3;
const PAST_U: usize = 12;
/// Sample times of the regression, in the recording's: a search in coarse ones finds where to begin in its own.
const EVERY: [usize; 2] = [4, 1];
/// Points that a search goes on from, its steps from each, and their reach.
const SEARCHED: usize = 8;
const STEPS: usize = 60;
const REACH: f64 = 0.15;
/// Log-likelihood by which a point must foretell y better than u itself for a search to begin there.
const WORTH: f64 = 3.0;
/// Log-likelihood by which an actuator must foretell y better than none: its numbers are the best of hundreds.
const LEAST_GAIN: f64 = 15.0;
/// Actuators that go on.
const KEPT: usize = 2;

/// The likeliest actuators of unlike kinds, the best first; none where u itself does as well.
pub fn likeliest(model: &Loop, recordings: &[Signals], scales: &Scales) -> Vec<Term> {
    let most = ENOUGH / recordings.len().max(1);
    let recordings: Vec<Signals> = recordings.iter().map(|signals| signals.part(0, most)).collect();
    let kinds: Vec<&'static Kind> = KINDS
        .iter()
        .copied()
        .filter(|kind| kind.place == Place::Actuator && kind.search.points(scales).is_some())
        .collect();
    let bare = Loop { physics: Vec::new(), ..model.clone() };
    let judges: Option<Vec<Judge>> =
        EVERY.iter().map(|every| Judge::new(&bare, &recordings, *every)).collect();
    let Some(judges) = judges else { return Vec::new() };
    let mut found: Vec<Actuated> =
        kinds.into_par_iter().filter_map(|kind| best_of(kind, scales, &judges)).collect();
    found.retain(|actuated| actuated.gain > LEAST_GAIN);
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    found.into_iter().take(KEPT).map(|actuated| actuated.term).collect()
}

/// The best of a kind: from its own grid on, by each judge in turn.
fn best_of(kind: &'static Kind, scales: &Scales, judges: &[Judge]) -> Option<Actuated> {
    let points = kind.search.points(scales)?;
    let mut starts: Vec<Vec<f64>> = points.into_iter().map(|start| start.parameters).collect();
    let mut best = None;
    for judge in judges {
        let mut judged: Vec<Actuated> =
            starts.into_par_iter().filter_map(|parameters| judge.judged(kind, parameters)).collect();
        judged.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        judged.truncate(SEARCHED);
        judged.retain(|actuated| actuated.gain > WORTH);
        let mut ended: Vec<Actuated> =
            judged.into_par_iter().enumerate().map(|(i, from)| judge.search(from, i as u64)).collect();
        ended.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        starts = ended.iter().take(2).map(|actuated| actuated.term.parameters.clone()).collect();
        best = ended.into_iter().next();
    }
    best
}

/// An actuator that foretells y.
struct Actuated {
    term: Term,
    /// Log-likelihood that it gains in the regression.
    gain: f64,
}

/// What actuators are judged by.
struct Judge {
    bare: Loop,
    of_each: Vec<Regression>,
}

impl Judge {
    fn new(bare: &Loop, recordings: &[Signals], every: usize) -> Option<Self> {
        let of_each: Option<Vec<Regression>> =
            recordings.iter().map(|recording| Regression::new(recording, every)).collect();
        of_each.map(|of_each| Self { bare: bare.clone(), of_each })
    }

    fn judged(&self, kind: &'static Kind, parameters: Vec<f64>) -> Option<Actuated> {
        let term = Term { kind, parameters, onset_s: 0.0, spans: Vec::new() };
        term.check().ok()?;
        let at_work = self.bare.clone().with(term.clone());
        let gains = self.of_each.iter().map(|regression| regression.gain(&actuated(&at_work, &regression.u)));
        let gain = gains.sum::<Option<f64>>()?;
        gain.is_finite().then_some(Actuated { term, gain })
    }

    fn search(&self, from: Actuated, seed: u64) -> Actuated {
        let kind = from.term.kind;
        let worth = |parameters: &[f64]| Some(self.judged(kind, parameters.to_vec())?.gain);
        let (parameters, gain) = climb(
            kind,
            (from.term.parameters.clone(), from.gain),
            Steps { count: STEPS, reach: REACH, seed },
            worth,
        );
        Actuated { term: Term { parameters, ..from.term }, gain }
    }
}

/// The regression of a recording's y on its past and on the past of what drives the plant.
struct Regression {
    y: Vec<f64>,
    u: Vec<f64>,
    every: usize,
    /// Mean square of what u itself does not foretell.
    without: f64,
}

impl Regression {
    fn new(recording: &Signals, every: usize) -> Option<Self> {
        let y = held(&recording.y).into_iter().step_by(every).collect();
        let mut regression = Self { y, u: recording.u.clone(), every, without: f64::NAN };
        regression.without = regression.error(&recording.u)?;
        Some(regression)
    }

    /// Log-likelihood that this drive gains over u itself.
    fn gain(&self, driving: &[f64]) -> Option<f64> {
        Some(0.5 * self.y.len() as f64 * libm::log(self.without / self.error(driving)?))
    }

    /// Mean square of what it does not foretell.
    fn error(&self, driving: &[f64]) -> Option<f64> {
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let driving: Vec<f64> = driving.chunks(self.every).map(mean).collect();
        let n = PAST_Y + PAST_U + 1;
        let first = PAST_Y.max(PAST_U);
        let (mut products, mut with_y) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        let (mut square, mut count) = (0.0, 0.0);
        let (y0, u0) = (*self.y.first()?, *driving.first()?);
        let mut row = vec![0.0; n];
        for k in first..self.y.len() {
            for (past, x) in row.iter_mut().enumerate() {
                *x = match past {
                    p if p < PAST_Y => self.y[k - 1 - p] - y0,
                    p if p < PAST_Y + PAST_U => driving[k - 1 - (p - PAST_Y)] - u0,
                    _ => 1.0,
                };
            }
            let y = self.y[k] - y0;
            square += y * y;
            count += 1.0;
            for (i, a) in row.iter().enumerate() {
                with_y[i] += a * y;
                for (j, b) in row.iter().enumerate().take(i + 1) {
                    products[(i, j)] += a * b;
                }
            }
        }
        products.fill_upper_triangle_with_lower_triangle();
        // A past that does not move at all adds nothing.
        let regular = 1e-12 * products.diagonal().amax();
        (0..n).for_each(|i| products[(i, i)] += regular);
        let solved = products.cholesky()?.solve(&with_y);
        let error = (square - solved.dot(&with_y)) / count;
        (error > 0.0).then_some(error)
    }
}
