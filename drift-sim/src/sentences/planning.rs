//! What a plan says.

use super::quantity::{percent, plain, with_unit};
use super::{Answer, KeyNumber};
use crate::estimate::signals::range;
use crate::plan::Plan;

/// Beyond this no chance is said: the model of the noise is no surer.
const SUREST_PCT: f64 = 99.9;

/// A chance in per cent.
pub fn chance(part: f64) -> String {
    percent((100.0 * part).min(SUREST_PCT))
}

/// The answer.
pub fn planning(plan: &Plan) -> Answer {
    let units = plan.request.stated.unit_names();
    let (low, high) = range(&plan.r);
    let length = with_unit(plain(plan.duration_s(), 4), "s");
    let what = plan.shape.name();
    let not_told = plan.not_told();
    let range_of = format!("r between {} and {}", plain(low, 4), with_unit(plain(high, 4), &units.y));
    let all = plan.separation.pairs.iter().all(|pair| pair.chance < 0.5);
    let sentence = if all {
        "No reference within these limits tells apart what is left.".to_owned()
    } else {
        let told = if !not_told.is_empty() {
            "Some of what is left is told apart"
        } else if plan.chance() < plan.request.chance {
            "What is left may be told apart"
        } else {
            "What is left is told apart"
        };
        let chance = match plan.chance() {
            sure if sure >= plan.request.chance => String::new(),
            unsure => format!(", with a chance of {}", chance(unsure)),
        };
        format!("{told} by {what} for {length}, {range_of}{chance}.")
    };
    let mut also = Vec::new();
    if !not_told.is_empty() && !all {
        let names: Vec<String> = not_told
            .iter()
            .take(3)
            .map(|(a, b)| format!("{} from {}", plan.name(*a), plan.name(*b)))
            .collect();
        also.push(format!("It does not tell {}.", names.join(", nor ")));
    }
    if plan.is_continued() {
        also.push(format!(
            "Something began within the recording: the log that is diagnosed next must begin {} before the experiment, without a gap.",
            with_unit(plain(plan.before_s, 4), "s")
        ));
    }
    let mut numbers = vec![KeyNumber::new(
        chance(plan.chance()),
        "least chance that the cause is named, whichever of those it is",
    )];
    let worst = plan.separation.pairs.iter().min_by(|a, b| a.chance.total_cmp(&b.chance));
    if let Some(worst) = worst {
        numbers.push(KeyNumber::new(
            chance(worst.chance),
            format!("the hardest pair: {}, taken for {}", plan.name(worst.truth), plan.name(worst.rival)),
        ));
    }
    numbers.push(KeyNumber::new(length, format!("of {}", plan.shape.name())));
    Answer { status: None, sentence, also: also.join(" "), numbers }
}
