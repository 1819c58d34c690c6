//! What the recording could have shown: for each kind of physics the smallest size that the search would have accepted.
//!
//! A term of a given size would change y by what its simulation differs from the model's. What refitted numbers of the
//! model could take up of that does not show; the rest, against the noise that is there, is the gain in log-likelihood
//! that the search would have found. Sizes are tried by factors of two. A kind that would not show even at the size of the
//! signals themselves was not excited: of it nothing is known, which is not the same as its absence.

use crate::cores::AcrossCores as _;

use crate::physics::{Begins, KINDS, Kind, Signature, Term};

use super::Rejected;
use super::fit::Fit;
use super::screen::{Bench, is_predicted, scaled};
use super::select::LEAST_GAIN;
use super::signals::Signals;
use super::whiten::effective_samples;

/// Sizes tried, as powers of two of a kind's first guess, which is about a twentieth of the signals.
const SMALLEST: i32 = -6;
const LARGEST: i32 = 5;

/// What a recording tells of a kind that was not found.
#[derive(Debug, Clone)]
pub enum Shows {
    /// A term of this size, or larger, would have been found.
    From(Term),
    /// Not even this one would have been.
    NotEven(Term),
}

/// What the recording would have shown of every kind that can act on the plant and is not in the model. Of kinds that the
/// prediction of y does not show (noise, faults of the law, signals by their spans) nothing is said.
pub fn shows(base: &Fit, signals: &Signals, scales: &Signature) -> Vec<(&'static Kind, Shows)> {
    let Some(bench) = Bench::new(base, signals, base.model.whitens()) else { return Vec::new() };
    let white = base.white();
    let samples = effective_samples(&white);
    let present = |kind: &Kind| base.model.nominal.physics.iter().any(|term| term.kind == kind);
    let asked = |kind: &&&'static Kind| {
        (kind.applies)(&base.model.nominal.plant) && is_predicted(kind) && !present(kind)
    };
    KINDS
        .par_iter()
        .filter(|kind| asked(kind))
        .filter_map(|kind| {
            let cost = 0.5 * kind.parameters.len() as f64 * libm::log(samples.max(2.0));
            let first = first_guess(kind, scales, signals.duration_s())?;
            let found = |power: i32| {
                let term = scaled(&first, libm::pow(2.0, f64::from(power)))?;
                // Of a residual with this part more power the variance would be larger.
                let more = bench.power_of(&term, signals)?;
                Some((0.5 * samples * libm::log(1.0 + more) > LEAST_GAIN + cost, term))
            };
            Some((*kind, smallest(found)?))
        })
        .collect()
}

/// Bisection over the powers; what can't be simulated is too large.
fn smallest(found: impl Fn(i32) -> Option<(bool, Term)>) -> Option<Shows> {
    let (mut low, mut high) = (SMALLEST, LARGEST);
    let mut shown: Option<Term> = None;
    let mut not: Option<Term> = None;
    while low <= high {
        let middle = low + (high - low) / 2;
        match found(middle) {
            Some((false, term)) => {
                not = Some(term);
                low = middle + 1;
            }
            Some((true, term)) => {
                shown = Some(term);
                high = middle - 1;
            }
            None => high = middle - 1,
        }
    }
    shown.map(Shows::From).or(not.map(Shows::NotEven))
}

/// The kind's first guess; what begins later begins in the middle.
fn first_guess(kind: &'static Kind, scales: &Signature, duration_s: f64) -> Option<Term> {
    let parameters = (kind.starts)(scales).into_iter().next()?;
    let onset_s = if kind.begins == Begins::Start { 0.0 } else { 0.5 * duration_s };
    let term = Term { kind, parameters, onset_s, spans: Vec::new() };
    term.check().is_ok().then_some(term)
}

/// Kinds that can't act on this plant, and those that the recording did not excite.
pub fn untestable(base: &Fit, shows: &[(&'static Kind, Shows)]) -> Vec<Rejected> {
    let plant = &base.model.nominal.plant;
    let elsewhere = KINDS.iter().filter(|kind| !(kind.applies)(plant)).map(|kind| Rejected {
        kind: kind.name,
        why: format!("can't act on a {} plant", plant.kind()),
        smallest: None,
    });
    let units = base.model.nominal.unit_names();
    let unexcited = shows.iter().filter_map(|(kind, shows)| match shows {
        Shows::From(_) => None,
        Shows::NotEven(term) => Some(Rejected {
            kind: kind.name,
            why: format!(
                "not even this would show here: {} It takes: {}",
                term.says(&units),
                kind.excitation
            ),
            smallest: None,
        }),
    });
    unexcited.chain(elsewhere).collect()
}

/// Those that lost, each with the smallest size that would have been found; and those that were not even candidates.
pub fn with_smallest(rejected: Vec<Rejected>, shows: &[(&'static Kind, Shows)]) -> Vec<Rejected> {
    let smallest = |kind: &str| match shows.iter().find(|(shown, _)| shown.name == kind) {
        Some((_, Shows::From(term))) => Some(term.clone()),
        _ => None,
    };
    let untestable = |kind: &str| {
        shows.iter().any(|(shown, shows)| shown.name == kind && matches!(shows, Shows::NotEven(_)))
    };
    let seen: Vec<&str> = rejected.iter().map(|r| r.kind).collect();
    let others =
        shows.iter().filter(|(kind, shows)| !seen.contains(&kind.name) && matches!(shows, Shows::From(_)));
    let others: Vec<Rejected> = others
        .map(|(kind, _)| Rejected {
            kind: kind.name,
            why: "takes away less of the mismatch than the others at any size".into(),
            smallest: smallest(kind.name),
        })
        .collect();
    let fitted = rejected.into_iter().filter(|r| !untestable(r.kind));
    fitted.map(|r| Rejected { smallest: smallest(r.kind), ..r }).chain(others).collect()
}
