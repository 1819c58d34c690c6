//! The plants that a search starts from: the stated one; or, where it is unknown, the likeliest of each structure, from a grid of its time
//! constants. Which of them it is, is decided jointly with the physics: a structure that lost may win with a term. Healthy recordings are part of
//! the same likelihood: what is looked for is not in them.

use crate::cores::AcrossCores as _;

use crate::control_loop::Loop;
use crate::estimate::first_look::{coarseness, coarser, fewer};
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Hypothesis, is_noise};
use crate::estimate::likelihood::Data;
use crate::estimate::measure;
use crate::estimate::signals::Signals;
use crate::physics::{Kind, Term};
use crate::plant::{Plant, StateSpace, TransferFunction};
use crate::simulate::actuated;

use super::actuators;
use super::begun;
use super::equation_error;
use super::nominal;
use super::options::Options;
use super::units;
use super::wave_in_u;
use structures::{HAS_ZERO, STRUCTURES, SWINGS, in_units_of_drive, is_level, structures};

/// A plant with its nominal fit, on the recordings as they are used.
pub struct Identified {
    /// The nominal fit.
    pub nominal: Fit,
    /// The data of the search.
    pub data: Data,
    /// Whether the plant came from the recordings.
    pub is_guessed: bool,
}

impl Identified {
    /// The nominal fit of a hypothesis on the first look at data.
    fn looked_at(hypothesis: &Hypothesis, data: Data, is_guessed: bool, options: &Options) -> Option<Self> {
        let data = data.with_first_look(hypothesis, options.enough_samples);
        let look = data.look();
        Some(Self { nominal: nominal::fit(&hypothesis.sampled_as(look), look)?, data, is_guessed })
    }

    /// The same, fitted to all samples; as it is where it has seen them.
    pub fn refined(self) -> Option<Self> {
        if !self.data.has_first_look() {
            return Some(self);
        }
        let mut nominal = self.nominal.on(&self.data)?;
        nominal.descend(&self.data, MORE_STEPS, &[]);
        Some(Self { nominal, ..self })
    }

    /// What the plant costs, on the scale of the objective: its numbers by Schwarz's criterion. Stated ones cost nothing.
    pub fn cost(&self) -> f64 {
        if self.is_guessed { cost(&self.nominal) } else { 0.0 }
    }
}

/// An offset is the load that stays, which is free beside every plant; the time by which y is late stands for a dead time.
fn cost(fit: &Fit) -> f64 {
    let numbers = fit.hypothesis.free.iter().filter(|free| !is_noise(free.target)).count();
    numbers as f64 * libm::log(fit.rows.count.max(2) as f64)
}

/// Structures that are kept as rivals, and by how much of the objective, for each sample, they may be behind the best one before a term is tried: a
/// motor's dry friction costs a tenth of its error, say.
const KEPT: usize = 3;
const BEHIND: f64 = 0.1;
/// Steps of a fit from each, and more of the best of each structure.
const STEPS: usize = 4;
const MORE_STEPS: usize = 15;
/// Samples that are enough to tell which time constant to begin with, and the coarsest of them, in samples of the recording.
const ENOUGH: usize = 5_000;
const COARSEST: usize = 6;
/// Prior deviation of the logarithm of a number that was not stated.
const GUESSED_LOG: f64 = 1.5;
/// Prior deviation of the constant load, as part of the drive's deviation: u's zero is anywhere.
const GUESSED_LOAD: f64 = 10.0;

/// The stated plant's fit; or those of the likeliest plants, the best first. Empty where none can be simulated.
pub fn likeliest(
    model: &Loop,
    (recordings, fitted): (&[Signals], &[usize]),
    healthy: &[Signals],
    direction: f64,
    options: &Options,
) -> Vec<Identified> {
    let mut all = recordings.to_vec();
    all.extend_from_slice(healthy);
    let mut seen = fitted.to_vec();
    seen.extend(healthy.iter().map(Signals::len));
    let with = |model: &Loop, options: &Options, is_guessed: bool| {
        let hypothesis = super::hypothesis(model, &all, options);
        let data = Data::new(&hypothesis, all.clone(), seen.clone()).with_healthy(recordings.len());
        Identified::looked_at(&hypothesis, data, is_guessed, options)
    };
    if model.plant != Plant::Identify {
        return with(model, options, false).into_iter().collect();
    }
    let options = guessing(options);
    // The structure is that of the healthy recordings, where there are any.
    let (of, until) = if healthy.is_empty() {
        (recordings, fitted.to_vec())
    } else {
        (healthy, healthy.iter().map(Signals::len).collect())
    };
    let options = &options;
    let identification = Identification { model, beside: None, of, until: &until, direction, options };
    let mut found: Vec<Identified> = identification
        .of_each_structure()
        .iter()
        .filter_map(|(found, _)| with(found, options, true))
        .collect();
    found.sort_by(|a, b| (a.nominal.objective() + a.cost()).total_cmp(&(b.nominal.objective() + b.cost())));
    found
}

/// What a guessed plant's numbers are held to.
pub(crate) fn guessing(options: &Options) -> Options {
    let mut options = options.clone();
    options.priors.plant_log = GUESSED_LOG;
    options.priors.constant_load = GUESSED_LOAD;
    options.priors.is_guessed = true;
    options
}

/// A plant, and fits beside it that were found before the search.
pub struct Candidate {
    /// The plant.
    pub plant: Identified,
    /// The fits, of what short fits see, each with its kind.
    pub offered: Vec<(&'static Kind, Fit)>,
}

/// The plants with a fit of each of the likeliest actuators beside them; an open plant is identified behind each of these anew, and beside a wave that u pays for.
pub fn with_actuators(
    plants: Vec<Identified>,
    model: &Loop,
    recordings: &[Signals],
    fitted: &[usize],
    (is_open, options): (bool, &Options),
) -> Vec<Candidate> {
    let scales = measure::scales(model, recordings);
    // Of a hold-out too little counts for a regression.
    let seen = recordings.iter().zip(fitted).filter(|(signals, fitted)| 2 * **fitted >= signals.len());
    let seen: Vec<Signals> = seen.map(|(signals, fitted)| signals.part(0, *fitted)).collect();
    let terms = actuators::likeliest(model, &seen, &scales);
    let in_each = terms.iter().map(|term| actuators::in_each(term, model, recordings, fitted));
    let in_each: Vec<Vec<Term>> = in_each.collect();
    if is_open {
        let behind = in_each.iter().filter_map(|each| behind(each, model, recordings, fitted, options));
        let behind: Vec<Candidate> = behind.collect();
        let plain = plants.into_iter().map(|plant| Candidate { plant, offered: Vec::new() });
        let wave = wave_in_u::of(&seen);
        let beside_wave = wave.and_then(|term| beside_leading(&term, model, recordings, fitted, options));
        return plain.chain(behind).chain(beside_wave).collect();
    }
    let with_offers = |plant: Identified| {
        let offered = in_each.iter().filter_map(|each| beside(each.first()?, &plant)).collect();
        Candidate { plant, offered }
    };
    plants.into_iter().map(with_offers).collect()
}

/// The fit of a term beside a plant.
fn beside(term: &Term, plant: &Identified) -> Option<(&'static Kind, Fit)> {
    let wider = plant.nominal.hypothesis.with(term.clone());
    let look = plant.data.look();
    let mut fit = nominal::fit_noise(&wider, look, &wider.places_of(0))?;
    begun::settle(&mut fit, look);
    Some((term.kind, fit))
}

/// An unknown plant behind an actuator, as each recording tells it.
fn behind(
    in_each: &[Term],
    model: &Loop,
    recordings: &[Signals],
    fitted: &[usize],
    options: &Options,
) -> Option<Candidate> {
    let options = guessing(options);
    let moved = |(signals, term): (&Signals, &Term)| {
        let at_work = Loop { physics: vec![term.clone()], ..model.clone() };
        Signals { u: actuated(&at_work, &signals.u), ..signals.clone() }
    };
    let of: Vec<Signals> = recordings.iter().zip(in_each).map(moved).collect();
    let (of, options) = (&of, &options);
    let identification =
        Identification { model, beside: None, of, until: fitted, direction: direction(of), options };
    let (found, _) = identification.of_each_structure().into_iter().next()?;
    let hypothesis = super::hypothesis(&found, recordings, options);
    let data = Data::new(&hypothesis, recordings.to_vec(), fitted.to_vec());
    let plant = Identified::looked_at(&hypothesis, data, true, options)?;
    let offered = vec![beside(in_each.first()?, &plant)?];
    Some(Candidate { plant, offered })
}

/// An unknown plant identified anew beside a term that leads the others beside another plant, or that shows without one: what that plant had taken up of the term's
/// effect goes to the term.
pub fn beside_leading(
    term: &Term,
    model: &Loop,
    recordings: &[Signals],
    fitted: &[usize],
    options: &Options,
) -> Option<Candidate> {
    let options = guessing(options);
    let (of, direction, options) = (recordings, direction(recordings), &options);
    let identification = Identification { model, beside: Some(term), of, until: fitted, direction, options };
    let (found, term) = identification.of_each_structure().into_iter().next()?;
    let hypothesis = super::hypothesis(&found, recordings, options);
    let data = Data::new(&hypothesis, recordings.to_vec(), fitted.to_vec());
    let term = term?;
    let plant = Identified::looked_at(&hypothesis, data, true, options)?;
    let look = plant.data.look();
    let offered = vec![(term.kind, nominal::fit(&hypothesis.with(term).sampled_as(look), look)?)];
    Some(Candidate { plant, offered })
}

/// What an unknown plant is identified from.
struct Identification<'a> {
    /// The loop around it.
    model: &'a Loop,
    /// A term that acts on it, its numbers free.
    beside: Option<&'a Term>,
    /// Recordings, and how much of each counts.
    of: &'a [Signals],
    until: &'a [usize],
    /// Its [`direction`].
    direction: f64,
    options: &'a Options,
}

/// A loop and its recordings in other samples.
struct Samples {
    model: Loop,
    of: Vec<Signals>,
    until: Vec<usize>,
}

impl Identification<'_> {
    /// One sample in so many.
    fn in_coarser_samples(&self, factor: usize) -> Samples {
        let sample_time_s = factor as f64 * self.model.sample_time_s;
        Samples {
            model: Loop { sample_time_s, ..self.model.clone() },
            of: coarser(self.of, factor),
            until: fewer(self.until, factor),
        }
    }

    /// The same from other samples.
    fn on<'a>(&'a self, Samples { model, of, until }: &'a Samples) -> Identification<'a> {
        Identification { model, of, until, ..*self }
    }

    /// The loop with the likeliest plant of each structure, of those that are not far behind, and the term beside it.
    fn of_each_structure(&self) -> Vec<(Loop, Option<Term>)> {
        let samples = self.in_coarser_samples(coarseness(self.until, self.options.enough_samples));
        let look = self.on(&samples);
        let begun = self.begun();
        let objective = |fit: &Fit| fit.objective() + cost(fit);
        // The best start of each structure goes on: ranked too early, a slow fit loses to a plant that is none.
        let mut fits: Vec<(usize, Fit)> = (0..STRUCTURES)
            .into_par_iter()
            .filter_map(|structure| {
                let own = begun.iter().filter(|(of, _)| *of == structure);
                let (_, coarse) = own.min_by(|a, b| objective(&a.1).total_cmp(&objective(&b.1)))?;
                let mut realised = coarse.hypothesis.realise(&coarse.point)?;
                let term = self.beside.and_then(|_| realised.model.physics.pop());
                let found = super::conclude::as_file(&realised.model, realised.constant_load);
                let finer = Identification { beside: term.as_ref(), ..look };
                finer.fitted(found.plant, MORE_STEPS).map(|fit| (structure, fit))
            })
            .filter(|(_, fit)| !drifts(fit))
            .collect();
        fits.sort_by(|(_, a), (_, b)| objective(a).total_cmp(&objective(b)));
        let Some(best) = fits.first().map(|(_, fit)| objective(fit)) else { return Vec::new() };
        let mut kept: Vec<usize> = Vec::new();
        let mut loops = Vec::new();
        for (structure, fit) in &fits {
            let is_near = objective(fit) < best + BEHIND * fit.rows.count as f64;
            if kept.contains(structure) || kept.len() == KEPT || !is_near {
                continue;
            }
            let Some(mut realised) = fit.hypothesis.realise(&fit.point) else { continue };
            kept.push(*structure);
            let term = self.beside.and_then(|_| realised.model.physics.pop());
            let mut found = super::conclude::as_file(&realised.model, realised.constant_load);
            // A load that stays is free in every fit.
            found.physics.truncate(self.model.physics.len());
            found.plant = in_units_of_drive(found.plant);
            let units = units::beside(&found.plant, &found.units);
            let sample_time_s = self.model.sample_time_s;
            loops.push((Loop { sensor: self.model.sensor, units, sample_time_s, ..found }, term));
        }
        loops
    }

    /// Short fits of all structures from all their time constants, with their structures; long recordings in coarser samples.
    fn begun(&self) -> Vec<(usize, Fit)> {
        let longest = self.until.iter().max().copied().unwrap_or(0);
        let factor = (longest / ENOUGH).clamp(1, COARSEST);
        let samples = self.in_coarser_samples(factor);
        let coarser = self.on(&samples);
        let Samples { model, of, .. } = &samples;
        let signs = [1.0, -1.0].into_iter().filter(|sign| self.direction * sign >= 0.0).collect::<Vec<_>>();
        let plants = structures(&measure::scales(model, of), of, &signs).into_iter().enumerate();
        let plants = plants.map(|(i, plant)| (i % STRUCTURES, plant));
        let regressed = equation_error::plants(self.of).into_iter().map(|plant| match plant {
            Plant::StateSpace(_) => (SWINGS, plant),
            _ => (HAS_ZERO, plant),
        });
        let begun = plants.chain(regressed).collect::<Vec<_>>().into_par_iter();
        begun
            .filter(|(_, plant)| units::suit(&model.units, plant))
            .filter(|(_, plant)| !matches!(plant, Plant::Tank(_)) || is_level(of))
            .filter(|(_, plant)| self.beside.is_none_or(|term| (term.kind.applies)(plant)))
            .filter_map(|(structure, plant)| Some((structure, coarser.fitted(plant, STEPS)?)))
            .collect()
    }

    /// A fit from a plant and a random load of middling size.
    fn fitted(&self, plant: Plant, steps: usize) -> Option<Fit> {
        let model = Loop { plant, ..self.model.clone() };
        let plain = super::hypothesis(&model, self.of, self.options);
        let hypothesis = match self.beside {
            Some(term) => plain.with(term.clone()),
            None => plain,
        };
        let data = Data::new(&hypothesis, self.of.to_vec(), self.until.to_vec());
        let point = nominal::with_noise(&hypothesis, &hypothesis.own_point(), -2.0, -1.0 / 100.0, 0.0);
        let mut fit = Fit::at(&hypothesis, &point, &data)?;
        fit.descend(&data, steps, &[]);
        Some(fit)
    }
}

/// Whether a plant with two poles and a zero does not swing, and has a mode slower than the recording: a load that drifts, in the guise of a plant.
fn drifts(fit: &Fit) -> bool {
    let Some(realised) = fit.hypothesis.realise(&fit.point) else { return true };
    let Some((middle, determinant)) = two_poles(&realised.model.plant) else { return false };
    let apart = middle * middle - determinant;
    apart >= 0.0 && (middle + libm::sqrt(apart)) * fit.hypothesis.scales.duration_s > -1.0
}

/// The mean and the product of the two poles of a plant that has a zero, too.
fn two_poles(plant: &Plant) -> Option<(f64, f64)> {
    match plant {
        Plant::StateSpace(StateSpace { a, .. }) => {
            let [first, second] = a.as_slice() else { return None };
            let ([p, q], [r, s]) = (first.as_slice(), second.as_slice()) else { return None };
            Some((0.5 * (p + s), p * s - q * r))
        }
        Plant::TransferFunction(TransferFunction { num, den, .. }) => {
            let ([_, _], [a, b, c]) = (num.as_slice(), den.as_slice()) else { return None };
            Some((-0.5 * b / a, c / a))
        }
        _ => None,
    }
}

/// Part of u's changes that the law's answer to the error, or to its changes, makes at least, for its sign to be known.
const ACTS: f64 = 0.2;

/// The sign of the plant's gain: that of the law's, for it holds the loop; 0 where u does not tell. Noise that the law feeds back looks like a
/// plant of the other sign, and more so in the mean of many samples, in which u has answered to y: the recordings' own samples tell it. Where the plant answers
/// within a sample, the error's changes are its own answer: then what u does about the error itself contradicts them.
pub fn direction(recordings: &[Signals]) -> f64 {
    let mut sums = [0.0; 6];
    for signals in recordings {
        let e: Vec<f64> = signals.r.iter().zip(&signals.y).map(|(r, y)| r - y).collect();
        let known = e.iter().filter(|e| e.is_finite());
        let mean = known.clone().sum::<f64>() / known.count().max(1) as f64;
        for (u, e) in signals.u.windows(2).zip(e.windows(2)) {
            let (u, change, e) = (u[1] - u[0], e[1] - e[0], e[0] - mean);
            if change.is_finite() {
                let products = [u * u, change * change, e * e, u * change, u * e, change * e];
                sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
            }
        }
    }
    let [of_u, of_change, of_e, with_change, with_e, between] = sums;
    let determinant = (of_change * of_e - between * between).max(1e-300);
    let part = |slope: f64, of: f64| slope / determinant * libm::sqrt(of / of_u.max(1e-300));
    let to_change = part(with_change * of_e - with_e * between, of_change);
    let to_error = part(with_e * of_change - with_change * between, of_e);
    let sign = |part: f64| if part.abs() > ACTS { part.signum() } else { 0.0 };
    if sign(to_change) * sign(to_error) < 0.0 { 0.0 } else { sign(to_change) }
}

mod structures;
#[cfg(test)]
mod tests;
