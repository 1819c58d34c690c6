//! The numbers that decide, each with its source. What a number is worth was measured on loops of independent simulators: `.ci/wide` and
//! `tests/cases/run` print the tables of the README.

use crate::estimate::hypothesis::Priors;

/// The numbers that decide.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// What a fit takes as likely before it has seen the recording.
    pub priors: Priors,
    /// Log-likelihood, after the cost of its numbers, from which something is missing.
    pub least_gain: f64,
    /// The same of a further term beside those that are named, and the samples from which on it is asked for; of fewer a part of it. What the model of the first lacks makes up such a
    /// term, the more the longer it is seen: on four seeds of `tests/cases/run` (9307 to 9310) three of nine that were not there gained 24 to 34, and two of 31 that were less than 35.
    pub further_gain: f64,
    /// Those samples.
    pub further_samples: usize,
    /// The same where the plant was guessed from the very recordings, which then lacks something by which any kind may gain a little: of four seeds of `tests/cases/run` (9309 to 9312) two
    /// kinds gained less, neither of which was there.
    pub guessed_gain: f64,
    /// The same where the law that closes the loop is not known either and no simulation shows what is named: all four kinds of five seeds (9307 to 9311) that were named for less were not
    /// there, or a wave of the noise. What sticks or plays needs less: it shows in how y jumps and turns.
    pub unknown_gain: f64,
    /// The same from which on what sticks or plays stands on a guessed plant without a simulation: one slip that comes late leads it anywhere. Of 96 loops at rest without a valve's fault
    /// (the form of `tests/cases/valves` that it was chosen on) two gain more than 24 by it, whose sensors play, and of eight real ones none more than 12.
    pub play_gain: f64,
    /// Part of the strongest term's gain that a further one must have: no model of the first is exact.
    pub least_share: f64,
    /// Part of the best kind's gain by which another of its family may be behind it: no model of either is exact.
    pub inexact_share: f64,
    /// Log-likelihood by which the best kind (or family of kinds) must lead all others to be named.
    pub margin: f64,
    /// Part of a hold-out of its own, and of a recording without one, that a fit may see.
    pub seen_of_holdout: f64,
    /// The same of a recording without a hold-out.
    pub seen_of_recording: f64,
    /// Samples of a recording that are used.
    pub most_samples: usize,
    /// Samples that are enough to search over: of a recording that has more, a search looks at the mean of several as one first, and what it leads to is fitted to
    /// all. With a third or a fifth of their samples 3 of 12 loops of 12 000 to 20 000 samples lost their name (`.ci/wide 611`), with a seventh none of 105 000 did.
    pub enough_samples: usize,
    /// Terms that may be named.
    pub most_terms: usize,
    /// The probability with which the truth may leave the set, where a guarantee is asked for: see `guarantee`.
    pub guarantee: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            priors: Priors::default(),
            least_gain: 4.0,
            further_gain: 35.0,
            further_samples: 14_000,
            guessed_gain: 15.0,
            unknown_gain: 50.0,
            play_gain: 30.0,
            least_share: 0.005,
            inexact_share: 0.02,
            margin: 5.0,
            seen_of_holdout: 0.5,
            seen_of_recording: 0.7,
            most_samples: 150_000,
            enough_samples: 15_000,
            most_terms: 3,
            guarantee: None,
        }
    }
}
