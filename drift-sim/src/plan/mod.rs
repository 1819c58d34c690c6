//! The experiment to run: the reference, within given limits, that tells apart what a diagnosis left, and the chance that it does.
//!
//! One step a file. [`diagnosis_file`]: the causes that are left, with their numbers and noise. `shapes`: references that may tell
//! them apart. `rehearsal`: each cause's closed loop simulated over one. `separation`: how far apart the answers are once a rival's
//! numbers are refitted, and with which chance the diagnosis' bars are passed. Here: the shortest reference whose worst pair separates.
//! `page` draws it.

pub mod diagnosis_file;
mod json;
mod page;
mod proposal;
mod recorded;
mod rehearsal;
mod separation;
mod shapes;

pub use diagnosis_file::OpenDiagnosis;
pub use proposal::proposal;
pub use recorded::Recorded;
pub use separation::{Pair, Separation, passes};
pub use shapes::{Room, SHAPES, Shape};

use crate::control_loop::Loop;
use crate::diagnose::cause::Cause;
use crate::estimate::signals::{LEAST_SAMPLES, Signals, range};
use crate::likelihood_search::options::Options;
use crate::plant::Plant;
use crate::sentences::{typed, typed_to};
use crate::simulate::samples;
use crate::stage;
use crate::{Error, Result};

use rehearsal::Stage;
use separation::Court;

/// Within what an experiment must stay; what is not stated is as in the recording.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Limits {
    /// The least r.
    pub r_low: Option<f64>,
    /// The greatest r.
    pub r_high: Option<f64>,
    /// The fastest change of r, per second.
    pub r_rate: Option<f64>,
    /// The least u.
    pub u_low: Option<f64>,
    /// The greatest u.
    pub u_high: Option<f64>,
    /// The longest experiment, in seconds.
    pub longest_s: Option<f64>,
}

/// What is asked.
#[derive(Debug, Clone)]
pub struct Request {
    /// The loop as stated.
    pub stated: Loop,
    /// What the diagnosis left.
    pub open: OpenDiagnosis,
    /// Within what the experiment must stay.
    pub limits: Limits,
    /// The chance with which each pair is to be told apart.
    pub chance: f64,
    /// Noise is drawn from this.
    pub seed: u64,
}

/// The experiment.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What was asked.
    pub request: Request,
    /// The kind of reference.
    pub shape: Shape,
    /// The reference, one value a sample.
    pub r: Vec<f64>,
    /// What it tells apart.
    pub separation: Separation,
    /// Each cause's answer without noise; the same place as among the diagnosis' causes, of those that are left.
    pub answers: Vec<(usize, Signals)>,
    /// References that were rehearsed.
    pub tried: usize,
    /// How much of the log before the experiment is diagnosed with it, in seconds; 0 where the experiment is enough.
    pub before_s: f64,
}

/// Lengths that are tried, as parts of the longest.
const LENGTHS: [f64; 5] = [1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0, 1.0];
/// References that are rehearsed at more than a quarter of the longest length.
const FINALISTS: usize = 2;
/// Samples of an experiment, at least: the first don't count.
const LEAST: usize = 2 * LEAST_SAMPLES;
/// Samples of an experiment, at most: thousands of simulations run over them.
const MOST: usize = 40_000;
/// Parts of the room for r that are tried where u would leave its limits.
const SMALLER: [f64; 4] = [1.0, 0.6, 0.35, 0.2];
/// A pair is hopeless where the longest experiment would bring less than this, in log-likelihood.
const HOPELESS: f64 = 10.0;
/// Another reference may be this many times as telling a second as those that were tried.
const MORE_TELLING: f64 = 2.0;
/// How often r may cross its range within the longest experiment: where nothing is known of its rate, and where a rate is called too slow.
const OF_ITSELF: f64 = 40.0;
const SLOWEST: f64 = 4.0;
/// Samples of an experiment for each of the recording before it, at least: of a log's last part a fit sees nothing.
const WEIGHT: f64 = 0.75;

impl Request {
    /// Plans.
    ///
    /// # Errors
    /// The law is unknown, the loop is another than the diagnosed one, limits that contradict each other or leave no room, or no
    /// reference keeps u within its limits.
    pub fn plan(self) -> Result<Plan> {
        self.check()?;
        let options = Options::default();
        let room = self.room()?;
        let longest = self.longest()?;
        let lengths = self.lengths(longest)?;
        stage::begins("rehearsing references", lengths.len() * SHAPES.len());
        let mut best: Option<Tried> = None;
        let mut tried = 0;
        let mut shapes = SHAPES.to_vec();
        for Length { samples, before } in lengths {
            let before = self.open.recorded.last_reference(before);
            let stage = Stage { stated: &self.stated, recorded: &self.open.recorded, before: &before };
            let court = Court { stage, causes: &self.open.causes, options: &options, seed: self.seed };
            let mut of_length: Vec<Tried> = Vec::new();
            for shape in shapes.iter().copied() {
                let rehearsed = self.within_u(stage, shape, samples, &room);
                if let Some(r) = rehearsed
                    && let Some(separation) = court.separation(&r)
                {
                    of_length.push(Tried { shape, r, separation, before: before.clone() });
                }
                stage::step();
            }
            tried += of_length.len();
            // Long experiments are rehearsed with the references that told most when they were shorter.
            if 4 * samples >= longest && of_length.len() > FINALISTS {
                of_length.sort_by(|a, b| b.separation.mean().total_cmp(&a.separation.mean()));
                shapes = of_length.iter().take(FINALISTS).map(|tried| tried.shape).collect();
            }
            let factor = MORE_TELLING * longest as f64 / samples as f64;
            let Some((new, passes)) = self.best_of(of_length, factor) else { continue };
            let is_better = |old: &Tried| new.separation.mean() > old.separation.mean();
            if passes || best.as_ref().is_none_or(is_better) {
                best = Some(new);
            }
            if passes {
                break;
            }
        }
        let Tried { shape, r, separation, before } = best.ok_or_else(|| self.no_reference())?;
        let stage = Stage { stated: &self.stated, recorded: &self.open.recorded, before: &before };
        let left = self.open.causes.iter().enumerate().filter(|(_, cause)| cause.is_left);
        let answers = left.filter_map(|(i, cause)| Some((i, stage.quiet(cause, &r)?))).collect();
        let before_s = before.len() as f64 * self.stated.sample_time_s;
        Ok(Plan { before_s, shape, separation, answers, tried, r, request: self })
    }

    /// The reference of one length that tells most apart, and whether it is enough. A pair that the longest experiment would hardly tell apart, were it
    /// `factor` times as telling, is not waited for.
    fn best_of(&self, tried: Vec<Tried>, factor: f64) -> Option<(Tried, bool)> {
        let is_asked = |pair: &Pair| {
            let of =
                |tried: &Tried| tried.separation.pairs.iter().find(|p| p.is_of(pair)).map(|p| p.expected);
            factor * tried.iter().filter_map(of).fold(0.0, f64::max) >= HOPELESS
        };
        let judged = |t: &Tried| (t.separation.worst(is_asked), t.separation.mean());
        let best = tried.iter().max_by(|a, b| {
            let (a, b) = (judged(a), judged(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        })?;
        let passes = judged(best).0 >= self.chance && best.separation.pairs.iter().any(is_asked);
        Some((best.clone(), passes))
    }

    /// The lengths that are tried, the shortest first, each with the samples before it that are diagnosed with it: where a cause began within the
    /// recording, both what was before it and what came after must be seen, and the experiment must weigh enough in the log.
    fn lengths(&self, longest: usize) -> Result<Vec<Length>> {
        let ts = self.stated.sample_time_s;
        let recorded = (self.open.recorded.duration_s / ts) as usize;
        let left = self.open.causes.iter().filter(|cause| cause.is_left);
        let onsets = left.filter_map(|cause| cause.term.as_ref()).map(|term| term.onset_s);
        let onset = onsets.filter(|onset_s| *onset_s > 0.0).fold(f64::INFINITY, f64::min);
        let since = if onset.is_finite() { recorded.saturating_sub((onset / ts) as usize) } else { 0 };
        let mut lengths: Vec<Length> = LENGTHS
            .iter()
            .map(|part| ((part * longest as f64) as usize).max(LEAST.min(longest)))
            .map(|samples| {
                let before = if since > 0 { (since + samples / 2).min(recorded) } else { 0 };
                Length { samples, before }
            })
            .filter(|length| length.samples as f64 >= WEIGHT * length.before as f64)
            .collect();
        lengths.dedup();
        if lengths.is_empty() {
            let least = WEIGHT * since as f64 / (1.0 - 0.5 * WEIGHT) * ts;
            return Err(Error::new("the experiment is too short beside the time since the cause began")
                .allowed(format!("--duration of at least {}", typed(least.ceil()))));
        }
        Ok(lengths)
    }

    fn check(&self) -> Result<()> {
        if !self.stated.has_law() {
            return Err(Error::new("controller kind 'recorded' has no law to close the loop with")
                .allowed("pi, pid, p-velocity: the experiment is rehearsed in closed loop"));
        }
        if let Some(input) = self.stated.inputs.first() {
            return Err(Error::new(format!(
                "the loop has the measured input '{}', and nobody knows it ahead",
                input.name()
            ))
            .allowed("a loop file without [[inputs]]"));
        }
        let is_of_loop = |cause: &Cause| {
            (self.stated.plant == Plant::Identify || self.stated.plant.kind() == cause.model.plant.kind())
                && cause.model.check_sample_time(self.stated.sample_time_s).is_ok()
        };
        if !self.open.causes.iter().all(is_of_loop) {
            return Err(Error::new("the diagnosis is of another loop: its plant or its sample time differs")
                .allowed("the loop file that the diagnosis was made with"));
        }
        Ok(())
    }

    fn room(&self) -> Result<Room> {
        let recorded = &self.open.recorded;
        let [least, greatest] = recorded.r_range;
        let (low, high) = (self.limits.r_low.unwrap_or(least), self.limits.r_high.unwrap_or(greatest));
        if low >= high {
            return Err(
                if least == greatest && (self.limits.r_low.is_none() || self.limits.r_high.is_none()) {
                    Error::new(
                        "r never moved in the recording, so that nothing is known of how far it may go",
                    )
                    .allowed("--r-min and --r-max")
                } else {
                    Error::new(format!("r from {} to {} leaves no room", typed(low), typed(high)))
                        .allowed("--r-min below --r-max")
                },
            );
        }
        if !(low..=high).contains(&recorded.r) {
            return Err(Error::new(format!(
                "r is at {} now, outside --r-min {} and --r-max {}",
                typed(recorded.r),
                typed(low),
                typed(high)
            ))
            .allowed("limits around the present r, from which the experiment begins"));
        }
        let longest = self.longest()? as f64;
        // A recording that hardly moves says nothing of how fast r may.
        let of_itself = (high - low) * OF_ITSELF / (longest * self.stated.sample_time_s);
        let rate = self.limits.r_rate.unwrap_or_else(|| recorded.r_rate.max(of_itself));
        let most_change = rate * self.stated.sample_time_s;
        if most_change * longest < high - low {
            let least = SLOWEST * (high - low) / (longest * self.stated.sample_time_s);
            return Err(Error::new(format!(
                "at {} a second r does not cross its range within the experiment",
                typed(rate)
            ))
            .allowed(format!("--r-rate of at least {}, or a longer --duration", typed_to(least, 3))));
        }
        Ok(Room { from: recorded.r, low, high, most_change })
    }

    fn longest(&self) -> Result<usize> {
        let seconds = self.limits.longest_s.unwrap_or(self.open.recorded.duration_s);
        let longest = samples(seconds, self.stated.sample_time_s)?;
        if longest < LEAST {
            return Err(Error::new(format!("an experiment of {} s has {longest} samples", typed(seconds)))
                .allowed(format!(
                    "--duration of at least {}",
                    typed(LEAST as f64 * self.stated.sample_time_s)
                )));
        }
        if longest > MOST && self.limits.longest_s.is_some() {
            return Err(Error::new(format!("an experiment of {} s has {longest} samples", typed(seconds)))
                .allowed(format!(
                    "--duration of at most {}",
                    typed(MOST as f64 * self.stated.sample_time_s)
                )));
        }
        Ok(longest.min(MOST))
    }

    /// The largest reference of a shape for which no cause that is left brings u out of its limits.
    fn within_u(&self, stage: Stage<'_>, shape: Shape, length: usize, room: &Room) -> Option<Vec<f64>> {
        let (low, high) =
            (self.limits.u_low.unwrap_or(f64::NEG_INFINITY), self.limits.u_high.unwrap_or(f64::INFINITY));
        let keeps = |r: &[f64]| {
            let left = self.open.causes.iter().filter(|cause| cause.is_left);
            left.into_iter().all(|cause| {
                stage.quiet(cause, r).is_some_and(|answer| {
                    let (least, greatest) = range(&answer.u);
                    low <= least && greatest <= high
                })
            })
        };
        let smaller = |part: f64| Room {
            low: room.from + part * (room.low - room.from),
            high: room.from + part * (room.high - room.from),
            ..*room
        };
        SMALLER.iter().map(|part| shape.reference(length, &smaller(*part))).find(|r| keeps(r))
    }

    fn no_reference(&self) -> Error {
        if self.limits.u_low.is_some() || self.limits.u_high.is_some() {
            return Error::new("no reference within r's limits keeps u within --u-min and --u-max")
                .allowed("wider limits of u, or narrower ones of r");
        }
        Error::new("the loop diverges under every reference with one of the causes that are left")
            .allowed("a loop that is stable with each: check the diagnosis, or narrow --r-min and --r-max")
    }
}

/// A reference with what it tells apart, and what r was before it.
#[derive(Debug, Clone)]
struct Tried {
    shape: Shape,
    r: Vec<f64>,
    separation: Separation,
    before: Vec<f64>,
}

/// Samples of an experiment, and of the recording before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Length {
    samples: usize,
    before: usize,
}

impl Pair {
    fn is_of(&self, other: &Self) -> bool {
        (self.truth, self.rival) == (other.truth, other.rival)
    }
}

/// The chance below which a pair counts as not told apart.
const NOT_TOLD: f64 = 0.5;

impl Plan {
    /// The name of a cause.
    pub fn name(&self, place: usize) -> String {
        let term = self.request.open.causes.get(place).and_then(|cause| cause.term.as_ref());
        term.map_or_else(|| "nothing missing".into(), |term| term.kind.name.replace('_', " "))
    }

    /// The least chance with which a cause that is left is named where it is the one.
    pub fn chance(&self) -> f64 {
        self.separation.named.iter().map(|(_, chance)| *chance).fold(1.0, f64::min)
    }

    /// Pairs that it does not tell apart, each once.
    pub fn not_told(&self) -> Vec<(usize, usize)> {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for pair in self.separation.pairs.iter().filter(|pair| pair.chance < NOT_TOLD) {
            let names = (pair.truth.min(pair.rival), pair.truth.max(pair.rival));
            if !pairs.contains(&names) {
                pairs.push(names);
            }
        }
        pairs
    }

    /// Whether no two of the causes that are left are told apart; where one alone is left, it and all that it is held against.
    pub fn tells_nothing(&self) -> bool {
        let is_left = |place: usize| self.request.open.causes.get(place).is_some_and(|cause| cause.is_left);
        let pairs = || self.separation.pairs.iter();
        let between = pairs().filter(|pair| is_left(pair.truth) && is_left(pair.rival)).count() > 0;
        let not_told = self.not_told();
        pairs()
            .filter(|pair| !between || (is_left(pair.truth) && is_left(pair.rival)))
            .all(|pair| not_told.contains(&(pair.truth.min(pair.rival), pair.truth.max(pair.rival))))
    }

    /// Whether the log from before the experiment is part of what is diagnosed next.
    pub fn is_continued(&self) -> bool {
        self.before_s > 0.0
    }

    /// Length, in seconds.
    pub fn duration_s(&self) -> f64 {
        self.r.len() as f64 * self.request.stated.sample_time_s
    }

    /// The cause that the recording speaks for most, of those that are left.
    pub fn likeliest(&self) -> Option<&Signals> {
        let gain = |place: usize| self.request.open.causes.get(place).map_or(0.0, |cause| cause.gain);
        self.answers.iter().max_by(|a, b| gain(a.0).total_cmp(&gain(b.0))).map(|(_, answer)| answer)
    }

    /// The reference as CSV: t, r, and y and u as the likeliest cause would answer, which is where `drift simulate --reference` begins.
    pub fn csv(&self) -> String {
        let mut text = b"t,r,y,u\n".to_vec();
        let ts = self.request.stated.sample_time_s;
        let Some(answer) = self.likeliest() else { return String::new() };
        for (n, ((r, y), u)) in self.r.iter().zip(&answer.y).zip(&answer.u).enumerate() {
            crate::shortest::push(&mut text, crate::simulate::time_s(n, ts));
            for value in [r, y, u] {
                text.push(b',');
                crate::shortest::push(&mut text, *value);
            }
            text.push(b'\n');
        }
        String::from_utf8(text).unwrap_or_default()
    }
}
