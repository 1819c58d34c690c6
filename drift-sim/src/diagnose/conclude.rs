//! From the end of a search to what is reported: terms with intervals, faults of sensor and law, parameters, verdict, proof.

use crate::controller::Controller;
use crate::physics::{Kind, Place, Term};
use crate::{Error, Result};

use super::closed_loop::{fit_pct, noise_floor};
use super::controller_replay::ControllerReplay;
use super::fit::Fit;
use super::missing_drive::{self, MissingDrive};
use super::model::{self, Target};
use super::prove::FitPct;
use super::select::{Scored, Winner};
use super::signals::Signals;
use super::whiten::independent_share;
use super::{
    Case, Diagnosis, Fits, LAW_IS_ANOTHER, Named, Refitted, Rejected, Verdict, cycle, excitation, features,
    interval, locate, prove, sensor_effects,
};

/// What refitted numbers must gain to be called other numbers.
const REFIT_GAIN: f64 = 20.0;

/// Part of the error of u that refitted numbers must take away, on what was fitted and on unseen data, to be called other numbers:
/// below it nobody would notice.
const REFIT_CLOSER: f64 = 0.1;

/// Fit of unseen y, per cent, that an identified plant must reach for anything to be said: half of the variance.
const FOLLOWED: f64 = 29.3;

/// Where a search ended.
pub(super) struct Ending {
    /// The loop file's numbers.
    pub stated: Fit,
    /// The same refitted.
    pub refit: Fit,
    /// With the named terms.
    pub base: Fit,
    /// What was named, in the order of the model's terms.
    pub named: Vec<Winner>,
    /// Where something is that can't be named.
    pub located: Option<Place>,
    pub rejected: Vec<Rejected>,
    /// The missing drive of the refitted nominal model.
    pub missing: Option<MissingDrive>,
    pub controller: Option<ControllerReplay>,
}

impl Case<'_> {
    pub(super) fn conclude(&self, ending: Ending) -> Result<Diagnosis> {
        let Ending { stated, refit, base, named, located, rejected, missing, controller } = ending;
        let widths = interval::half_widths(&base, self.train);
        let lost = || Error::new("the fitted model can't be simulated");
        let (improved, _) = base.model.loop_at(&base.model.x).ok_or_else(lost)?;
        let (refitted, _) = refit.model.loop_at(&refit.model.x).ok_or_else(lost)?;
        let physics: Vec<Named> = named
            .iter()
            .enumerate()
            .map(|(index, Winner { scored, tied })| Named {
                term: improved.physics.get(self.nominal.physics.len() + index).cloned().unwrap_or_else(
                    || Term {
                        kind: scored.candidate.kind,
                        parameters: Vec::new(),
                        onset_s: 0.0,
                        spans: Vec::new(),
                    },
                ),
                half_widths: term_widths(
                    &base,
                    &widths,
                    self.nominal.physics.len() + index,
                    scored.candidate.kind,
                ),
                first: first_named(scored, self.nominal.physics.len() + index),
                tied: tied.clone(),
                train_gain: scored.train_gain,
                holdout_errors: scored.holdout_errors,
            })
            .collect();
        let mut physics = physics;
        if physics.len() > 1
            && named.first().is_some_and(|first| first.scored.candidate.kind.name == "load_step")
        {
            // It was laid under the others, which are stronger.
            physics.rotate_left(1);
        }
        let (mut improved, mut located) = (improved, located);
        let continued = self.whole.len() > self.train.len();
        // Of a guessed plant neither is asked.
        let rounding =
            if self.guessed { None } else { sensor_effects::grid(&base, self.train, self.holdout) };
        let far_off = !self.guessed
            && match &rounding {
                Some(rounding) => self.far_off(&rounding.beside(&base)),
                None => self.far_off(&base),
            };
        let sensor = || sensor_effects::find(&base, rounding, self.train, self.holdout, continued);
        // Beside what no term explains, noise can't be judged.
        for effect in if self.guessed || far_off { Vec::new() } else { sensor() } {
            improved.physics.push(effect.term.clone());
            physics.push(Named::alone(
                effect.term,
                vec![effect.half_width],
                effect.train_gain,
                effect.holdout_errors,
            ));
        }
        if controller.as_ref().is_some_and(|law| law.relative > LAW_IS_ANOTHER) && physics.is_empty() {
            located = Some(Place::Controller);
        }
        if far_off && physics.is_empty() && located.is_none() {
            // The law holds, so that it is on the way from u to y; no term of the library is it.
            located = Some(Place::Loop);
        }
        let parameters = refitted_parameters(&base, &widths);
        let changed = !self.guessed
            && refit_gain(&refit, &stated) > REFIT_GAIN
            && parameters.iter().any(|p| {
                (p.value - p.nominal).abs() > p.half_width && (p.value / p.nominal - 1.0).abs() > 0.005
            });
        let fits = |signals: &Signals| Fits {
            nominal: fit_pct(self.nominal, signals),
            before: fit_pct(&refitted, signals),
            after: fit_pct(&improved, signals),
        };
        let (train, holdout) = (fits(self.train), fits(self.holdout));
        let changed = changed && is_closer(&train) && is_closer(&holdout);
        let verdict = match (physics.is_empty(), located, changed) {
            (false, _, _) => Verdict::MissingPhysics,
            (true, Some(_), _) => Verdict::Located,
            (true, None, true) => Verdict::Parameters,
            (true, None, false) => Verdict::NoMismatch,
        };
        let place = physics.first().map(|p| p.term.kind.place).or(located);
        let known_law = self.nominal.controller != Controller::Recorded;
        let not_followed = match known_law && !physics.is_empty() {
            true => self.far_off(&base),
            false => holdout.after.is_none_or(|fit| fit.y_pct < FOLLOWED),
        };
        let cycle = cycle::period(self.holdout).filter(|_| known_law);
        let improvement =
            match (prove::run(&refitted, self.holdout, 0), prove::run(&improved, self.holdout, 0)) {
                (Some(a), Some(b)) => prove::improvement(&a, &b, self.nominal, self.holdout),
                _ => None,
            };
        let shows = excitation::shows(&base, self.train, &features::scales(self.nominal, self.train));
        let untestable = excitation::untestable(&base, &shows);
        let mut rejected = excitation::with_smallest(rejected, &shows);
        // What lost alone may have been found beside another.
        rejected.retain(|r| physics.iter().all(|named| named.term.kind.name != r.kind));
        let proven = matches!(verdict, Verdict::MissingPhysics | Verdict::Located);
        let drive = proven.then_some(missing.as_ref()).flatten();
        let depends_on = drive.map(|drive| locate::depends_on(self.nominal, drive, self.train));
        Ok(Diagnosis {
            verdict,
            place,
            spans: locate::spans(&refit, &base, self.train),
            depends_on: depends_on.unwrap_or_default(),
            not_used: 0,
            far_off: far_off || (self.guessed && not_followed),
            physics,
            parameters,
            rejected,
            untestable,
            candidates: Vec::new(),
            rivals: Vec::new(),
            causes: Vec::new(),
            train,
            holdout,
            improvement,
            cycle_s: cycle.map(|samples| samples as f64 * self.holdout.sample_time_s),
            noise_floor: noise_floor(&improved, sensor_noise(&base), self.holdout),
            nominal: self.nominal.clone(),
            refitted,
            improved,
            drive_left: self.missing_drive(&base),
            controller,
            missing_drive: missing,
        })
    }
}

/// Whether the closed loop with refitted numbers comes closer by more than anyone would overlook; where it can't be simulated as it
/// came, any number is better.
fn is_closer(fits: &Fits) -> bool {
    let error = FitPct::error;
    match (fits.nominal.map(error), fits.before.map(error)) {
        (Some(stated), Some(refitted)) => stated - refitted > REFIT_CLOSER * stated,
        (None, refitted) => refitted.is_some(),
        (Some(_), None) => false,
    }
}

/// What refitted numbers gain, log-likelihood of independent samples.
fn refit_gain(refit: &Fit, stated: &Fit) -> f64 {
    let stated = if refit.model.whitens() { stated.clone().renoised() } else { stated.clone() };
    independent_share(&refit.white()) * (refit.log_likelihood - stated.log_likelihood)
}

/// Variance of the sensor's noise: without a noise model what is left of the fit is more than that.
fn sensor_noise(base: &Fit) -> f64 {
    if base.model.whitens() {
        base.variance
    } else {
        base.variance.min(missing_drive::noise_floor(&base.residual))
    }
}

/// The term with its numbers as they were when it was named, before others came beside it.
fn first_named(scored: &Scored, index: usize) -> Option<Term> {
    let fit = &scored.candidate.fit;
    let (then, _) = fit.model.loop_at(&fit.model.x)?;
    let same = |term: &&Term| term.kind == scored.candidate.kind;
    // Terms named before may have gone since.
    then.physics.get(index).filter(same).or_else(|| then.physics.iter().rev().find(same)).cloned()
}

fn term_widths(fit: &Fit, widths: &[f64], term: usize, kind: &Kind) -> Vec<f64> {
    (0..kind.parameters.len())
        .map(|parameter| {
            let target = Target::Term { term, parameter };
            let at = fit.model.free.iter().position(|f| f.target == target);
            at.and_then(|i| widths.get(i).copied()).unwrap_or(f64::NAN)
        })
        .collect()
}

fn refitted_parameters(fit: &Fit, widths: &[f64]) -> Vec<Refitted> {
    let nominal = model::plant_numbers(&fit.model.nominal.plant);
    fit.model
        .free
        .iter()
        .zip(&fit.model.x)
        .zip(widths)
        .filter_map(|((free, value), width)| match free.target {
            Target::Plant(i) => Some(Refitted {
                name: free.name.clone(),
                nominal: nominal.get(i).map_or(f64::NAN, |n| n.1),
                value: *value,
                half_width: *width,
            }),
            _ => None,
        })
        .collect()
}
