//! Forecasts for a peak that is as narrow as a needle: what an actuator makes of u at thousands of points about a fit, each judged by how the innovations answer to
//! an impulse of what leaves it, which costs a hundredth of a run of the filter. The best of them are run.

use rayon::prelude::*;
use realfft::num_complex::Complex;

use crate::control_loop::Loop;
use crate::estimate::fit::Fit;
use crate::estimate::inner_product::dot;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::physics::{Start, Starts, Term};
use crate::simulate::actuated;

use super::super::climb::{Steps, climb};
use super::spectrum::Spectrum;
use super::{Base, Begin, neutral, onset, orthonormal};

/// Samples of the first recording that the forecast sees.
const SEEN: usize = 6_000;
/// Points that are run, how far apart they are as logarithms of their parameters, steps of a climb from each before it is run, and their reach.
const RUN: usize = 16;
const APART: f64 = 0.03;
const STEPS: usize = 60;
const REACH: f64 = 0.004;
/// Size of the step that tells how the innovations answer, as part of u's range.
const STEP: f64 = 0.01;

/// The best points about a fit, whose last candidate is the term; none for kinds without fine points.
pub fn about(base: &Base<'_>) -> Option<Vec<Begin>> {
    let hypothesis = &base.fit.hypothesis;
    let Starts::Peak { fine, .. } = hypothesis.candidates().last()?.kind.search else { return None };
    let forecast = Forecast::new(base)?;
    let mut judged: Vec<(f64, Vec<f64>)> = fine(&forecast.term.parameters)
        .into_par_iter()
        .filter_map(|parameters| Some((forecast.squares(&parameters)?, parameters)))
        .collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0));
    let climbed = apart(judged).into_par_iter().enumerate().map(|(i, (squares, parameters))| {
        let steps = Steps { count: STEPS, reach: REACH, seed: i as u64 };
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

/// The best of points, none of them near another.
fn apart(judged: Vec<(f64, Vec<f64>)>) -> Vec<(f64, Vec<f64>)> {
    let mut kept: Vec<(f64, Vec<f64>)> = Vec::new();
    for (squares, parameters) in judged {
        let is_near = |of: &[f64]| of.iter().zip(&parameters).all(|(a, b)| libm::log(a / b).abs() < APART);
        if !kept.iter().any(|(_, of)| is_near(of)) {
            kept.push((squares, parameters));
        }
        if kept.len() == RUN {
            break;
        }
    }
    kept
}

/// How the innovations of the first recording change with what leaves the actuator.
struct Forecast {
    term: Term,
    model: Loop,
    u: Vec<f64>,
    /// What leaves it at the fit, and the innovations there.
    left: Vec<f64>,
    z: Vec<f64>,
    /// What the fit's other numbers can take up.
    directions: Vec<Vec<f64>>,
    /// The innovations' answer to a unit impulse, as a spectrum.
    answer: Vec<Complex<f64>>,
    spectrum: Spectrum,
}

impl Forecast {
    fn new(base: &Base<'_>) -> Option<Self> {
        let hypothesis = &base.fit.hypothesis;
        let model = hypothesis.realise(&base.fit.point)?.model;
        let term = model.physics.last()?.clone();
        let recording: &Signals = base.data.recordings.first()?;
        let n = SEEN.min(*base.data.fitted.first()?).min(recording.len());
        let u = recording.u.get(..n)?.to_vec();
        let spread = hypothesis.scales.u_range;
        let left = actuated(&model, &u);
        let own = hypothesis.places_of(hypothesis.candidates().len() - 1);
        let others =
            base.tangent.moving.iter().zip(base.tangent.columns()).filter(|(place, _)| !own.contains(place));
        let directions = orthonormal(others.filter_map(|(_, column)| column.get(..n)));
        // The same loop with an actuator that passes everything, driven by what left the other.
        let passing = Start::of(neutral(term.kind));
        let point = hypothesis.started(&base.fit.point, &passing, 0.0);
        let innovations = |u: Vec<f64>| {
            let recording = Signals { u, ..recording.part(0, n) };
            let data = Data::new(hypothesis, vec![recording], vec![n]);
            Some(Fit::at(hypothesis, &point, &data)?.rows.z)
        };
        let middle = n / 2;
        let stepped = left.iter().enumerate().map(|(k, x)| if k < middle { *x } else { x + STEP * spread });
        let (z, moved) = (innovations(left.clone())?, innovations(stepped.collect())?);
        let step: Vec<f64> =
            moved.iter().zip(&z).skip(middle).map(|(a, b)| (a - b) / (STEP * spread)).collect();
        let spectrum = Spectrum::convolving(n);
        let answer = spectrum.of(&onset::impulse_of(&step))?;
        Some(Self { term, model, u, left, z, directions, answer, spectrum })
    }

    /// How the innovations answer to other parameters.
    fn answer_to(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let mut model = self.model.clone();
        model.physics.last_mut()?.parameters = parameters.to_vec();
        let now = actuated(&model, &self.u);
        let change: Vec<f64> = now.iter().zip(&self.left).map(|(a, b)| a - b).collect();
        let mut product = self.spectrum.of(&change)?;
        product.iter_mut().zip(&self.answer).for_each(|(x, h)| *x *= h);
        let mut answer = self.spectrum.signal(product)?;
        answer.truncate(self.u.len());
        Some(answer)
    }

    /// The squares that are left at other parameters.
    fn squares(&self, parameters: &[f64]) -> Option<f64> {
        let mut z = self.answer_to(parameters)?;
        z.iter_mut().zip(&self.z).for_each(|(z, at_fit)| *z += at_fit);
        let taken: f64 =
            self.directions.iter().map(|direction| dot(direction, &z)).map(|along| along * along).sum();
        Some(dot(&z, &z) - taken)
    }
}
