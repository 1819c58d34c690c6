//! Finds, names, models and proves the physics that a simulation left out of a recorded loop.
//!
//! One step a file. [`controller_replay`]: is the law as stated? [`model`] and [`fit`]: the nominal parameters refitted on the
//! prediction error of y under the recorded u. [`missing_drive`]: what the plant lacked. `search`: rounds of [`screen`] (every
//! kind of physics, one simulation a trial), [`candidates`] (fits), [`injected`] (signals at two levels), [`select`] (false alarms
//! first, then rivals, then ties) and `closed_loop` (does it matter there?). `recorded`: the same where plant or law are unknown.
//! `conclude`: [`interval`]s, the verdict, [`prove`] (closed loop on unseen samples), [`locate`] (when, and on what it depends) and
//! [`excitation`] (what would not have shown). [`report`] turns it into JSON, [`page`] into a page.

mod before_and_after;
pub mod by_direction;
pub mod candidates;
pub mod cause;
mod closed_loop;
mod conclude;
pub mod constant_load;
pub mod controller_fault;
pub mod controller_replay;
pub mod cycle;
mod drive_charts;
pub mod excitation;
pub mod features;
pub mod fit;
mod healthy;
pub mod holdout;
pub mod identify;
pub mod injected;
pub mod interval;
mod law_faults;
pub mod law_limit;
pub mod linear_shape;
pub mod locate;
pub mod missing_drive;
pub mod model;
mod named;
pub mod noise_change;
pub mod observer;
pub mod page;
pub mod part_time;
pub mod prove;
pub mod quantum;
mod recorded;
pub mod report;
pub mod screen;
mod search;
pub mod select;
pub mod sensor_effects;
pub mod shown;
pub mod signals;
pub mod spans;
pub mod spectrum;
pub mod sticking_valve;
pub mod valve;
pub mod whiten;

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::likelihood_search::loop_likelihood::loop_likelihood;
use crate::likelihood_search::{self, Judged, options::Options};
use crate::measured_input::Input;
use crate::physics::{Family, Place, Term};
use crate::plant::Plant;
use crate::stage;
use crate::{Error, Result};
use controller_replay::ControllerReplay;
use locate::{Dependence, MismatchSpan};
use missing_drive::MissingDrive;
pub use named::Named;
use signals::Signals;

/// Relative error of the replayed law from which something is wrong with it although no fault explains it.
const LAW_IS_ANOTHER: f64 = 0.1;
/// What the work on one sample of a recording takes, bytes: the greatest memory that diagnoses of 2 and 4 million samples were seen to take
/// is 400 for each, and some is kept in reserve.
pub const SAMPLE_WORK_BYTES: u64 = 500;
/// Samples of a recording that are used.
const MOST_SAMPLES: usize = 150_000;
/// Samples that are enough to find a sticking valve by the likelihood of y alone.
const VALVE_SAMPLES: usize = 8_000;
/// Part of the other's error on unseen data that a simulation must leave at most to be preferred on a guessed plant.
const CLOSER: f64 = 0.8;
/// What it may leave of u at most, in per cent.
const FOLLOWS_PCT: f64 = 50.0;
/// Part of a recording that is held out when no other is given.
const HELD_OUT: f64 = 0.3;

/// What a diagnosis concludes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The nominal model explains the recording.
    NoMismatch,
    /// The nominal model with other numbers explains it.
    Parameters,
    /// Physics is missing, and named.
    MissingPhysics,
    /// Something is missing and placed, but it can't be named.
    Located,
    /// Too little moves, or too much is unknown, to prove or to exclude anything.
    Undecided,
}

impl Verdict {
    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoMismatch => "no_mismatch",
            Self::Parameters => "parameters",
            Self::MissingPhysics => "missing_physics",
            Self::Located => "located",
            Self::Undecided => "undecided",
        }
    }
}

/// A nominal parameter before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Refitted {
    /// Its name.
    pub name: String,
    /// In the loop file.
    pub nominal: f64,
    /// Fitted.
    pub value: f64,
    /// Half width of its 95 % interval.
    pub half_width: f64,
}

impl Refitted {
    /// Whether it is the plant's, and not the law's.
    pub fn is_plants(&self) -> bool {
        !self.name.starts_with("controller.")
    }
}

/// A candidate that lost, or could not be tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    /// Its kind.
    pub kind: &'static str,
    /// Why.
    pub why: String,
    /// The smallest term of this kind that would have been found; none where that is not known.
    pub smallest: Option<Term>,
}

/// The fits of the closed loop on one part of the data.
#[derive(Debug, Clone, Copy, Default)]
pub struct Fits {
    /// The loop file as it came.
    pub nominal: Option<prove::FitPct>,
    /// With its own parameters refitted.
    pub before: Option<prove::FitPct>,
    /// With the named physics.
    pub after: Option<prove::FitPct>,
}

/// Everything that was found.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// The conclusion.
    pub verdict: Verdict,
    /// Where in the loop.
    pub place: Option<Place>,
    /// When the mismatch shows.
    pub spans: Vec<MismatchSpan>,
    /// What the missing drive depends on.
    pub depends_on: Vec<Dependence>,
    /// Samples at the end of the recording that were not used: there were too many.
    pub not_used: usize,
    /// Whether the closed loop stays far from what was measured whatever was named: something is missing still.
    pub far_off: bool,
    /// The named terms, the strongest first.
    pub physics: Vec<Named>,
    /// Kinds that are left where one can't be named, with the log-likelihood that each gains after the cost of its numbers.
    pub candidates: Vec<(&'static str, f64)>,
    /// All kinds that were fitted beside the refitted model, with the log-likelihood that each gains.
    pub rivals: Vec<(&'static str, f64)>,
    /// What an experiment would have to tell apart, with numbers; empty where the search by prediction error concluded.
    pub causes: Vec<cause::Cause>,
    /// The nominal parameters.
    pub parameters: Vec<Refitted>,
    /// Rivals that lost.
    pub rejected: Vec<Rejected>,
    /// Terms that can't act here or were not excited.
    pub untestable: Vec<Rejected>,
    /// On the training part.
    pub train: Fits,
    /// On the hold-out.
    pub holdout: Fits,
    /// 95 % interval of the improvement on the hold-out, per cent of u.
    pub improvement: Option<[f64; 2]>,
    /// Period of the hold-out's own cycle, in seconds: the fits are then of simulations begun anew each period, of which no phase is lost.
    pub cycle_s: Option<f64>,
    /// What noise alone leaves of the fit.
    pub noise_floor: Option<prove::FitPct>,
    /// The loop that was diagnosed: the loop file's, its plant identified where that was left open.
    pub nominal: Loop,
    /// The nominal loop with its own numbers refitted.
    pub refitted: Loop,
    /// The improved loop.
    pub improved: Loop,
    /// The drive that the improved loop still misses.
    pub drive_left: Option<MissingDrive>,
    /// The control law against the recorded u.
    pub controller: Option<ControllerReplay>,
    /// The missing drive of the refitted nominal model.
    pub missing_drive: Option<MissingDrive>,
}

impl Diagnosis {
    /// The fit that noise alone leaves; `None` also where the simulated loop comes clearly closer than that, because the estimate then
    /// explains nothing.
    pub fn noise_leaves(&self) -> Option<prove::FitPct> {
        /// Part of the floor's error: an estimate of it is no surer.
        const CLEARLY: f64 = 0.9;
        let error = prove::FitPct::error;
        let reached = self.reached().map(error);
        self.noise_floor.filter(|floor| reached.is_none_or(|reached| reached >= CLEARLY * error(*floor)))
    }

    /// How well the loop fits that is handed back.
    fn reached(&self) -> Option<prove::FitPct> {
        let fits = self.unseen_fits();
        fits.after.or(fits.before).or(fits.nominal)
    }

    /// Whether the loop that is handed back comes as close to the recording as noise lets it.
    pub fn leaves_only_noise(&self) -> bool {
        let of = prove::FitPct::that_counts;
        self.noise_floor.zip(self.reached()).is_some_and(|(floor, reached)| of(reached) >= of(floor))
    }

    /// The fits that count: on the hold-out, or, where nothing was held out, on what all was fitted to.
    pub(crate) fn unseen_fits(&self) -> Fits {
        if self.holdout.after.is_some() { self.holdout } else { self.train }
    }

    /// Whether the simulation with what was named is no better than without.
    fn is_worse(&self) -> bool {
        let fits = self.unseen_fits();
        let u = |fit: Option<prove::FitPct>| fit.and_then(|fit| fit.u_pct);
        u(fits.before).zip(u(fits.after)).is_some_and(|(before, after)| after <= before)
    }

    /// Whether something is named that makes the simulation worse.
    fn names_worse(&self) -> bool {
        !self.physics.is_empty() && self.is_worse()
    }

    /// Whether recordings are likelier under what was named than under another loop, the numbers of both refitted; true where
    /// nothing is named that a likelihood of y has in it.
    fn is_likelier(&self, other: &Loop, recordings: &[Signals], options: &Options) -> bool {
        let has_named = self.physics.iter().any(|named| likelihood_search::is_searched(named.term.kind));
        let of = |model: &Loop| {
            let likelihood = loop_likelihood(model, recordings, true, options);
            likelihood.map_or(f64::NEG_INFINITY, |found| found.log_likelihood)
        };
        !has_named || of(&self.improved) >= of(other)
    }

    /// Whether a load or a bias comes more than once among what is named: it may be one signal that comes and goes, which the likelihood has none of. Where the sensor's
    /// noise changes too, no simulation tells: that is in none.
    fn jumps_again(&self) -> bool {
        let is_jump = |named: &&Named| named.term.kind.family == Some(Family::Offset);
        let changes_noise = self.physics.iter().any(Named::is_noise_change);
        !changes_noise && self.physics.iter().filter(is_jump).count() > 1
    }

    /// What the improved loop leaves of u where nothing was fitted to, in per cent; infinite under an unknown law, under which no loop is closed.
    fn error_pct(&self) -> f64 {
        self.unseen_fits().after.and_then(|fit| fit.u_pct).map_or(f64::INFINITY, |u| 100.0 - u)
    }
}

/// Diagnoses recordings of one loop, which share what is wrong with it: they are pooled in one likelihood, and the first is the one that is
/// shown. Without a hold-out the last 30 % of each are held out. Of all recordings together the first 150 000 samples are used: thousands
/// of simulations run over them.
///
/// # Errors
/// There is no recording, the first is too short, or the nominal model can't be simulated.
pub fn diagnose(recordings: &[Signals], holdout: Option<&Signals>, nominal: &Loop) -> Result<Diagnosis> {
    diagnose_since(&[], recordings, holdout, nominal, &Options::default())
}

/// The same where there are healthy recordings: what is looked for is not in those. With the numbers that decide.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_since(
    healthy: &[Signals],
    recordings: &[Signals],
    holdout: Option<&Signals>,
    nominal: &Loop,
    options: &Options,
) -> Result<Diagnosis> {
    signals::check_open_inputs(nominal, recordings.iter().chain(healthy))?;
    diagnose_with(recordings, holdout, nominal, (healthy, options), |first| {
        // The older search moves no gain of a measured input.
        nominal.inputs.iter().try_for_each(Input::check)?;
        if healthy.is_empty() {
            return diagnose_beside(first, holdout, nominal, 0.0);
        }
        let model = healthy::fitted(nominal, healthy)?;
        diagnose_beside(first, holdout, &model, healthy::event_gain(&model, healthy))
    })
}

/// By likelihood; `by_prediction_error` judges where that can't, or where, of a guessed motor or of a load that jumps more than once, its simulation of what
/// neither has seen is far closer.
fn diagnose_with(
    recordings: &[Signals],
    holdout: Option<&Signals>,
    nominal: &Loop,
    (healthy, options): (&[Signals], &Options),
    by_prediction_error: impl FnOnce(&Signals) -> Result<Diagnosis>,
) -> Result<Diagnosis> {
    let first = recordings.first().ok_or_else(|| Error::new("there is no recording to diagnose"))?;
    // Where no loop is closed, a likelihood is all there is.
    let is_open = nominal.controller == Controller::Recorded;
    let all = || recordings.iter().chain(holdout).cloned().collect::<Vec<Signals>>();
    let found = match likelihood_search::diagnose(recordings, holdout, nominal, healthy, options) {
        Judged::Stands(found) => *found,
        // The older search guarantees nothing.
        Judged::Colored(found) | Judged::Doubted(found) if options.guarantee.is_some() => return Ok(*found),
        Judged::Colored(found) => {
            let other = by_prediction_error(first).ok().filter(|other| !other.physics.is_empty());
            let other = other.filter(|other| {
                if is_open {
                    other.is_likelier(&found.improved, &all(), options)
                } else {
                    other.error_pct() < CLOSER * found.error_pct()
                }
            });
            return Ok(other.unwrap_or(*found));
        }
        // No recording that can be read ends in an error, and none that is doubted is healthy.
        Judged::Doubted(undecided) => {
            let other = by_prediction_error(first).ok();
            let other = other.filter(|found| found.verdict != Verdict::NoMismatch);
            let other =
                other.filter(|found| !is_open || found.is_likelier(&undecided.refitted, &all(), options));
            // On a guessed plant a simulation that what was named makes worse is no evidence.
            let other = other.filter(|found| !(nominal.plant == Plant::Identify && found.names_worse()));
            // What an experiment would have to tell apart has numbers in the likelihood alone.
            return Ok(match other {
                Some(found) if found.physics.is_empty() => Diagnosis { causes: undecided.causes, ..found },
                Some(found) => found,
                None => *undecided,
            });
        }
        // A law that is another one than stated says nothing of y: y given u is judged without it, rather than in no way.
        Judged::Nothing => {
            return by_prediction_error(first).or_else(|error| {
                let open = Loop { controller: Controller::Recorded, ..nominal.clone() };
                match likelihood_search::diagnose(recordings, holdout, &open, healthy, options) {
                    Judged::Stands(found) | Judged::Colored(found) | Judged::Doubted(found) => Ok(*found),
                    Judged::Nothing => Err(error),
                }
            });
        }
    };
    // The older search knows friction with play beside it, of motors, which may have been taken for what integrates; and one signal that comes and goes. Under an unknown law
    // no loop is closed, and there is nothing to compare.
    let plant = &found.nominal.plant;
    let may_be_a_motor = match plant {
        Plant::Servo(_) => true,
        // Two lags of which one is slow are a mass that friction slows, in all that a short recording shows.
        Plant::TransferFunction(plant) => plant.den.len() > 2 || plant.den.last() == Some(&0.0),
        plant => !plant.keeps_its_level(),
    };
    let is_open_motor = nominal.plant == Plant::Identify && may_be_a_motor;
    // What is named and simulates better than nothing does is not doubted.
    let is_doubted = is_open_motor && (found.verdict != Verdict::MissingPhysics || found.is_worse());
    if is_open || options.guarantee.is_some() || !(is_doubted || found.jumps_again()) {
        return Ok(found);
    }
    // Where causes are left, a simulation with one of them is no evidence against the others; one with several is a cause that was not among them.
    let least = if matches!(found.verdict, Verdict::Located | Verdict::Undecided) { 2 } else { 1 };
    // What only its noise excuses yields to whatever simulates better.
    let follows_pct = if found.is_worse() { f64::INFINITY } else { FOLLOWS_PCT };
    let most_pct = (CLOSER * found.error_pct()).min(follows_pct);
    // No simulation comes closer than noise alone does. Where something is missing, what was not found may count as noise.
    let noise_pct = found.noise_floor.and_then(|fit| fit.u_pct).map_or(0.0, |u| 100.0 - u);
    if found.verdict == Verdict::NoMismatch && most_pct <= noise_pct {
        return Ok(found);
    }
    match by_prediction_error(first) {
        Ok(other) if other.physics.len() >= least && other.error_pct() < most_pct => Ok(other),
        _ => Ok(found),
    }
}

/// The same where healthy recordings show events of this gain themselves.
fn diagnose_beside(
    recording: &Signals,
    holdout: Option<&Signals>,
    nominal: &Loop,
    event_gain: f64,
) -> Result<Diagnosis> {
    let all = recording.len();
    stage::begins("the search by prediction error", 0);
    let (recording, holdout) = (recording.part(0, MOST_SAMPLES), holdout.map(|h| h.part(0, MOST_SAMPLES)));
    let found = diagnose_all(&recording, holdout.as_ref(), nominal, event_gain)?;
    Ok(Diagnosis { not_used: all - recording.len(), ..found })
}

fn diagnose_all(
    recording: &Signals,
    holdout: Option<&Signals>,
    nominal: &Loop,
    event_gain: f64,
) -> Result<Diagnosis> {
    let cut = ((1.0 - HELD_OUT) * recording.len() as f64) as usize;
    let (train, held) = match holdout {
        Some(holdout) => (recording.clone(), holdout.clone()),
        None => (recording.part(0, cut), recording.part(cut, recording.len())),
    };
    let whole = if holdout.is_some() { &train } else { recording };
    if nominal.plant == Plant::Identify
        && nominal.controller == Controller::Recorded
        // Where the reference stands still, y and u move together for reasons of their own, and a valve may seem to stick.
        && recording.r.windows(2).any(|pair| matches!(pair, [a, b] if a != b))
        && let Some(valve) = valve::find(&recording.part(0, VALVE_SAMPLES))
    {
        let model = Loop { plant: valve.plant.clone(), ..nominal.clone() };
        let case = Case {
            nominal: &model,
            train: recording,
            holdout: &held,
            whole: recording,
            guessed: true,
            event_gain,
        };
        if let Some(found) = case.run_valve(&valve)? {
            return Ok(found);
        }
    }
    let faults = law_faults::find(nominal, &train, &held);
    let stated = nominal;
    let nominal = faults.as_ref().map_or(nominal, |faults| &faults.model);
    let identified = identify::plant(nominal, &train)?;
    let mut model = identified.as_ref().map_or(nominal, |found| &found.nominal).clone();
    if another_law(&model, &train, &held) {
        model.controller = Controller::Recorded;
    }
    let guessed = identified.is_some() || model.controller == Controller::Recorded;
    let case = Case { nominal: &model, train: &train, holdout: &held, whole, guessed, event_gain };
    let found = if guessed { case.run_recorded(identified.as_ref()) } else { case.run() }?;
    Ok(match faults {
        Some(faults) => found.with_law_faults(faults, stated, &train, &held),
        None => found,
    })
}

/// Whether the hold-out was recorded under another law than the stated one, which the training part follows: closing the loop
/// over it would prove nothing.
fn another_law(model: &Loop, train: &Signals, holdout: &Signals) -> bool {
    let error = |signals| controller_replay::replay(model, signals).map(|replay| replay.relative);
    matches!((error(train), error(holdout)), (Some(here), Some(there)) if here < LAW_IS_ANOTHER && there > LAW_IS_ANOTHER)
}

/// One loop, one training part, one hold-out.
#[derive(Clone, Copy)]
struct Case<'a> {
    nominal: &'a Loop,
    train: &'a Signals,
    holdout: &'a Signals,
    /// The training part, and the hold-out where both are of one recording.
    whole: &'a Signals,
    /// Whether the plant was identified or the law is unknown: then little is named.
    guessed: bool,
    /// What an event must gain in log-likelihood beyond what it takes anywhere: healthy recordings show as much.
    event_gain: f64,
}
