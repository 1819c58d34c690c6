//! Finds, names, models and proves the physics that a simulation left out of a recorded loop.
//!
//! [`crate::likelihood_search`] does the work. Here are its result, [`Diagnosis`], and what is made of it: [`prove`] (simulations against what was recorded),
//! [`locate`] (when, and on what the missing drive depends), [`report`] (JSON) and [`page`].

mod before_and_after;
pub mod cause;
pub(crate) mod cycle;
mod drive_charts;
mod free_run;
pub mod load_jumps;
pub mod load_waves;
pub mod locate;
pub(crate) mod missing_drive;
mod motion;
pub(crate) mod named;
pub(crate) mod observer;
pub mod page;
pub(crate) mod part_time;
pub mod prove;
pub mod report;
pub mod shown;
pub(crate) mod spectrum;

use crate::control_loop::Loop;
use crate::controller::Controller;
use crate::estimate::law_replay::ControllerReplay;
pub use crate::estimate::signals;
use crate::likelihood_search::{self, options::Options};
use crate::physics::{Place, Term};
use crate::{Error, Result};
use load_jumps::LoadJumps;
use load_waves::LoadWaves;
use locate::{Dependence, MismatchSpan};
use missing_drive::MissingDrive;
pub use named::Named;
use signals::Signals;

/// What the work on one sample of a recording takes, bytes: the greatest memory that diagnoses of 2 and 4 million samples were seen to take
/// is 400 for each, and some is kept in reserve.
pub const SAMPLE_WORK_BYTES: u64 = 500;
/// Samples of a recording that are used.
const MOST_SAMPLES: usize = 150_000;
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
    /// What an experiment would have to tell apart, with numbers.
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
    /// Jumps of the load that count as noise; `None` where it does not jump in the first recording.
    pub load_jumps: Option<LoadJumps>,
    /// Waves of the load that count as noise; `None` where it does not swing in the first recording.
    pub load_waves: Option<LoadWaves>,
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

    /// Whether part of the recordings proves; not where all was fitted to.
    pub(crate) fn is_held_out(&self) -> bool {
        self.holdout.after.is_some()
    }

    /// Whether something is named that acts at times of this recording.
    pub(crate) fn comes_and_goes(&self) -> bool {
        self.physics.iter().any(|named| !named.term.spans.is_empty())
    }

    /// The fits that count: on the hold-out, or, where nothing was held out, on what all was fitted to.
    pub(crate) fn unseen_fits(&self) -> Fits {
        if self.is_held_out() { self.holdout } else { self.train }
    }

    /// Whether the simulation with what was named is no better than without.
    pub(crate) fn is_worse(&self) -> bool {
        let fits = self.unseen_fits();
        let u = |fit: Option<prove::FitPct>| fit.and_then(|fit| fit.u_pct);
        u(fits.before).zip(u(fits.after)).is_some_and(|(before, after)| after <= before)
    }

    /// Whether a load or a bias comes more than once among what is named: it may be one signal that comes and goes, which the likelihood has none of. Where the sensor's
    /// noise changes too, no simulation tells: that is in none.
    pub(crate) fn jumps_again(&self) -> bool {
        let changes_noise = self.physics.iter().any(Named::is_noise_change);
        !changes_noise && self.physics.iter().filter(|named| named.is_offset()).count() > 1
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
    if recordings.is_empty() {
        return Err(Error::new("there is no recording to diagnose"));
    }
    signals::check_open_inputs(nominal, recordings.iter().chain(healthy))?;
    let under = |law: Controller| {
        let model = Loop { controller: law, ..nominal.clone() };
        likelihood_search::diagnose(recordings, holdout, &model, healthy, options)
    };
    // A law that is another one than stated says nothing of y: y given u is judged without it.
    let found = under(nominal.controller.clone()).or_else(|| under(Controller::Recorded));
    found.ok_or_else(|| {
        Error::new("the nominal model can't follow the recorded u: it diverges")
            .allowed("a loop file whose units, signs and sample time fit the recording")
    })
}
