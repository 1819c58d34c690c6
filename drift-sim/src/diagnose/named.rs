//! A term that was found, and what speaks for it.

use crate::physics::{Family, Starts, Term};

/// Log-likelihood that a term gains from which it is not nothing, whatever the curvature says of each of its numbers: another one beside it, a load say, may take up what each of
/// them does, and not what they do together.
pub(crate) const EXCLUDES_NOTHING: f64 = 50.0;

/// Part of a term's size that its interval reaches to either side, at most, for the size to be told: the play of a clean loop
/// (`tests/cases/run 9401`) was as small as that.
const TOLD: f64 = 0.5;

/// A term that was found, and what speaks for it.
#[derive(Debug, Clone)]
pub struct Named {
    /// The term with its fitted numbers.
    pub term: Term,
    /// The same with its numbers as they were when it was named, before other terms came beside it.
    pub first: Option<Term>,
    /// Half widths of the 95 % intervals of its parameters.
    pub half_widths: Vec<f64>,
    /// Kinds that these recordings can't tell from it.
    pub tied: Vec<&'static str>,
    /// Gain on the training part after the cost of its parameters, log-likelihood.
    pub train_gain: f64,
    /// Gain on the hold-out in standard errors.
    pub holdout_errors: f64,
}

impl Named {
    /// The numbers with which it was named, where those named after it have moved one of them out of its interval.
    pub fn moved_from(&self) -> Option<&Term> {
        let first = self.first.as_ref()?;
        let pairs = first.parameters.iter().zip(&self.term.parameters).zip(&self.half_widths);
        pairs.into_iter().any(|((then, now), width)| (then - now).abs() > *width).then_some(first)
    }

    /// Whether it may do nothing: every number that the recordings tell of may be the one at which it does, by its 95 % interval, and it gains too little to say otherwise.
    pub fn may_be_nothing(&self) -> bool {
        let numbers = self.term.kind.parameters.iter().zip(&self.term.parameters).zip(&self.half_widths);
        let mut known = numbers.filter(|(_, width)| width.is_finite() && **width > 0.0).peekable();
        self.train_gain <= EXCLUDES_NOTHING
            && known.peek().is_some()
            && known.all(|((parameter, number), width)| parameter.may_be_neutral(*number, *width))
    }

    /// Whether its size, the first of its numbers, is told: what may as well be half of it, or half more, may be nothing beside a plant whose own numbers may be anything.
    pub(crate) fn is_of_told_size(&self) -> bool {
        let size = self.term.parameters.first().zip(self.half_widths.first());
        size.is_some_and(|(size, width)| *width < TOLD * size.abs())
    }

    /// Whether it is a load or a bias, or does about the same, from some time on.
    pub(crate) fn is_offset(&self) -> bool {
        self.term.kind.family == Some(Family::Offset)
    }

    /// Whether it is in the noise, and in no simulation.
    pub(crate) fn is_noise_change(&self) -> bool {
        matches!(self.term.kind.search, Starts::NoiseChange)
    }
}
