//! A load that is there from the start of a recording, beside what is named. Every fit has one free, with a prior that it is small. Where the plant has an offset it
//! belongs there; where a stated plant has none, it is a load that the loop file lacks, and is named like any other term: where it pays for its number and gains on
//! what nothing has seen.

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Hypothesis, Target};
use crate::estimate::likelihood::Data;
use crate::physics::Kind;
use crate::plant::Role;

use super::decide::{cost_of_numbers, independent_share};
use super::one_way;
use super::prove::gained;
use super::search::Choice;

/// The kind that it is named as.
pub const KIND: &str = "load_step";
/// What does the same to y where the plant keeps its level.
const ALIKE: &str = "sensor_bias";
/// Steps of the fit without it.
const REFIT_STEPS: usize = 10;

/// What speaks for the load that stays of a fit; `None` where the plant has an offset for it, where it gains less than `least` or nothing for sure on the unseen
/// samples, or where dry friction is the same on a way that leads only forth.
pub fn judged(best: &Fit, data: &Data, least: f64) -> Option<Choice> {
    let hypothesis = &best.hypothesis;
    let place = hypothesis.place(Target::ConstantLoad).filter(|_| !has_offset(hypothesis))?;
    if one_way::hides_a_load(best, data) {
        return None;
    }
    let mut point = best.point.clone();
    *point.x.get_mut(place)? = 0.0;
    let mut without = Fit::at(hypothesis, &point, data)?;
    without.descend(data, REFIT_STEPS, &[place]);
    // What the data say: that it is unlikely before they are seen is another matter.
    let share = independent_share(best);
    let risen = without.objective() - best.objective() + prior_row(best);
    let gain = 0.5 * share * risen - cost_of_numbers(1.0, share * best.rows.count as f64);
    if gain < least {
        return None;
    }
    let unseen = gained(best, &without, data).filter(|unseen| unseen.is_sure())?;
    let is_alike = hypothesis.model.plant.keeps_its_level();
    let tied = Kind::named(ALIKE).ok().filter(|_| is_alike).map(|kind| kind.name);
    Some(Choice { tied: tied.into_iter().collect(), gain, unseen: Some(unseen), among: 0 })
}

/// What the prior of the load that stays adds to a fit's objective.
pub fn prior_row(fit: &Fit) -> f64 {
    let hypothesis = &fit.hypothesis;
    let row = hypothesis.place(Target::ConstantLoad).and_then(|i| hypothesis.prior_rows(&fit.point).nth(i));
    row.map_or(0.0, |row| row * row)
}

/// Whether the load that stays is a number of the plant, or the level of one of which nothing is stated.
fn has_offset(hypothesis: &Hypothesis) -> bool {
    hypothesis.level.is_some() || hypothesis.numbers.iter().any(|number| number.role == Role::Offset)
}
