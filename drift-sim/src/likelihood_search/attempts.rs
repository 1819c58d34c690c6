//! What is tried in turn where a first search leaves doubt: its noise is no noise of the kind that is reckoned with, or what it found does not simulate what nothing has
//! seen. What is fast in a machine and in none of the hypotheses is in the mean of several samples no more; what comes and goes is no term that begins once; and a motor
//! that sticks and plays looks like neither to a search that takes one after the other. Of what stands then, that is kept which simulates best.

use crate::diagnose::prove::FitPct;
use crate::diagnose::{Diagnosis, Named, Verdict};
use crate::estimate::first_look::coarseness;
use crate::estimate::signals::Signals;
use crate::physics::Term;
use crate::plant::Plant;
use crate::stage;

use super::judge::Tried;
use super::options::Options;
use super::parts::Parts;
use super::{Case, comes_and_goes};

/// How many samples are taken as one.
const COARSER: [usize; 6] = [3, 5, 7, 11, 15, 27];
/// The same at most where neither law nor plant is known: unknown plants take the longest to search, a simulation that their own u drives shows the least, and the mean of
/// more samples of u has answered to y's in it, which looks like a delay.
const COARSEST_GUESS: usize = 3;
/// Samples that must be left of the first recording.
const LEAST_COARSE: usize = 100;
/// Part of the best kind's gain by which another of its family may be behind it where the noise is none that is reckoned with: the machine is another than any of the hypotheses.
const INEXACT_SHARE: f64 = 0.2;
/// Part of what the first search leaves of u that another one may leave, to take its place where it stands.
const CLOSER: f64 = 0.8;
/// What it may leave of u at most, in per cent.
const FOLLOWS_PCT: f64 = 50.0;

/// What a search begins beside.
#[derive(Debug, Clone, PartialEq)]
pub enum Beside {
    /// The plant alone.
    Nothing,
    /// A coarse sensor, and nothing else.
    CoarseSensor,
    /// Loads and biases that come and go.
    ComingAndGoing {
        /// With their times.
        terms: Vec<Term>,
        /// Whether they are likelier than all that a first search tries beside the plant alone, and not what a simulation has to show where that leaves doubt.
        is_likeliest: bool,
    },
    /// Friction in an unknown motor and play behind it, where that is likelier than what was found.
    StickingMotor {
        /// What was found, on the scale of the objective.
        than: f64,
    },
}

/// A search of the recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Attempt {
    /// How many samples are taken as one.
    pub factor: usize,
    /// What it begins beside.
    pub beside: Beside,
}

impl Attempt {
    const FIRST: Self = Self { factor: 1, beside: Beside::Nothing };

    /// Whether it is more than the first look at what was recorded.
    pub fn is_further(&self) -> bool {
        let is_of_first = match self.beside {
            Beside::Nothing | Beside::CoarseSensor => true,
            Beside::ComingAndGoing { is_likeliest, .. } => is_likeliest,
            Beside::StickingMotor { .. } => false,
        };
        self.factor > 1 || !is_of_first
    }
}

/// The diagnosis that stands; else the first one, undecided.
pub fn best(case: &Case<'_>) -> Option<Diagnosis> {
    let mut first = case.tried(&Attempt::FIRST)?;
    if !first.stands && is_more_than_enough(case) {
        // What a first look at fewer samples led to does not stand: all of them are searched.
        let all = Options { enough_samples: usize::MAX, ..case.options.clone() };
        first = Case { options: &all, ..*case }.tried(&Attempt::FIRST)?;
    }
    if case.options.guarantee.is_some() {
        // Nothing is guaranteed of what was chosen by its simulation.
        return Some(if first.stands { first.found } else { first.found.undecided() });
    }
    // What a simulation alone shows may be all that is wrong, or all that a search in these samples can show.
    if first.stands && first.is_sure {
        return Some(first.replaced(case));
    }
    stage::begins("further searches", 0);
    let options = Options { inexact_share: INEXACT_SHARE, ..case.options.clone() };
    let case = &Case { options: &options, ..*case };
    let undecided = (!first.stands).then(|| first.found.clone().undecided());
    let reached = first.reached;
    let mut best = Best::default();
    // What the recording's own samples show yields to what simulates far closer alone.
    best.keep(std::iter::once(first), CLOSER);
    best.search(|| sticking_motor(case, reached), 1.0);
    best.search(|| coarser(case), 1.0);
    // What comes and goes has so many numbers that it must simulate far closer than a term of the library.
    best.search(|| coming_and_going(case), 1.0 / CLOSER);
    let found = best.found();
    found.map(|found| Diagnosis { far_off: is_far_off(&found), ..found }).or(undecided)
}

/// How many times what noise leaves of u, and how much of u at least, in per cent, a simulation must miss for more to be missing than what is named.
const FAR_OF_NOISE: f64 = 2.0;
const FAR_PCT: f64 = 3.0;

/// Whether the closed loop stays far from what was measured with what is named.
fn is_far_off(found: &Diagnosis) -> bool {
    let noise_pct = found.noise_floor.map_or(0.0, FitPct::error);
    found.verdict == Verdict::MissingPhysics
        && is_closed(found)
        && error_pct(found) > FAR_PCT.max(FAR_OF_NOISE * noise_pct)
}

fn is_closed(found: &Diagnosis) -> bool {
    found.nominal.has_law()
}

/// What a closed loop leaves of u, in per cent, below which no further search is made: a real drive (EMPS) with its friction leaves 3.1; with a wave in place of pulses that were missed, 53.
const CLOSE_PCT: f64 = 5.0;

/// Searches in turn that may be no better than the best one before those that follow are left.
const NO_BETTER: usize = 2;

/// Of what stands that which simulates best; what is named comes before faults of the law and other numbers, and these before what is only placed; and what may not be nothing by
/// its interval, and was found under a noise that holds, before what may.
#[derive(Default)]
struct Best(Option<((usize, bool), f64, Diagnosis)>);

impl Best {
    /// Keeps what is better of these, their errors counting so many times.
    fn keep(&mut self, tried: impl Iterator<Item = Tried>, counts: f64) {
        let mut no_better = 0;
        for tried in tried {
            let ranked = rank(&tried).map(|rank| (rank, counts * error_pct(&tried.found)));
            match ranked.filter(|ranked| self.is_beaten_by(*ranked)) {
                Some((rank, error)) => (self.0, no_better) = (Some((rank, error, tried.found)), 0),
                None => no_better += 1,
            }
            if no_better == NO_BETTER && matches!(self.0, Some(((0, false), ..))) {
                return;
            }
        }
    }

    /// The same of a search that is made only where none has led to a closed loop that follows what was measured.
    fn search<I: Iterator<Item = Tried>>(&mut self, search: impl FnOnce() -> I, counts: f64) {
        let is_close = |found: &Diagnosis| is_closed(found) && error_pct(found) < CLOSE_PCT;
        if !self.0.as_ref().is_some_and(|(.., found)| is_close(found)) {
            self.keep(search(), counts);
        }
    }

    fn is_beaten_by(&self, (rank, error): ((usize, bool), f64)) -> bool {
        self.0.as_ref().is_none_or(|(of, least, _)| rank < *of || (rank == *of && error < *least))
    }

    fn found(self) -> Option<Diagnosis> {
        self.0.map(|(.., found)| found)
    }
}

/// The rank of what stands, the first first.
fn rank(tried: &Tried) -> Option<(usize, bool)> {
    let rank = match tried.found.verdict {
        _ if !tried.stands => None,
        Verdict::MissingPhysics if tried.names => Some(0),
        Verdict::MissingPhysics | Verdict::Parameters => Some(1),
        Verdict::Located => Some(2),
        // None that is doubted is healthy.
        Verdict::NoMismatch | Verdict::Undecided => None,
    };
    Some((rank?, tried.is_refuted || tried.found.physics.iter().any(Named::may_be_nothing)))
}

/// What a simulation of what nothing has seen leaves, in per cent.
fn error_pct(found: &Diagnosis) -> f64 {
    found.unseen_fits().after.map_or(f64::INFINITY, FitPct::error)
}

impl Tried {
    /// The diagnosis, or another one that simulates far better: what jumps more than once may be one signal that comes and goes, and what an unknown motor is named for, or
    /// nothing at all, may be friction with play beside it.
    fn replaced(self, case: &Case<'_>) -> Diagnosis {
        let found = self.found;
        let is_open = !case.nominal.has_law();
        let is_motor =
            may_be_a_motor(case, &found) && (found.verdict != Verdict::MissingPhysics || found.is_worse());
        let others: Vec<Tried> = match (is_open, found.jumps_again(), is_motor) {
            (true, ..) => Vec::new(),
            (_, true, _) => coming_and_going(case).collect(),
            (_, _, true) => sticking_motor(case, self.reached).collect(),
            _ => Vec::new(),
        };
        // Where causes are left, a simulation with one of them is no evidence against the others; one with several is a cause that was not among them.
        let least = if matches!(found.verdict, Verdict::Located | Verdict::Undecided) { 2 } else { 1 };
        // What only its noise excuses yields to whatever simulates better.
        let follows_pct = if found.is_worse() { f64::INFINITY } else { FOLLOWS_PCT };
        let most_pct = (CLOSER * error_pct(&found)).min(follows_pct);
        let mut best = Best::default();
        best.keep(others.into_iter(), 1.0);
        let closer = best.found().filter(|other| other.physics.len() >= least);
        closer.filter(|other| error_pct(other) < most_pct).unwrap_or(found)
    }
}

/// Whether an unknown plant may be a motor: two lags of which one is slow are a mass that friction slows, in all that a short recording shows.
fn may_be_a_motor(case: &Case<'_>, found: &Diagnosis) -> bool {
    case.nominal.plant == Plant::Identify
        && match &found.nominal.plant {
            Plant::Servo(_) => true,
            Plant::TransferFunction(plant) => plant.den.len() > 2 || plant.den.last() == Some(&0.0),
            plant => !plant.keeps_its_level(),
        }
}

/// The searches in coarser samples, the coarsest first: it takes the least time.
fn coarser<'a>(case: &'a Case<'_>) -> impl Iterator<Item = Tried> + 'a {
    let attempts = factors(case).rev().map(|factor| Attempt { factor, ..Attempt::FIRST });
    attempts.filter_map(|attempt| case.tried(&attempt))
}

/// How many samples may be taken as one.
fn factors(case: &Case<'_>) -> impl DoubleEndedIterator<Item = usize> + use<> {
    let samples = case.recordings.first().map_or(0, Signals::len);
    let coarsest = if case.is_guess() { COARSEST_GUESS } else { usize::MAX };
    COARSER.into_iter().filter(move |factor| *factor <= coarsest && samples / factor >= LEAST_COARSE)
}

/// The search for friction and play in an unknown motor, which only a known law's loop can prove.
fn sticking_motor<'a>(case: &'a Case<'_>, than: f64) -> impl Iterator<Item = Tried> + 'a {
    let is_unknown =
        case.nominal.plant == Plant::Identify && case.nominal.has_law() && case.healthy.is_empty();
    let attempt = Attempt { beside: Beside::StickingMotor { than }, ..Attempt::FIRST };
    is_unknown.then_some(attempt).into_iter().filter_map(|attempt| case.tried(&attempt))
}

/// The searches beside what comes and goes, in the samples of the recording and in coarser ones. Its times are those of one recording.
fn coming_and_going<'a>(case: &'a Case<'_>) -> impl Iterator<Item = Tried> + 'a {
    // A plant from the very recording has taken up part of what comes and goes in it.
    let is_open = case.nominal.plant == Plant::Identify && case.healthy.is_empty();
    let samplings = || std::iter::once(1).chain(factors(case));
    let terms = (!is_open).then(|| comes_and_goes::of(case, samplings())).flatten().unwrap_or_default();
    let samplings = samplings().take(if terms.is_empty() { 0 } else { usize::MAX });
    samplings.filter_map(move |factor| case.beside(terms.clone(), factor, false))
}

/// Whether a search looks at fewer samples of these recordings first.
fn is_more_than_enough(case: &Case<'_>) -> bool {
    let parts = Parts::new(case.recordings, case.holdout, case.options);
    let fitted = parts.map(|parts| parts.fitted).unwrap_or_default();
    let all: Vec<usize> = fitted.into_iter().chain(case.healthy.iter().map(Signals::len)).collect();
    coarseness(&all, case.options.enough_samples) > 1
}
