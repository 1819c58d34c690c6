//! What a plan says.

use super::quantity::{percent, plain, with_unit};
use super::{Answer, KeyNumber, Status};
use crate::estimate::signals::range;
use crate::plan::Plan;

/// Beyond this no chance is said: the model of the noise is no surer.
const SUREST_PCT: f64 = 99.9;
/// Nor below this one.
const LEAST_PCT: f64 = 0.01;

/// A chance in per cent.
pub fn chance(part: f64) -> String {
    percent((100.0 * part).clamp(LEAST_PCT, SUREST_PCT))
}

/// The answer.
pub fn planning(plan: &Plan) -> Answer {
    let units = plan.request.stated.unit_names();
    let (low, high) = range(&plan.r);
    let length = with_unit(plain(plan.duration_s(), 4), "s");
    let not_told = plan.not_told();
    let what = format!(
        "{} for {length}, r between {} and {}",
        plan.shape.name(),
        plain(low, 3),
        with_unit(plain(high, 3), &units.y)
    );
    let (status, sentence) = if plan.tells_nothing() {
        (
            Status::CantTell,
            format!("No reference within these limits tells apart what is left; the best of them is {what}."),
        )
    } else if !not_told.is_empty() {
        (Status::InPart, format!("Some of what is left is told apart by {what}."))
    } else if plan.chance() < plan.request.chance {
        let chance = chance(plan.chance());
        (Status::InPart, format!("What is left may be told apart by {what}, with a chance of {chance}."))
    } else {
        (Status::ToldApart, format!("What is left is told apart by {what}."))
    };
    let mut also = Vec::new();
    if plan.tells_nothing() {
        let left: Vec<String> = plan.separation.named.iter().map(|(place, _)| plan.name(*place)).collect();
        if left.len() > 1 {
            also.push(format!("They would answer too much alike: {}.", left.join(", ")));
        }
    } else if !not_told.is_empty() {
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
        "chance that the cause is named, whichever of those it is",
    )];
    let worst = plan.separation.pairs.iter().min_by(|a, b| a.chance.total_cmp(&b.chance));
    if let Some(worst) = worst {
        numbers.push(KeyNumber::new(
            chance(worst.chance),
            format!(
                "chance of the hardest pair: that {} is not taken for {}",
                plan.name(worst.truth),
                plan.name(worst.rival)
            ),
        ));
    }
    numbers.push(KeyNumber::new(length, format!("of {}", plan.shape.name())));
    Answer { status, sentence, also: also.join(" "), numbers }
}
