//! The identification alone: the plants that a search would start from, for [`crate::init`].

use crate::control_loop::Loop;
use crate::diagnose::Refitted;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::signals::Signals;
use crate::plant::Role;

use super::options::Options;
use super::plants::{self, Identified};
use super::{interval, offset};

/// A plant that was identified.
pub struct IdentifiedPlant {
    /// The loop with it; a load that stays is its offset, or a load from the start.
    pub model: Loop,
    /// Its numbers with the half widths of their 95 % intervals; `nominal` is where the last fit began.
    pub numbers: Vec<Refitted>,
    /// Log-likelihood by which it is behind the first, after the cost of its numbers; negative where it is likelier and has more numbers.
    pub likelihood_lost: f64,
}

/// The likeliest plant of each structure that is not far behind, from the first `fitted` samples; empty where none can be simulated. The first is the one with
/// the fewest numbers of those that can't be told from the likeliest; the likeliest of the others follow.
pub fn plants_of(open: &Loop, recording: &Signals, fitted: usize, options: &Options) -> Vec<IdentifiedPlant> {
    let of = std::slice::from_ref(recording);
    let found = plants::likeliest(open, (of, &[fitted]), &[], plants::direction(of), options);
    let mut found: Vec<Identified> = found.into_iter().filter_map(Identified::refined).collect();
    let objective = |plant: &Identified| plant.nominal.objective() + plant.cost();
    let likeliest = found.iter().map(objective).fold(f64::INFINITY, f64::min);
    let is_as_likely = |plant: &&Identified| objective(plant) < likeliest + 2.0 * options.margin;
    let count = |plant: &Identified| plant.nominal.hypothesis.free.len();
    let fewest = found.iter().filter(is_as_likely).map(count).min().unwrap_or(0);
    found.sort_by(|a, b| {
        let is_behind = |plant: &Identified| !is_as_likely(&plant) || count(plant) > fewest;
        is_behind(a).cmp(&is_behind(b)).then(objective(a).total_cmp(&objective(b)))
    });
    let first = found.first().map_or(0.0, objective);
    found
        .iter()
        .filter_map(|plant| {
            let realised = plant.nominal.hypothesis.realise(&plant.nominal.point)?;
            Some(IdentifiedPlant {
                model: super::conclude::as_file(&realised.model, realised.constant_load),
                numbers: numbers(&plant.nominal, &interval::half_widths(&plant.nominal, &plant.data)),
                likelihood_lost: 0.5 * (objective(plant) - first),
            })
        })
        .collect()
}

/// The plant's numbers of a fit, those of its own terms and the load that stays, which an offset takes in where the plant has one; with where they came from and their
/// half widths, which are given for all numbers of the fit.
pub(super) fn numbers(fit: &Fit, widths: &[f64]) -> Vec<Refitted> {
    let offset = fit.hypothesis.numbers.iter().find(|number| number.role == Role::Offset);
    let realised = fit.hypothesis.realise(&fit.point);
    let load = realised.as_ref().map_or(0.0, |realised| realised.constant_load);
    let under = |load: f64| offset::under(&realised.as_ref()?.model, load);
    let rows = fit.hypothesis.free.iter().zip(&fit.point.x).zip(widths);
    rows.filter_map(|((free, x), &half_width)| {
        let value = if free.target == Target::ConstantLoad { load } else { free.value(*x) };
        let (name, nominal, value, half_width) = match (free.target, offset) {
            (Target::ConstantLoad, Some(offset)) => {
                let (value, farther) = (under(value)?, under(value + half_width));
                let half_width = farther.map_or(f64::INFINITY, |farther| (farther - value).abs());
                (format!("plant.{}", offset.name), offset.value, value, half_width)
            }
            (Target::Plant(_) | Target::InputGain(_) | Target::ConstantLoad, _) => {
                (free.name.clone(), free.from, value, half_width)
            }
            // A term that an unknown plant has of its own.
            (Target::Term { term, .. }, _) if term < fit.hypothesis.stated => {
                (free.name.clone(), free.from, value, half_width)
            }
            _ => return None,
        };
        Some(Refitted { name, nominal, value, half_width })
    })
    .collect()
}
