//! The identification alone: the plants that a search would start from, for [`crate::init`].

use crate::control_loop::Loop;
use crate::diagnose::Refitted;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::signals::Signals;
use crate::plant::Role;

use super::interval;
use super::options::Options;
use super::plants;

/// A plant that was identified.
pub struct IdentifiedPlant {
    /// The loop with it; a load that stays is its offset, or a load from the start.
    pub model: Loop,
    /// Its numbers with the half widths of their 95 % intervals; `nominal` is where the last fit began.
    pub numbers: Vec<Refitted>,
    /// Log-likelihood by which it is behind the likeliest, after the cost of its numbers; 0 for that one.
    pub likelihood_lost: f64,
}

/// The likeliest plant of each structure that is not far behind, the likeliest first, from the first `fitted` samples; empty where none can be simulated.
pub fn plants_of(open: &Loop, recording: &Signals, fitted: usize, options: &Options) -> Vec<IdentifiedPlant> {
    let found = plants::likeliest(open, std::slice::from_ref(recording), &[fitted], &[], options);
    let least = found.first().map_or(0.0, |best| best.nominal.objective() + best.cost());
    found
        .iter()
        .filter_map(|plant| {
            let realised = plant.nominal.hypothesis.realise(&plant.nominal.point)?;
            Some(IdentifiedPlant {
                model: super::conclude::as_file(&realised.model, realised.constant_load),
                numbers: numbers(&plant.nominal, &interval::half_widths(&plant.nominal, &plant.data)),
                likelihood_lost: 0.5 * (plant.nominal.objective() + plant.cost() - least),
            })
        })
        .collect()
}

/// The plant's numbers of a fit and the load that stays, which an offset takes in where the plant has one; with where they came from and their
/// half widths, which are given for all numbers of the fit.
pub(super) fn numbers(fit: &Fit, widths: &[f64]) -> Vec<Refitted> {
    let offset = fit.hypothesis.numbers.iter().find(|number| number.role == Role::Offset);
    let rows = fit.hypothesis.free.iter().zip(&fit.point.x).zip(widths);
    rows.filter_map(|((free, x), &half_width)| {
        let value = free.value(*x);
        let (name, nominal, value) = match (free.target, offset) {
            (Target::ConstantLoad, Some(offset)) => {
                (format!("plant.{}", offset.name), offset.value, offset.value - value)
            }
            (Target::Plant(_) | Target::ConstantLoad, _) => (free.name.clone(), free.from, value),
            _ => return None,
        };
        Some(Refitted { name, nominal, value, half_width })
    })
    .collect()
}
