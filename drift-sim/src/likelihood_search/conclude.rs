//! From the end of a search to what is reported: the verdict, the named terms and numbers with their intervals, and what was not found with the size from
//! which it would have been.

use crate::control_loop::Loop;
use crate::diagnose::cause::Cause;
use crate::diagnose::load_jumps::LoadJumps;
use crate::diagnose::load_waves::LoadWaves;
use crate::diagnose::locate::{self as old_locate};
use crate::diagnose::missing_drive::MissingDrive;
use crate::diagnose::named::EXCLUDES_NOTHING;
use crate::diagnose::prove::FitPct;
use crate::diagnose::{Diagnosis, Fits, Named, Refitted, Rejected, Verdict, cycle};
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::likelihood::Data;
use crate::estimate::signals::Signals;
use crate::physics::{Parameter, Term};
use crate::plant::Role;

use super::excitation::{self, Shows};
use super::found::Found;
use super::law::{Law, OTHER_NUMBER};
use super::options::Options;
use super::unseen::{Unseen, fit_pct, noise_floor};
use super::{identified, interval, locate, missing_drive, offset, prove, standing_load};

/// From the end of a search to what is reported.
pub struct Conclusion<'a> {
    /// The loop as stated.
    pub stated: &'a Loop,
    /// What was found of its law.
    pub law: Law,
    /// What numbers were fitted to, of the first recording.
    pub train: &'a Signals,
    /// What proves.
    pub unseen: Option<&'a Unseen>,
    /// Deviation of the sensor's noise.
    pub sensor_sd: f64,
    /// How many samples the search took as one.
    pub factor: usize,
    /// Samples that were left out.
    pub not_used: usize,
    /// The end of the search.
    pub result: Found,
    /// The recordings.
    pub data: &'a Data,
    /// Whether the plant came from them.
    pub is_guessed: bool,
    /// The numbers that decide.
    pub options: &'a Options,
}

/// Part of the way to the number at which a term does nothing that its interval goes at most, where the likelihood excludes that.
const SHORT_OF_NEUTRAL: f64 = 0.99;
/// What refitted numbers must gain to be called other numbers, in log-likelihood, and by how much of its error the closed loop must come
/// closer, on what nothing has seen as well.
const REFIT_GAIN: f64 = 20.0;
const REFIT_CLOSER: f64 = 0.1;
/// Half width of a coarse sensor's step, as part of it: the file's digits round it.
const STEP_WIDTH: f64 = 1e-3;
/// The least closed-loop error, in per cent of u, in which a difference means anything.
const REFIT_LEAST: f64 = 0.5;
/// Part of y's variance that the model must predict over some time for its absence of a mismatch to mean anything.
const TELLS: f64 = 0.3;
/// Half width, as part of it, of the number by which u drives an unknown plant, from which on the recording does not tell that y follows u at all. Of 62
/// healthy loops with an unknown plant 61 have 0.2 at most, and one 1.8 (`.ci/wide`, seeds 608 to 614); an oscillator that was found in a loop which only holds has 0.75.
const FOLLOWS_U: f64 = 0.5;

impl Diagnosis {
    /// The same with nothing named: what would have been is a candidate.
    pub(super) fn undecided(self) -> Self {
        let mut candidates = self.candidates;
        candidates.extend(self.physics.iter().map(|named| (named.term.kind.name, named.train_gain)));
        let fits = |fits: Fits| Fits { after: fits.before, ..fits };
        Self {
            verdict: Verdict::Undecided,
            place: None,
            causes: self.causes.into_iter().map(Cause::or_nothing).collect(),
            spans: Vec::new(),
            depends_on: Vec::new(),
            physics: Vec::new(),
            candidates,
            train: fits(self.train),
            holdout: fits(self.holdout),
            improvement: None,
            improved: self.refitted.clone(),
            drive_left: None,
            ..self
        }
    }
}

/// The loop of a fit as a loop file would have it, in the samples of the stated one.
pub fn loop_of(fit: &Fit, stated: &Loop) -> Loop {
    let found = realised(fit, stated);
    found.map_or_else(|| stated.clone(), |(model, load)| as_file(&model, load))
}

/// The same, its load that stays a term beside the stated offset.
fn under_load(fit: &Fit, stated: &Loop) -> Loop {
    realised(fit, stated).map_or_else(|| stated.clone(), |(model, load)| loaded(model, load))
}

/// The loop of a fit in the samples of the stated one, and the load that stays.
fn realised(fit: &Fit, stated: &Loop) -> Option<(Loop, f64)> {
    let realised = fit.hypothesis.realise(&fit.point)?;
    Some((Loop { sample_time_s: stated.sample_time_s, ..realised.model }, realised.constant_load))
}

impl Conclusion<'_> {
    /// The diagnosis.
    pub fn diagnosis(self) -> Diagnosis {
        let train = self.train;
        let held = self.unseen.map_or(train, Unseen::first);
        let model_of = |fit: &Fit| loop_of(fit, self.stated);
        let base = &self.result.base;
        let best = self.result.best.as_ref().unwrap_or(base);
        let sample_time_s = self.stated.sample_time_s;
        let nominal = base.hypothesis.model.clone();
        let as_stated = |model: Loop| Loop {
            controller: self.stated.controller.clone(),
            sample_time_s,
            physics: model.physics.into_iter().filter(|term| !self.law.terms.contains(term)).collect(),
            ..model
        };
        let (nominal, refitted) = (as_stated(nominal), as_stated(model_of(base)));
        let mut improved =
            if self.result.standing_load.is_some() { under_load(best, self.stated) } else { model_of(best) };
        improved.sensor.noise = self.sensor_sd;
        let mut physics = self.law_terms(train);
        physics.extend(self.result.quantum.iter().map(|term| Named {
            term: term.clone(),
            half_widths: term.parameters.iter().map(|step| STEP_WIDTH * step).collect(),
            tied: Vec::new(),
            first: None,
            train_gain: self.result.base.rows.count as f64,
            holdout_errors: f64::INFINITY,
        }));
        improved.physics.extend(self.result.quantum.clone());
        let widths = interval::half_widths(best, self.data);
        physics.extend(self.named(best, &widths));
        let fits = |fit: &dyn Fn(&Loop) -> Option<FitPct>| Fits {
            nominal: fit(&nominal),
            before: fit(&refitted),
            after: fit(&improved),
        };
        let train_fits = fits(&|model| fit_pct(model, train));
        let holdout_fits = self.unseen.map(|unseen| fits(&|model| unseen.fit(model))).unwrap_or_default();
        let parameters = self.parameters(best, &widths);
        let other_numbers = !self.law.numbers.is_empty()
            || (!self.is_guessed && self.numbers_are_other(base, &train_fits, &holdout_fits));
        let is_told = self.result.predicted >= TELLS && (!self.is_guessed || follows_u(best, &widths));
        let verdict = self.verdict(&physics, other_numbers, is_told);
        let shows = excitation::shows(best, self.data, self.options);
        let (rejected, untestable) = self.lost(&physics, &shows);
        let missing_drive = missing_drive::of(base, self.data, self.factor);
        let drive_left =
            self.result.best.as_ref().and_then(|best| missing_drive::of(best, self.data, self.factor));
        let mismatch = !matches!(verdict, Verdict::NoMismatch | Verdict::Undecided);
        let place = match verdict {
            Verdict::MissingPhysics => physics.first().map(|named| named.term.kind.place),
            Verdict::Located | Verdict::Parameters => self.law.place().or_else(|| self.result.place()),
            Verdict::NoMismatch | Verdict::Undecided => None,
        };
        let samples = train.len();
        let dependence = missing_drive.as_ref().filter(|_| mismatch).map(|missing| {
            let value = missing.value.get(..samples.min(missing.value.len())).unwrap_or(&[]).to_vec();
            old_locate::depends_on(&nominal, &MissingDrive { value, deviation: 0.0 }, train)
        });
        Diagnosis {
            verdict,
            place,
            spans: self
                .result
                .best
                .as_ref()
                .map(|best| locate::spans(base, best, &train.coarser(self.factor)))
                .unwrap_or_default(),
            depends_on: dependence.unwrap_or_default(),
            not_used: self.not_used,
            candidates: if verdict == Verdict::MissingPhysics { Vec::new() } else { self.result.set.clone() },
            rivals: self.result.rivals.clone(),
            causes: self.causes(verdict),
            parameters,
            rejected,
            untestable,
            train: train_fits,
            holdout: holdout_fits,
            improvement: self.unseen.and_then(|unseen| unseen.improvement(&refitted, &improved)),
            cycle_s: cycle::period(held).map(|samples| samples as f64 * held.sample_time_s),
            noise_floor: noise_floor(&improved, self.sensor_sd, self.unseen, train),
            physics,
            nominal,
            refitted,
            improved,
            drive_left,
            controller: self.law.replay,
            missing_drive,
            load_jumps: LoadJumps::of(best, self.data),
            load_waves: LoadWaves::of(self.data),
            far_off: false,
        }
    }

    /// What an experiment would have to tell apart: nothing, what is left, and what came next.
    fn causes(&self, verdict: Verdict) -> Vec<Cause> {
        let contenders = &self.result.contenders;
        // Where nothing gains enough and nothing is proven, nothing is excluded either; and a kind that is left alone and not named stands in for another.
        let left = contenders.iter().filter(|contender| contender.is_left).count();
        let all_are_left = left == 0 || (left == 1 && verdict == Verdict::Located);
        let of =
            |fit: &Fit, gain: f64, is_left: bool| Cause::of(fit, self.stated, self.factor, gain, is_left);
        let nothing = of(&self.result.base, 0.0, verdict == Verdict::Undecided);
        let kinds = contenders
            .iter()
            .filter_map(|contender| of(&contender.fit, contender.score, contender.is_left || all_are_left));
        nothing.into_iter().chain(kinds).collect()
    }

    fn law_terms(&self, train: &Signals) -> Vec<Named> {
        let half_width = |term: &Term| match term.kind.name {
            "controller_delay" => 0.5 * train.sample_time_s,
            "controller_gain" => OTHER_NUMBER * term.parameters.first().copied().unwrap_or(1.0),
            _ => 0.01 * train.u.iter().fold(0.0, |most: f64, u| most.max(u.abs())),
        };
        let named = |term: &Term| Named {
            term: term.clone(),
            half_widths: term.parameters.iter().map(|_| half_width(term)).collect(),
            tied: Vec::new(),
            first: None,
            train_gain: train.len() as f64,
            holdout_errors: f64::INFINITY,
        };
        self.law.terms.iter().map(named).collect()
    }

    /// What the search named, with intervals.
    fn named(&self, best: &Fit, widths: &[f64]) -> Vec<Named> {
        let Some(realised) = best.hypothesis.realise(&best.point) else { return Vec::new() };
        let mut all: Vec<Named> = self
            .result
            .named
            .iter()
            .enumerate()
            .filter_map(|(candidate, choice)| {
                let index = best.hypothesis.stated + candidate;
                let term = realised.model.physics.get(index)?.clone();
                let told = |(parameter, about): (usize, &Parameter)| {
                    let place = best.hypothesis.place(Target::Term { term: index, parameter });
                    let width = place.and_then(|i| widths.get(i)).copied().unwrap_or(f64::INFINITY);
                    // Of a number that is known no better than its range says the recording tells nothing.
                    if width < about.range.length() { width } else { f64::INFINITY }
                };
                let mut half_widths: Vec<f64> = term.kind.parameters.iter().enumerate().map(told).collect();
                if choice.gain > EXCLUDES_NOTHING {
                    keep_from_neutral(&term, &mut half_widths);
                }
                Some(Named {
                    term,
                    half_widths,
                    tied: choice.tied.clone(),
                    first: None,
                    train_gain: choice.gain,
                    // Infinite where nothing is held out.
                    holdout_errors: choice.unseen.map_or(f64::INFINITY, prove::Gained::errors),
                })
            })
            .collect();
        all.extend(self.standing_load(best, realised.constant_load, widths));
        all.sort_by(|a, b| b.train_gain.total_cmp(&a.train_gain));
        all
    }

    /// The load that stays, where it is named.
    fn standing_load(&self, best: &Fit, level: f64, widths: &[f64]) -> Option<Named> {
        let choice = self.result.standing_load.as_ref()?;
        let place = best.hypothesis.place(Target::ConstantLoad)?;
        Some(Named {
            term: Term::new(standing_load::KIND, &[("level", level)]).ok()?,
            half_widths: vec![widths.get(place).copied().unwrap_or(f64::INFINITY)],
            tied: choice.tied.clone(),
            first: None,
            train_gain: choice.gain,
            holdout_errors: choice.unseen.map_or(f64::INFINITY, prove::Gained::errors),
        })
    }

    fn verdict(&self, physics: &[Named], other_numbers: bool, is_told: bool) -> Verdict {
        if !physics.is_empty() {
            Verdict::MissingPhysics
        } else if !self.result.set.is_empty() && self.result.is_proven {
            Verdict::Located
        } else if other_numbers && self.result.set.is_empty() {
            Verdict::Parameters
        } else if !self.result.set.is_empty() || !is_told {
            Verdict::Undecided
        } else {
            Verdict::NoMismatch
        }
    }

    /// The plant's numbers and the load that stays, before and after; then those of the law.
    fn parameters(&self, best: &Fit, widths: &[f64]) -> Vec<Refitted> {
        let mut rows = identified::numbers(best, widths);
        // What is named as a term is no number of the plant besides.
        rows.retain(|row| {
            self.result.standing_load.is_none() || !["load", "plant.offset"].contains(&row.name.as_str())
        });
        rows.extend(self.law.numbers.iter().map(|(name, nominal, value)| Refitted {
            name: name.clone(),
            nominal: *nominal,
            value: *value,
            half_width: 0.0,
        }));
        rows
    }

    /// Whether the plant's numbers are other than stated by more than anyone would notice: the refit gains, and brings the closed loop closer.
    fn numbers_are_other(&self, base: &Fit, train: &Fits, holdout: &Fits) -> bool {
        let closer = |fits: &Fits| match (fits.nominal, fits.before) {
            (Some(nominal), Some(before)) => {
                let error = FitPct::error;
                let (a, b) = (error(nominal), error(before));
                a - b > REFIT_CLOSER * a && a - b > REFIT_LEAST
            }
            (None, Some(_)) => true,
            _ => false,
        };
        let moved: f64 = base.hypothesis.prior_rows(&base.point).map(|row| row * row).sum();
        moved.is_finite()
            && self.result.refit_gain > REFIT_GAIN
            && closer(train)
            && (holdout.nominal.is_none() || closer(holdout))
    }

    /// Kinds that lost, and kinds of which the recording says nothing; a tie is neither.
    fn lost(
        &self,
        physics: &[Named],
        shows: &[(&'static crate::physics::Kind, Shows)],
    ) -> (Vec<Rejected>, Vec<Rejected>) {
        let tied = |kind: &str| {
            physics.iter().any(|named| named.term.kind.name == kind || named.tied.contains(&kind))
                || self.result.set.iter().any(|(of, _)| *of == kind)
        };
        let (mut rejected, mut untestable) = (Vec::new(), Vec::new());
        for (kind, gain) in &self.result.rivals {
            if tied(kind) {
                continue;
            }
            let shown = shows.iter().find(|(of, _)| of.name == *kind).map(|(_, shows)| shows);
            match shown {
                Some(Shows::Nothing) if *gain < self.options.least_gain => untestable.push(Rejected {
                    kind,
                    why: "too little moves here for it to show".into(),
                    smallest: None,
                }),
                shown => rejected.push(Rejected {
                    kind,
                    why: gained(*gain),
                    smallest: match shown {
                        Some(Shows::From(term)) => Some(term.clone()),
                        _ => None,
                    },
                }),
            }
        }
        for kind in crate::physics::KINDS
            .iter()
            .filter(|kind| !(kind.applies)(&self.result.base.hypothesis.model.plant))
        {
            untestable.push(Rejected {
                kind: kind.name,
                why: "it can't act on this plant".into(),
                smallest: None,
            });
        }
        (rejected, untestable)
    }
}

/// Whether y follows u in a fit: the surest of the numbers by which u drives the plant is known to within [`FOLLOWS_U`] of itself.
fn follows_u(fit: &Fit, widths: &[f64]) -> bool {
    let drives = |role: Role| matches!(role, Role::Gain | Role::Inertia | Role::Viscous);
    let rows = fit.hypothesis.free.iter().zip(&fit.point.x).zip(widths);
    rows.filter(|((free, _), _)| match free.target {
        Target::Plant(place) => fit.hypothesis.numbers.get(place).is_some_and(|number| drives(number.role)),
        _ => false,
    })
    .any(|((free, x), width)| *width < FOLLOWS_U * free.value(*x).abs())
}

/// Ends the interval of a term's only number, or of the only one of which anything is told, before it reaches the one at which the term does nothing: without
/// the term the recording is far less likely. A curvature knows nothing of that where another number takes up small changes (dry friction, and a load, of what
/// only moves one way until it stops).
fn keep_from_neutral(term: &Term, half_widths: &mut [f64]) {
    let told = term.kind.parameters.iter().zip(&term.parameters).zip(half_widths);
    let mut told = told.filter(|(_, width)| width.is_finite());
    if let (Some(((parameter, number), width)), None) = (told.next(), told.next())
        && parameter.may_be_neutral(*number, *width)
    {
        *width = SHORT_OF_NEUTRAL * (number - parameter.neutral).abs();
    }
}

/// What a kind that lost gains over the refitted model, in log-likelihood.
fn gained(gain: f64) -> String {
    match gain {
        gain if gain >= 0.05 => format!("gains {gain:.1} in log-likelihood over the refitted model"),
        gain if gain > -0.05 => "gains nothing over the refitted model".into(),
        _ => "fits worse than the refitted model".into(),
    }
}

/// A loop with the load that stays, as a file states it: the plant's own offset, or a load from the start.
pub fn as_file(model: &Loop, constant_load: f64) -> Loop {
    match offset::under(model, constant_load) {
        Some(offset) => Loop { plant: offset::with(&model.plant, offset), ..model.clone() },
        None => loaded(model.clone(), constant_load),
    }
}

/// A loop under a load from the start.
fn loaded(mut model: Loop, load: f64) -> Loop {
    if load != 0.0 {
        model.physics.extend(Term::new(standing_load::KIND, &[("level", load)]));
    }
    model
}
