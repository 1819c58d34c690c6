//! Onsets beside each other: what was found first had begun where it explains most of what begins beside it, too.

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;

use super::rivals::begins_at_once;

/// Samples by which an onset is moved to and fro.
const SETTLED: f64 = 12.0;
/// Rounds in which each is moved, at most, and steps of the fit after each round.
const ROUNDS: usize = 5;
const STEPS: usize = 5;

/// Moves the onset of each candidate that begins at once by few samples, the other numbers with it, until that helps no more.
pub fn settle(fit: &mut Fit, data: &Data) {
    let width = SETTLED * fit.hypothesis.model.sample_time_s;
    let candidates = fit.hypothesis.candidates().iter().enumerate();
    let beginning: Vec<usize> = candidates
        .filter(|(_, term)| term.spans.is_empty() && begins_at_once(term.kind))
        .map(|(index, _)| index)
        .collect();
    for _ in 0..ROUNDS {
        let before = fit.point.onsets.clone();
        for index in &beginning {
            let Some(tangent) = fit.tangent(data, &[]) else { return };
            fit.search_onset(data, *index, width, Some(&tangent));
        }
        if fit.point.onsets == before {
            return;
        }
        fit.descend(data, STEPS, &[]);
    }
}
