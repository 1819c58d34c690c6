//! Where a search ended: what is named, what is left, and what speaks for either.

use crate::estimate::fit::Fit;
use crate::physics::{Kind, Place, Term};

use super::prove::Gained;

/// What speaks for a named term.
#[derive(Debug, Clone)]
pub struct Choice {
    /// Others of its family that can't be told from it.
    pub tied: Vec<&'static str>,
    /// Log-likelihood that it gains after the cost of its numbers.
    pub gain: f64,
    /// The same on what nothing has seen.
    pub unseen: Option<Gained>,
    /// How many kinds the unseen samples have chosen it from; 0 where they had no say.
    pub among: usize,
}

/// A kind's fit beside the nominal loop.
#[derive(Clone)]
pub struct Contender {
    /// The fit, the kind its last candidate.
    pub fit: Fit,
    /// Log-likelihood that it gains after the cost of its numbers.
    pub score: f64,
    /// Whether the decision left it.
    pub is_left: bool,
}

/// Where a search ended.
#[derive(Clone)]
pub struct Found {
    /// The nominal loop, its numbers refitted.
    pub base: Fit,
    /// The same with the named terms as its candidates; none where nothing is named.
    pub best: Option<Fit>,
    /// What is named, in the order of the candidates.
    pub named: Vec<Choice>,
    /// The load that stays, where it is named beside them.
    pub standing_load: Option<Choice>,
    /// Kinds that are left where they can't be told apart, and their gains after the cost of their numbers.
    pub set: Vec<(&'static str, f64)>,
    /// Fits of the first round, the likeliest first: the kinds that its decision left, then the next ones.
    pub contenders: Vec<Contender>,
    /// Whether what can't be told apart is proven to be there.
    pub is_proven: bool,
    /// Whether what is left is noise of the kind that is reckoned with.
    pub is_noise: bool,
    /// All kinds beside the nominal loop, and what they gain.
    pub rivals: Vec<(&'static str, f64)>,
    /// A coarse sensor.
    pub quantum: Option<Term>,
    /// What comes and goes in the first recording, with its times; where anything does, the search is made again beside it.
    pub comes_and_goes: Vec<Term>,
    /// Log-likelihood that the refitted numbers gain over the stated ones.
    pub refit_gain: f64,
    /// Part of the drive's variance that is u's, the rest being the random load's.
    pub predicted: f64,
}

impl Found {
    /// Whether what sticks or plays on the way to the plant is named.
    pub fn names_play(&self) -> bool {
        self.best.as_ref().is_some_and(|best| best.hypothesis.candidates().iter().any(Term::plays))
    }

    /// The place that all kinds left share, or the loop.
    pub fn place(&self) -> Option<Place> {
        let mut places =
            self.set.iter().filter_map(|(kind, _)| Kind::named(kind).ok()).map(|kind| kind.place);
        let first = places.next()?;
        Some(if places.all(|place| place == first) { first } else { Place::Loop })
    }
}

impl Found {
    /// What is named first, and what can't be told from it.
    fn first_named(&self) -> Vec<&'static str> {
        let kind = self.best.as_ref().and_then(|best| best.hypothesis.candidates().first());
        let tied = self.named.first().map_or(&[][..], |choice| &choice.tied);
        kind.map(|term| term.kind.name).into_iter().chain(tied.iter().copied()).collect()
    }

    /// What stands where another search of the same recordings is as likely to be right: what both name first, or where both place it; else nothing is proved.
    pub fn agreed_with(mut self, other: &Found) -> Self {
        let (own, others) = (self.first_named(), other.first_named());
        if own.is_empty() {
            self.is_proven &= other.is_proven;
        } else if !own.iter().any(|kind| others.contains(kind)) {
            let gain = self.named.first().map_or(0.0, |choice| choice.gain);
            self.set = own.into_iter().map(|kind| (kind, gain)).collect();
            self.named.clear();
            (self.best, self.standing_load, self.is_proven) = (None, None, false);
        }
        self
    }
}
