//! Forecasts for a peak that is as narrow as a needle: what an actuator makes of u at thousands of points about a fit, each judged by how the innovations answer to
//! an impulse of what leaves it, which costs a hundredth of a run of the filter. The best of them are run.

use crate::cores::AcrossCores as _;
use realfft::num_complex::Complex;

use crate::control_loop::Loop;
use crate::estimate::fit::Fit;
use crate::estimate::inner_product::dot;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::physics::{Start, Term};
use crate::simulate::actuated;

use super::super::apart::apart;
use super::super::climb::{Steps, climb};
use super::spectrum::Spectrum;
use super::{Base, Begin, neutral, onset, orthonormal};

/// Steps of a climb from each point that is run.
const STEPS: usize = 60;
/// Size of the step that tells how the innovations answer, as part of u's range.
const STEP: f64 = 0.01;
/// Part of the squares of the innovations' answer that may be cut off.
const NOTHING: f64 = 1e-6;

/// How much is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Look {
    /// Samples of the first recording that are forecast: those in which u moves most.
    pub seen: usize,
    /// So many of them tell which part of the points is looked at over all of them.
    pub first_seen: usize,
    /// Points that are run.
    pub run: usize,
    /// How far apart they are, as logarithms of their parameters.
    pub apart: f64,
    /// Reach of the climb to each.
    pub reach: f64,
}

/// One over that part.
const KEPT: usize = 8;

/// The best of points of the last candidate's parameters about a fit.
pub fn about(base: &Base<'_>, mut points: Vec<Vec<f64>>, look: Look) -> Option<Vec<Begin>> {
    let hypothesis = &base.fit.hypothesis;
    if look.first_seen < look.seen {
        let judged = Forecast::new(base, look.first_seen)?.judged(points);
        let kept = judged.len() / KEPT;
        points = judged.into_iter().take(kept).map(|(_, parameters)| parameters).collect();
    }
    let forecast = Forecast::new(base, look.seen)?;
    let judged = forecast.judged(points);
    let judged = apart(judged, look.run, |(_, a), (_, b)| are_near(a, b, look.apart));
    let climbed = judged.into_par_iter().enumerate().map(|(i, (squares, parameters))| {
        let steps = Steps { count: STEPS, reach: look.reach, seed: i as u64 };
        let worth = |parameters: &[f64]| Some(-forecast.squares(parameters)?);
        climb(forecast.term.kind, (parameters, -squares), steps, worth).0
    });
    let begins = climbed.collect::<Vec<_>>().into_iter().filter_map(|parameters| {
        let point = hypothesis.started(&base.fit.point, &Start::of(parameters), 0.0);
        let score = base.score(hypothesis, &point)?;
        Some(Begin { score, hypothesis: hypothesis.clone(), point, onset_s: 0.0 })
    });
    Some(begins.collect())
}

/// Whether two points' numbers differ by less than a part of themselves.
fn are_near(a: &[f64], b: &[f64], part: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| a == b || libm::log(a / b).abs() < part)
}

/// How the innovations of the first recording change with what leaves the actuator; spectra, whose sums of squares are the signals' own.
struct Forecast {
    term: Term,
    model: Loop,
    /// u, from `before` samples before the first that is forecast: what leaves the actuator follows from what came before.
    u: Vec<f64>,
    before: usize,
    /// What leaves it at the fit, and the innovations there.
    left: Vec<f64>,
    z: Vec<Complex<f64>>,
    /// What the fit's other numbers can take up: real and imaginary parts in turn.
    directions: Vec<Vec<f64>>,
    /// The innovations' answer to a unit impulse.
    answer: Vec<Complex<f64>>,
    spectrum: Spectrum,
}

impl Forecast {
    fn new(base: &Base<'_>, seen: usize) -> Option<Self> {
        let hypothesis = &base.fit.hypothesis;
        let model = hypothesis.realise(&base.fit.point)?.model;
        let term = model.physics.last()?.clone();
        let recording: &Signals = base.data.recordings.first()?;
        let fitted = recording.part(0, *base.data.fitted.first()?);
        let stretch = fitted.liveliest(seen);
        let (start, end, n) = (stretch.start, stretch.end, stretch.len());
        let before = start.min(seen);
        let u = fitted.u.get(start - before..end)?.to_vec();
        let spread = hypothesis.scales.u_range;
        let left = actuated(&model, fitted.u.get(..end)?);
        let own = hypothesis.places_of(hypothesis.candidates().len() - 1);
        let others =
            base.tangent.moving.iter().zip(base.tangent.columns()).filter(|(place, _)| !own.contains(place));
        let directions = orthonormal(others.filter_map(|(_, column)| column.get(stretch.clone())));
        // The same loop with an actuator that passes everything, driven by what left the other.
        let passing = Start::of(neutral(term.kind));
        let point = hypothesis.started(&base.fit.point, &passing, 0.0);
        let innovations = |u: Vec<f64>| {
            let recording = Signals { u, ..fitted.part(0, end) };
            let data =
                Data::new(hypothesis, vec![recording], vec![end]).colored(base.data.coloring().clone());
            Some(Fit::at(hypothesis, &point, &data)?.rows.z.get(stretch.clone())?.to_vec())
        };
        let middle = n / 2;
        let stepped =
            left.iter().enumerate().map(|(k, x)| if k < start + middle { *x } else { x + STEP * spread });
        let (z, moved) = (innovations(left.clone())?, innovations(stepped.collect())?);
        let left = left.get(start..)?.to_vec();
        let step: Vec<f64> =
            moved.iter().zip(&z).skip(middle).map(|(a, b)| (a - b) / (STEP * spread)).collect();
        let answer = ended(onset::impulse_of(&step));
        let spectrum = Spectrum::holding(n + answer.len());
        let scaled = |x: &[f64]| -> Option<Vec<Complex<f64>>> {
            let mut values = spectrum.of(x)?;
            let scaled = values.iter_mut().enumerate();
            scaled.for_each(|(place, value)| *value *= libm::sqrt(spectrum.weight(place)));
            Some(values)
        };
        let (z, directions) = (scaled(&z)?, directions.iter().map(|direction| scaled(direction)));
        let directions = directions.map(|values| Some(parts(&values?))).collect::<Option<_>>()?;
        let answer = scaled(&answer)?;
        Some(Self { term, model, u, before, left, z, directions, answer, spectrum })
    }

    /// Points with the squares that are left at each, the fewest first.
    fn judged(&self, points: Vec<Vec<f64>>) -> Vec<(f64, Vec<f64>)> {
        let each = points.into_par_iter();
        let judged = each.filter_map(|parameters| Some((self.squares(&parameters)?, parameters)));
        let mut judged: Vec<(f64, Vec<f64>)> = judged.collect();
        judged.sort_by(|a, b| a.0.total_cmp(&b.0));
        judged
    }

    /// The squares that are left at other parameters. The answer goes on beyond the last sample, where no innovation is known: a constant to
    /// speak of.
    fn squares(&self, parameters: &[f64]) -> Option<f64> {
        let mut model = self.model.clone();
        model.physics.last_mut()?.parameters = parameters.to_vec();
        let mut change = actuated(&model, &self.u).split_off(self.before.min(self.u.len()));
        change.iter_mut().zip(&self.left).for_each(|(now, at_fit)| *now -= at_fit);
        let mut z = self.spectrum.of(&change)?;
        z.iter_mut().zip(&self.answer).zip(&self.z).for_each(|((x, h), at_fit)| *x = *x * h + at_fit);
        let z = parts(&z);
        let taken: f64 =
            self.directions.iter().map(|direction| dot(direction, &z)).map(|along| along * along).sum();
        Some(dot(&z, &z) - taken)
    }
}

/// An answer up to where what follows of it is nothing to speak of.
fn ended(mut answer: Vec<f64>) -> Vec<f64> {
    let all = dot(&answer, &answer);
    let mut later = 0.0;
    let last = answer.iter().rposition(|x| {
        later += x * x;
        later > NOTHING * all
    });
    answer.truncate(last.map_or(1, |last| last + 1));
    answer
}

/// Real and imaginary parts in turn.
fn parts(values: &[Complex<f64>]) -> Vec<f64> {
    let mut parts = Vec::with_capacity(2 * values.len());
    values.iter().for_each(|value| parts.extend([value.re, value.im]));
    parts
}
