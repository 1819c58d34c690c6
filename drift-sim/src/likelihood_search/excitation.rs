//! What the recording could have shown: for each kind of physics about the smallest size that would have been found. A trial of each kind
//! changes the innovations; what the model's own numbers can't take up of that is what shows, and grows with the square of the size.

use crate::cores::AcrossCores as _;

use crate::estimate::fit::Fit;
use crate::estimate::likelihood::Data;
use crate::physics::{KINDS, Kind, Starts, Term};

use super::options::Options;
use super::rivals::is_searched;
use super::starts::{Base, trial_power};

/// A size beyond this many times the trial's, which is of the size of the signals themselves, would not have shown.
const TOO_LARGE: f64 = 4.0;

/// What a recording tells of a kind that was not found.
#[derive(Debug, Clone)]
pub enum Shows {
    /// A term of about this size would have been found.
    From(Term),
    /// Not even one of the size of the signals.
    Nothing,
}

/// What the recording would have shown of every kind that can act on the plant and is not among the candidates.
pub fn shows(fit: &Fit, data: &Data, options: &Options) -> Vec<(&'static Kind, Shows)> {
    let Some(base) = Base::new(fit, data) else { return Vec::new() };
    let present = |kind: &Kind| fit.hypothesis.candidates().iter().any(|term| term.kind == kind);
    KINDS
        .iter()
        .copied()
        .into_par_iter()
        .filter(|kind| is_searched(kind, &fit.hypothesis) && !present(kind))
        .filter(|kind| !matches!(kind.search, Starts::NoiseChange))
        .filter_map(|kind| {
            let (term, gain) = trial_power(&base, kind)?;
            let numbers = kind.parameters.len() as f64 + if term.onset_s > 0.0 { 2.0 } else { 0.0 };
            let needed = options.least_gain + 0.5 * numbers * libm::log(fit.rows.count.max(2) as f64);
            let factor = libm::sqrt(needed / gain.max(1e-12));
            Some((
                kind,
                if factor > TOO_LARGE {
                    Shows::Nothing
                } else {
                    scaled(&term, factor).map_or(Shows::Nothing, Shows::From)
                },
            ))
        })
        .collect()
}

/// The term with its first number moved from its neutral value by a factor.
fn scaled(term: &Term, factor: f64) -> Option<Term> {
    let mut term = term.clone();
    let parameters = term.kind.parameters;
    let amounts = parameters
        .iter()
        .filter(|p| {
            !["phase", "period", "frequency_hz", "stribeck_speed", "damping", "exponent"].contains(&p.name)
        })
        .count();
    for (parameter, value) in parameters.iter().zip(&mut term.parameters).take(amounts.max(1)) {
        *value = parameter.neutral + factor * (*value - parameter.neutral);
    }
    term.check().is_ok().then_some(term)
}
