//! A fit without some of its candidates, the others refitted.

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::{Begun, Point, Target};
use crate::estimate::likelihood::Data;

/// Steps of the fit without one of them.
const REFIT_STEPS: usize = 10;

/// A fit without one of its candidates, the others refitted.
pub fn without(fit: &Fit, index: usize, data: &Data) -> Option<Fit> {
    let mut hypothesis = fit.hypothesis.clone();
    let gone = hypothesis.stated + index;
    if gone >= hypothesis.model.physics.len() {
        return None;
    }
    hypothesis.model.physics.remove(gone);
    let kept =
        |target: Target| !matches!(target, Target::Term { term, .. } | Target::Onset(term) if term == gone);
    let x: Vec<f64> = fit
        .hypothesis
        .free
        .iter()
        .zip(&fit.point.x)
        .filter(|(free, _)| kept(free.target))
        .map(|(_, x)| *x)
        .collect();
    hypothesis.free.retain(|free| kept(free.target));
    for free in &mut hypothesis.free {
        free.target = earlier(free.target, gone);
    }
    let mut onsets = fit.point.onsets.clone();
    onsets.remove(index);
    let kept = fit.point.begun.iter().filter(|begun| begun.term != gone);
    let begun = kept.map(|begun| Begun { term: one_less(begun.term, gone), ..*begun }).collect();
    let mut without = Fit::at(&hypothesis, &Point { x, onsets, begun }, data)?;
    without.descend(data, REFIT_STEPS, &[]);
    Some(without)
}

/// A fit without any of its candidates.
pub fn without_all(fit: &Fit, data: &Data) -> Option<Fit> {
    without_others(fit, None, data)
}

/// A fit without any of its candidates but this one.
pub fn without_others(fit: &Fit, kept: Option<usize>, data: &Data) -> Option<Fit> {
    let mut others = (0..fit.hypothesis.candidates().len()).rev().filter(|index| Some(*index) != kept);
    others.try_fold(fit.clone(), |fit, index| without(&fit, index, data))
}

/// A number's target once a term before it is gone.
fn earlier(target: Target, gone: usize) -> Target {
    match target {
        Target::Term { term, parameter } => Target::Term { term: one_less(term, gone), parameter },
        Target::Onset(term) => Target::Onset(one_less(term, gone)),
        other => other,
    }
}

/// A term's index once one before it is gone.
fn one_less(term: usize, gone: usize) -> usize {
    if term > gone { term - 1 } else { term }
}
