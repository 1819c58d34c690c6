//! How well an experiment tells causes apart: the expected log-likelihood ratio of each pair of closed loops, and the chance that it passes the
//! diagnosis' own bars.
//!
//! The truth A is rehearsed with its noise, the rival B is then refitted to that: its physics, the plant's numbers within what was stated of them,
//! the load and the noise. A rival that takes on the truth's answer by other numbers is no other cause. What is left of the ratio is its
//! expectation D (Kullback and Leibler's), of which the ratio itself is scattered with a variance of 2 D, as for any two hypotheses that differ in
//! their predictions alone: the ratio is `d.e + d.d/2` with white e, and `D = d.d/2`.

use crate::cores::AcrossCores as _;
use statrs::distribution::{ContinuousCDF, Normal};

use super::rehearsal::Stage;
use crate::diagnose::cause::Cause;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Hypothesis, Point, Target};
use crate::estimate::likelihood::Data;
use crate::estimate::measure;
use crate::estimate::signals::Signals;
use crate::likelihood_search::decide::cost_of;
use crate::likelihood_search::nominal::with_noise;
use crate::likelihood_search::options::Options;
use crate::likelihood_search::plants::guessing;
use crate::likelihood_search::prove::gained;
use crate::likelihood_search::rivals::stuck;
use crate::plant::Plant;

/// Steps of a rival's refit, and more once its rough numbers have moved.
const STEPS: usize = 10;
const MORE_STEPS: usize = 3;
/// A rival is far behind from this of the objective on.
const FAR: f64 = 8.0;
/// A load of middling size: the logarithm of it over the drive's, its time constant in samples, and what stays of the sensor's noise (atanh).
const MIDDLING: (f64, f64, f64) = (-3.0, 30.0, 0.5);
/// Variance that refits of a few numbers add to that of the ratio.
const OF_REFITS: f64 = 1.0;
/// Part of the expected ratio that is relied on. A cause that a recording hardly shows looks larger there than it is (Ioannidis 2008, "Why most discovered
/// true associations are inflated"), and a ratio goes with the square of its size.
const RELIED: f64 = 0.5;
/// Half width, in standard errors, of a 95 % interval, and the ratio from which chance is ruled out: the bars of a proof.
const NORMAL_95: f64 = 1.96;
const LEAST_RATIO: f64 = 100.0;

/// A true cause and a rival.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// The place of the truth among the causes.
    pub truth: usize,
    /// The rival's.
    pub rival: usize,
    /// Expected log-likelihood ratio over what the fit sees, the rival refitted.
    pub expected: f64,
    /// The chance that the truth leads by what the diagnosis asks for.
    pub chance: f64,
}

/// What an experiment tells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Separation {
    /// All pairs that count.
    pub pairs: Vec<Pair>,
    /// For each cause that is left, by its place: the chance that the diagnosis names it where it is the one, at least.
    pub named: Vec<(usize, f64)>,
}

impl Separation {
    /// The least of the pairs' chances among those that are asked for.
    pub fn worst(&self, is_asked: impl Fn(&Pair) -> bool) -> f64 {
        self.pairs.iter().filter(|pair| is_asked(pair)).map(|pair| pair.chance).fold(1.0, f64::min)
    }

    /// The mean of the pairs' chances.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.pairs.iter().map(|pair| pair.chance).sum();
        sum / self.pairs.len().max(1) as f64
    }
}

/// The causes, and what they are judged by.
#[derive(Debug, Clone, Copy)]
pub struct Court<'a> {
    /// Where experiments are rehearsed.
    pub stage: Stage<'a>,
    /// The causes.
    pub causes: &'a [Cause],
    /// The diagnosis' own numbers.
    pub options: &'a Options,
    /// Noise is drawn from this.
    pub seed: u64,
}

/// A fit of each cause to one rehearsal; `None` where it can't be simulated beside it.
struct Trial {
    data: Data,
    fits: Vec<Option<Fit>>,
}

impl Court<'_> {
    /// What an experiment tells apart; `None` where a cause's loop diverges in it.
    pub fn separation(&self, r: &[f64]) -> Option<Separation> {
        let truths: Vec<usize> =
            (0..self.causes.len()).filter(|i| self.is_left(*i) && self.term_of(*i).is_some()).collect();
        let mut separation = Separation::default();
        for truth in truths {
            let trials: Vec<Trial> = [false, true]
                .into_iter()
                .map(|opposite| {
                    let truth = self.causes.get(truth)?;
                    self.trial(truth, self.stage.noisy(truth, r, self.seed, opposite)?)
                })
                .collect::<Option<_>>()?;
            let rivals = (0..self.causes.len()).filter(|rival| self.counts(truth, *rival));
            let pairs: Vec<Pair> = rivals.filter_map(|rival| self.pair(truth, rival, &trials)).collect();
            let missed: f64 = pairs.iter().map(|pair| 1.0 - pair.chance).sum();
            separation.named.push((truth, (1.0 - missed).max(0.0)));
            separation.pairs.extend(pairs);
        }
        Some(separation)
    }

    fn is_left(&self, place: usize) -> bool {
        self.causes.get(place).is_some_and(|cause| cause.is_left)
    }

    fn term_of(&self, place: usize) -> Option<&crate::physics::Term> {
        self.causes.get(place)?.term.as_ref()
    }

    /// Whether a diagnosis would have to tell a rival from a truth: of one family the simplest is named, and the others beside it, unless nothing else
    /// is asked.
    fn counts(&self, truth: usize, rival: usize) -> bool {
        let plant = &self.stage.stated.plant;
        let family = |place: usize| self.term_of(place).and_then(|term| term.kind.family_on(plant));
        let is_related = |other: usize| family(truth).is_some() && family(truth) == family(other);
        let kinds = (0..self.causes.len()).filter(|i| self.is_left(*i) && self.term_of(*i).is_some());
        let one_family = kinds.into_iter().all(is_related);
        truth != rival && (one_family && self.is_left(rival) || !is_related(rival))
    }

    /// Each cause at its likeliest on a rehearsal of a truth.
    fn trial(&self, truth: &Cause, signals: Signals) -> Option<Trial> {
        let fitted = (self.options.seen_of_recording * signals.len() as f64) as usize;
        let of_cause = |cause: &Cause, known: f64| {
            let hypothesis = self.hypothesis(cause, &signals);
            let data = Data::new(&hypothesis, vec![signals.clone()], vec![fitted]);
            let best = likeliest(&hypothesis, (cause, truth), &data, known);
            (data, best)
        };
        let (data, of_truth) = of_cause(truth, f64::NEG_INFINITY);
        let known = of_truth.as_ref()?.objective();
        let of_rival = |cause: &Cause| {
            if std::ptr::eq(cause, truth) { of_truth.clone() } else { of_cause(cause, known).1 }
        };
        Some(Trial { data, fits: self.causes.par_iter().map(of_rival).collect() })
    }

    /// What a diagnosis of the experiment would fit of a cause.
    fn hypothesis(&self, cause: &Cause, signals: &Signals) -> Hypothesis {
        let stated = self.stage.stated;
        let is_open = stated.plant == Plant::Identify;
        let priors = if is_open { guessing(self.options).priors } else { self.options.priors.clone() };
        let mut model = cause.model.clone();
        model.controller = stated.controller.clone();
        model.inputs.clear();
        if !is_open {
            model.plant = stated.plant.clone();
        }
        let scales = measure::scales(&model, std::slice::from_ref(signals));
        let nominal = Hypothesis::nominal(&model, &scales, &priors);
        match self.stage.term(cause) {
            Some(term) => nominal.with(term),
            None => nominal,
        }
    }

    fn pair(&self, truth: usize, rival: usize, trials: &[Trial]) -> Option<Pair> {
        let mean = |of: &dyn Fn(&Trial) -> Option<f64>| -> Option<f64> {
            let all = trials.iter().map(of).collect::<Option<Vec<f64>>>()?;
            Some(all.iter().sum::<f64>() / all.len().max(1) as f64)
        };
        let fit = |trial: &Trial, place: usize| trial.fits.get(place).cloned().flatten();
        let ahead = |trial: &Trial| {
            let of_truth = fit(trial, truth)?;
            // What can't be simulated beside the truth is no rival.
            let Some(of_rival) = fit(trial, rival) else { return Some(f64::INFINITY) };
            Some(0.5 * (of_rival.objective() - of_truth.objective()))
        };
        let cost = |trial: &Trial, place: usize| {
            fit(trial, place).map_or(0.0, |fit| match fit.hypothesis.candidates().len() {
                0 => 0.0,
                terms => cost_of(&fit, terms - 1),
            })
        };
        let expected = mean(&ahead)?;
        if expected == f64::INFINITY {
            return Some(Pair { truth, rival, expected, chance: 1.0 });
        }
        let costs = mean(&|trial| Some(cost(trial, truth) - cost(trial, rival)))?;
        let relied = RELIED * expected;
        let chance = if self.term_of(rival).is_some() {
            passes(relied - costs, relied, self.options.margin)
        } else {
            let unseen = mean(&|trial| {
                let (better, worse) = (fit(trial, truth)?, fit(trial, rival)?);
                Some(gained(&better, &worse, &trial.data).map_or(0.0, |gained| gained.sum))
            })?;
            let unseen = RELIED * unseen;
            let proof = passes(unseen, unseen, libm::log(LEAST_RATIO)).max(is_sure(unseen));
            (passes(relied - costs, relied, self.options.least_gain) + proof - 1.0).max(0.0)
        };
        Some(Pair { truth, rival, expected, chance })
    }
}

/// The chance that a ratio of this mean, scattered by what is expected of it, passes a bar.
pub fn passes(mean: f64, expected: f64, bar: f64) -> f64 {
    normal((mean - bar) / libm::sqrt(2.0 * expected.max(0.0) + OF_REFITS))
}

/// The chance that it is further from zero than its own scatter allows.
fn is_sure(expected: f64) -> f64 {
    normal(libm::sqrt(0.5 * expected.max(0.0)) - NORMAL_95)
}

fn normal(z: f64) -> f64 {
    Normal::standard().cdf(z)
}

/// A hypothesis' own term with the plant's numbers, the load and the noise of a cause.
fn shared_point(hypothesis: &Hypothesis, of: &Cause) -> Point {
    let numbers = of.model.plant.numbers();
    let (noise, scales) = (&of.noise, &hypothesis.scales);
    let size = noise.load_sd / noise.sensor_sd * scales.noise / scales.drive;
    let mut point = hypothesis.own_point();
    for (free, x) in hypothesis.free.iter().zip(&mut point.x) {
        *x = match free.target {
            Target::Plant(i) => numbers.get(i).map_or(*x, |number| free.x_of(number.value)),
            Target::LoadSize => free.x_of(libm::log(size.max(1e-300))),
            Target::LoadTau => free.x_of(libm::log(noise.load_tau_s)),
            Target::SensorRho => free.x_of(libm::atanh(noise.sensor_rho)),
            Target::ConstantLoad
            | Target::InputGain(_)
            | Target::Late
            | Target::SensorWhite
            | Target::Term { .. }
            | Target::Onset(_) => *x,
        };
    }
    hypothesis.with_load(point.clone(), of.constant_load).unwrap_or(point)
}

/// A cause on a rehearsal of a truth, from several starts: its own numbers; those that it shares with the truth; and, where it still seems to be far
/// behind what is known, those with a load of middling size, which may take up what a rival lacks.
fn likeliest(
    hypothesis: &Hypothesis,
    (cause, truth): (&Cause, &Cause),
    data: &Data,
    known: f64,
) -> Option<Fit> {
    let from = |point: &Point| Some(refitted(Fit::at(hypothesis, point, data)?, data));
    let own = from(&shared_point(hypothesis, cause));
    let is_far = |fit: &Option<Fit>| fit.as_ref().is_none_or(|fit| fit.objective() > known + FAR);
    if std::ptr::eq(cause, truth) || !is_far(&own) {
        return own;
    }
    // Of another structure no number is shared.
    let is_alike = truth.model.plant.kind() == cause.model.plant.kind();
    let shared = shared_point(hypothesis, if is_alike { truth } else { cause });
    let better = |a: Option<Fit>, b: Option<Fit>| {
        a.into_iter().chain(b).min_by(|a, b| a.objective().total_cmp(&b.objective()))
    };
    let own = better(own, from(&shared));
    if !is_far(&own) {
        return own;
    }
    let (size, tau, rho) = MIDDLING;
    better(own, from(&with_noise(hypothesis, &shared, size, tau, rho)))
}

/// A cause's numbers at their likeliest on a rehearsal.
fn refitted(mut fit: Fit, data: &Data) -> Fit {
    let last = fit.hypothesis.candidates().len().checked_sub(1);
    let own = last.map(|last| fit.hypothesis.places_of(last)).unwrap_or_default();
    let fixed = stuck(&fit.hypothesis);
    fit.descend(data, STEPS, &fixed);
    let is_rough = |i: &usize| fit.hypothesis.free.get(*i).is_some_and(|free| !free.smooth);
    let rough: Vec<usize> = own.into_iter().filter(is_rough).collect();
    if !rough.is_empty()
        && let Some(tangent) = fit.tangent(data, &rough)
    {
        rough.iter().for_each(|place| fit.profile(data, &[*place], &tangent));
        fit.descend(data, MORE_STEPS, &fixed);
    }
    fit
}

#[cfg(test)]
mod tests;
