//! Kinds of more than one family that what was fitted to leaves as likely as each other, told apart by all samples: each is fitted once more, to the unseen ones
//! too, and judged by the same rule. What is named keeps the numbers of the seen samples, and is proved with them.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::physics::Kind;

use super::decide::{Decision, decide, left_of};
use super::options::Options;
use super::rivals::{Field, Rival, stuck};

/// Steps of a fit to all samples.
const STEPS: usize = 12;

/// A decision without the kinds that all samples speak against; an empty one where none pays for its numbers on them.
pub fn decided_again(decision: Decision, field: &Field, data: &Data, options: &Options) -> Decision {
    let Some(whole) = fitted_to_all(&decision.set, field, data) else { return decision };
    let again = decide(&whole, options, f64::NEG_INFINITY, data, |_| None);
    if again.set.is_empty() {
        return Decision { scored: decision.scored, ..Decision::default() };
    }
    let near: Vec<_> = decision
        .scored
        .iter()
        .copied()
        .filter(|s| decision.set.contains(&s.kind) && again.set.contains(&s.kind))
        .collect();
    if near.is_empty() {
        return decision;
    }
    Decision { chosen_among: decision.set.len(), ..left_of(decision.scored, &near) }
}

/// The field of these kinds, fitted to all samples; `None` where one of them can't be.
fn fitted_to_all(kinds: &[&'static Kind], field: &Field, data: &Data) -> Option<Field> {
    let whole = data.whole();
    let again = |fit: &Fit| {
        let mut again = Fit::at(&fit.hypothesis, &fit.point, &whole)?;
        again.descend(&whole, STEPS, &stuck(&fit.hypothesis));
        Some(again)
    };
    let left: Vec<&Rival> = field.rivals.iter().filter(|rival| kinds.contains(&rival.kind)).collect();
    let rivals = left.into_par_iter().map(|rival| Some(Rival { fit: again(&rival.fit)?, ..rival.clone() }));
    let rivals: Vec<Option<Rival>> = rivals.collect();
    let mut whole_field =
        Field { base: again(&field.base)?, rivals: rivals.into_iter().collect::<Option<Vec<Rival>>>()? };
    whole_field.polish(&whole);
    Some(whole_field)
}
