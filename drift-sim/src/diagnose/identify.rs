//! `kind = "identify"`: a linear plant is fitted first, so that an export without any model can be diagnosed.
//!
//! Candidates are a lag, two lags (their poles may become complex), an integrator, and an integrator with a lag, each with a dead time
//! and a constant drive, each with and without a limit at the actuator: a recorded u that was taken before a hidden limit spoils
//! every linear fit, so that plant and limit have to be found together. Starting points come from a grid of lags, dead times and limits
//! ([`LinearShape`]); the best are searched on by output error. What is taken is the simplest that predicts parts of y that no
//! fit has seen, each third in turn, within one standard error of the best (Breiman's rule). The limit is not part of the plant: it is
//! handed on, for the diagnosis to prove. One-step regressions (ARX) were tried: a hidden limit makes them unstable.

use crate::cores::AcrossCores as _;

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::likelihood_search::units;
use crate::physics::Term;
use crate::plant::Plant;
use crate::{Error, Result};

use super::fit::{Effort, Fit, mean_square};
use super::holdout;
use super::linear_shape::LinearShape;
use super::model::Model;
use super::signals::{Signals, deviation, range};
use super::whiten::Whitener;

/// Time constants tried, from two samples to the length of the recording, evenly in their logarithm.
const TIME_CONSTANTS: usize = 14;
/// Second time constants tried, as parts of the first.
const SECOND_LAGS: [f64; 4] = [0.8, 0.3, 0.1, 0.03];
/// Dead times tried, in samples.
const DELAYS: [usize; 14] = [0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233, 377];
/// Longest of them, as a part of the recording.
const LONGEST_DELAY: f64 = 0.04;
/// Longest time constant that a recording can show, in its own lengths.
const SLOWEST: f64 = 10.0;
/// Parts of the recording that are left out in turn.
const PARTS: usize = 3;
/// Contiguous blocks over which predictions are compared.
const BLOCKS: usize = 24;
/// How long to search from an end that is known but for a part of y.
const AGAIN: Effort = Effort { steps: 10, enough: 1e-4 };
/// Part of y's variance that a plant may leave where it has not seen y, else nothing was identified.
const LEFT_OVER: f64 = 0.5;
/// Starting points of each structure that are searched from.
const SEARCHED: usize = 3;
/// Times the least variance from which a structure is not followed.
const HOPELESS: f64 = 30.0;
/// Limits tried on either side, as parts of the way from the middle of u to its end.
const LIMITS: [f64; 8] = [0.05, 0.1, 0.17, 0.25, 0.35, 0.5, 0.65, 0.8];
/// Pairs of limits that are followed beyond a first look.
const LIMITS_FOLLOWED: usize = 2;

/// What was identified.
#[derive(Debug, Clone)]
pub struct Identified {
    /// The loop with the linear plant alone.
    pub nominal: Loop,
    /// What it was found with, and what the diagnosis has to prove: a limit at the actuator, or a motor's friction and play.
    pub with: Vec<Term>,
}

/// Limits of the drive; infinite where there is none.
type Limits = (f64, f64);

const NO_LIMITS: Limits = (f64::NEG_INFINITY, f64::INFINITY);

/// A candidate and what it predicts of y that it has not seen.
#[derive(Clone)]
struct Validated {
    found: Loop,
    numbers: usize,
    blocks: Vec<f64>,
}

/// The loop with a plant fitted to the recording; `None` where its plant is known.
///
/// # Errors
/// No linear plant predicts half of y where it has not seen it.
pub fn plant(model: &Loop, signals: &Signals) -> Result<Option<Identified>> {
    if model.plant != Plant::Identify {
        return Ok(None);
    }
    let mut fits: Vec<Fit> =
        starts(signals).into_par_iter().filter_map(|group| looked(model, &group, signals)).collect();
    let least = fits.iter().map(|fit| fit.variance).fold(f64::INFINITY, f64::min);
    fits.retain(|fit| fit.variance < HOPELESS * least);
    let validated: Vec<Validated> = fits
        .into_par_iter()
        .filter_map(|fit| validate(&fit.search(signals, Effort::FULL), signals))
        .collect();
    let linear = simplest(&validated).cloned();
    // What only a known law's loop can prove is looked for under one alone.
    let motor = (model.controller != Controller::Recorded).then(|| motor::identify(model, signals)).flatten();
    // A temperature is no motor's position or speed.
    let motor = motor.filter(|motor| units::suit(&model.units, &motor.found.plant));
    let rivals: Vec<Validated> = linear.into_iter().chain(motor).collect();
    let chosen = simplest(&rivals).ok_or_else(|| {
        Error::new("no linear plant of up to second order predicts y from the recorded u: nothing can be said on such a plant")
            .allowed("a recording in which u moves y (--healthy takes the plant from others), or a plant in the loop file")
    })?;
    let mut nominal = chosen.found.clone();
    // A motor's constant load stands for the offset of the linear plants: part of the plant, nothing to prove.
    let own = model.physics.len() + usize::from(matches!(nominal.plant, Plant::Servo(_)));
    let with = nominal.physics.split_off(own.min(nominal.physics.len()));
    Ok(Some(Identified { nominal, with }))
}

/// Of the candidates the one with the fewest numbers among those that predict about as well as the best.
fn simplest(validated: &[Validated]) -> Option<&Validated> {
    let sum = |v: &Validated| v.blocks.iter().sum::<f64>();
    let best = validated.iter().max_by(|a, b| sum(a).total_cmp(&sum(b)))?;
    let near = |v: &&Validated| holdout::gain(&best.blocks, &v.blocks).1 <= 1.0;
    let fewest = validated.iter().filter(near).map(|v| v.numbers).min()?;
    validated.iter().filter(near).filter(|v| v.numbers == fewest).max_by(|a, b| sum(a).total_cmp(&sum(b)))
}

/// The best end of short searches from these starts, over the whole recording.
fn looked(model: &Loop, group: &[(Plant, Limits)], signals: &Signals) -> Option<Fit> {
    let ends = group.par_iter().filter_map(|(plant, limits)| {
        let refit = Model::refit(&Loop { plant: plant.clone(), ..model.clone() }, signals);
        let refit = match limit_term(*limits, &signals.u) {
            Some(limit) => refit.with_term(&limit, false, signals.duration_s()),
            None => refit,
        };
        Some(Fit::start(&refit, signals, &Whitener::none())?.search(signals, Effort::LOOK))
    });
    ends.min_by(|a, b| a.variance.total_cmp(&b.variance))
}

/// Predicts each part of y by a fit to the others: the simulation runs through, only y is left out. The start is no number of the
/// plant and stays as the whole recording has it: without the first part nothing would tell it.
fn validate(fit: &Fit, signals: &Signals) -> Option<Validated> {
    let (found, _) = fit.model.loop_at(&fit.model.x)?;
    if matches!(&found.plant, Plant::FirstOrder(p) if p.time_constant_s > SLOWEST * signals.duration_s()) {
        return None;
    }
    let length = signals.len().div_ceil(PARTS);
    let unseen: Vec<f64> = (0..PARTS)
        .into_par_iter()
        .map(|part| {
            let hidden = part * length..((part + 1) * length).min(signals.len());
            let mut others = signals.clone();
            others.y.get_mut(hidden.clone())?.fill(f64::NAN);
            let held = fit.model.start_held();
            let fitted = Fit::start(&held, &others, &Whitener::none())?.search(&others, AGAIN);
            let residual = fitted.model.residual(&fitted.model.x, signals)?;
            Some(residual.get(hidden)?.to_vec())
        })
        .collect::<Option<Vec<_>>>()?
        .concat();
    let spread = deviation(&signals.y);
    (mean_square(&unseen) < LEFT_OVER * spread * spread).then(|| Validated {
        found,
        numbers: fit.model.physical(),
        blocks: unseen.chunks(unseen.len().div_ceil(BLOCKS)).map(likelihood).collect(),
    })
}

/// Log-likelihood of a block, its noise's size being free.
fn likelihood(block: &[f64]) -> f64 {
    -0.5 * block.len() as f64 * libm::log(mean_square(block).max(1e-300))
}

/// The limit as a term; a side without one is put beyond all of u.
fn limit_term((lower, upper): Limits, u: &[f64]) -> Option<Term> {
    let (lowest, highest) = spread(u)?;
    if lower < lowest && upper > highest {
        return None;
    }
    let beyond = highest - lowest;
    let lower = if lower < lowest { lowest - beyond } else { lower };
    let upper = if upper > highest { highest + beyond } else { upper };
    Term::new("saturation", &[("lower", lower), ("upper", upper)]).ok()
}

/// The range of u, where it has one.
fn spread(u: &[f64]) -> Option<(f64, f64)> {
    Some(range(u)).filter(|(lowest, highest)| lowest < highest)
}

/// Starting points: for each structure, without limits and with the most promising ones, the best of a grid.
fn starts(signals: &Signals) -> Vec<Vec<(Plant, Limits)>> {
    let lags = lags(signals);
    let delays: Vec<usize> =
        DELAYS.into_iter().filter(|delay| *delay as f64 <= LONGEST_DELAY * signals.len() as f64).collect();
    let coarse: Vec<LinearShape> = (lags.iter().step_by(2))
        .flat_map(|lag| delays.iter().step_by(2).map(|delay| shape(&[*lag], false, *delay)))
        .collect();
    let mut limits: Vec<(f64, Limits)> = (limit_pairs(&signals.u).into_par_iter())
        .filter_map(|limits| Some((best(&coarse, signals, limits, 1).first()?.0, limits)))
        .collect();
    limits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let followed = limits.into_iter().take(LIMITS_FOLLOWED).map(|(_, limits)| limits);
    let structures = structures(&lags, &delays);
    let tried: Vec<(&Vec<LinearShape>, Limits)> = std::iter::once(NO_LIMITS)
        .chain(followed)
        .flat_map(|limits| structures.iter().map(move |shapes| (shapes, limits)))
        .collect();
    tried
        .into_par_iter()
        .map(|(shapes, limits)| {
            let best = best(shapes, signals, limits, SEARCHED);
            best.into_iter().map(|(_, plant)| (plant, limits)).collect()
        })
        .collect()
}

/// The best shapes under these limits, with what they leave.
fn best(shapes: &[LinearShape], signals: &Signals, limits: Limits, most: usize) -> Vec<(f64, Plant)> {
    let v: Vec<f64> = signals.u.iter().map(|u| u.max(limits.0).min(limits.1)).collect();
    let mut fits: Vec<(f64, Plant)> = shapes
        .par_iter()
        .filter_map(|shape| shape.fit(signals, &v).map(|fit| (fit.variance, fit.plant)))
        .filter(|(variance, _)| variance.is_finite())
        .collect();
    fits.sort_by(|a, b| a.0.total_cmp(&b.0));
    fits.truncate(most);
    fits
}

fn shape(lags_s: &[f64], integrates: bool, delay: usize) -> LinearShape {
    LinearShape { lags_s: lags_s.to_vec(), integrates, delay }
}

fn lags(signals: &Signals) -> Vec<f64> {
    let shortest = 2.0 * signals.sample_time_s;
    let ratio = (signals.duration_s() / shortest).max(1.0);
    (0..TIME_CONSTANTS).map(|i| shortest * libm::pow(ratio, i as f64 / (TIME_CONSTANTS - 1) as f64)).collect()
}

/// All shapes of a lag, of two lags, of an integrator, and of an integrator with a lag.
fn structures(lags: &[f64], delays: &[usize]) -> [Vec<LinearShape>; 4] {
    let with = |lags: &[f64], integrates: bool| -> Vec<LinearShape> {
        delays.iter().map(|delay| shape(lags, integrates, *delay)).collect()
    };
    let one = lags.iter().flat_map(|lag| with(&[*lag], false)).collect();
    let two = lags
        .iter()
        .flat_map(|lag| SECOND_LAGS.into_iter().flat_map(move |part| with(&[*lag, part * lag], false)))
        .collect();
    let lagged = lags.iter().flat_map(|lag| with(&[*lag], true)).collect();
    [one, two, with(&[], true), lagged]
}

/// Pairs of limits within u's range, at least one of them there.
fn limit_pairs(u: &[f64]) -> Vec<Limits> {
    let Some((lowest, highest)) = spread(u) else { return Vec::new() };
    let mut sorted = u.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.5 * (lowest + highest));
    let side = |end: f64, none: f64| -> Vec<f64> {
        LIMITS.iter().map(|part| middle + part * (end - middle)).chain([none]).collect()
    };
    let (lower, upper) = (side(lowest, NO_LIMITS.0), side(highest, NO_LIMITS.1));
    let pairs = lower.iter().flat_map(|low| upper.iter().map(move |high| (*low, *high)));
    pairs.filter(|limits| *limits != NO_LIMITS && limits.0 < limits.1).collect()
}

mod motor;

#[cfg(test)]
mod tests;
