//! What the closed loop says of a fit: whether something is still unexplained, and whether a term matters and helps there.
//!
//! A prediction error may show what no user of the loop would ever notice, such as how another simulator discretises; the closed
//! loop is what is proved, so a term must move it.

use crate::control_loop::Loop;

use super::Case;
use super::fit::{Fit, mean_square};
use super::missing_drive;
use super::model::Model;
use super::prove::{self, FitPct};
use super::signals::{Signals, deviation};

/// Share of u that a term must move in closed loop to matter; and the part of what sensor noise does to u. On clean
/// generated loops what the search still finds, from how another simulator discretises, moves u by 0.0003 and 0.19 of the noise.
const LEAST_EFFECT: f64 = 0.002;
const OF_NOISE: f64 = 0.25;
/// Squared closed-loop error, over that which sensor noise alone makes, up to which nothing is looked for.
const FLOOR: f64 = 1.1;
/// Relative closed-loop error beyond it, below which nothing is looked for.
const LEAST_ERROR: f64 = 0.003;
/// The same from which something must be missing.
const FAR_FLOOR: f64 = 4.0;
const FAR_ERROR: f64 = 0.03;
/// Part of the variance of y that a prediction with the term may leave: of a loop in which only noise moves nothing is named.
const UNPREDICTED: f64 = 0.5;
/// Factor by which the first term may raise the closed loop's error on the hold-out: chance alone; and the factor to which a further
/// one, looked for because the closed loop is not explained yet, must lower it.
const WORSE: f64 = 1.02;
const BETTER: f64 = 0.98;

impl Case<'_> {
    /// Whether the closed loop is further from what was measured than noise would bring it, on either part of the data.
    pub(super) fn unexplained(&self, fit: &Fit) -> bool {
        let parts = [self.train, self.holdout];
        parts.iter().any(|signals| self.beyond(fit, signals, FLOOR, LEAST_ERROR).unwrap_or(true))
    }

    /// Whether it is so far off, on both parts, that something must be missing whatever is named.
    pub(super) fn far_off(&self, fit: &Fit) -> bool {
        let parts = [self.train, self.holdout];
        parts.iter().all(|signals| self.beyond(fit, signals, FAR_FLOOR, FAR_ERROR).unwrap_or(true))
    }

    fn beyond(&self, fit: &Fit, signals: &Signals, of_floor: f64, least: f64) -> Option<bool> {
        let (model, _) = fit.model.loop_at(&fit.model.x)?;
        let far = error(fit_pct(&model, signals)?);
        // Only what changes faster than a plant can is sure to be noise.
        let floor = error(noise_floor(&model, missing_drive::noise_floor(&fit.residual), signals)?);
        Some(far * far > of_floor * floor * floor + least * least)
    }

    /// Why a term of a model that the recordings speak for does not stand all the same; `None` where it stands.
    pub(super) fn veto(&self, base: &Fit, with: &Fit) -> Option<&'static str> {
        if mean_square(&with.residual) > UNPREDICTED * libm::pow(deviation(&self.train.y), 2.0) {
            return Some("with it most of y is noise still: too little moves to tell");
        }
        if !self.matters(base, with) {
            return Some("what it does to u in the closed loop is lost in what sensor noise does");
        }
        (!self.helps(base, with)).then_some("with it the closed loop comes no closer to the hold-out")
    }

    /// Whether the closed loop of the hold-out comes no further from what was measured.
    pub(super) fn helps(&self, base: &Fit, with: &Fit) -> bool {
        // A constant load may lie under the search.
        let named = base.model.nominal.physics.iter().skip(self.nominal.physics.len());
        let is_first = named.filter(|term| term.kind.name != "load_step").count() == 0;
        match (error_at(&base.model, self.holdout), error_at(&with.model, self.holdout)) {
            (Some(before), Some(after)) => after < if is_first { WORSE } else { BETTER } * before,
            (before, after) => before.is_none() && after.is_some(),
        }
    }

    /// Whether the closed loop's u depends on the term by a part that matters, on either part of the data.
    pub(super) fn matters(&self, base: &Fit, with: &Fit) -> bool {
        let moved = |signals: &Signals| {
            let run = |fit: &Fit| {
                let (model, _) = fit.model.loop_at(&fit.model.x)?;
                Some((prove::run(&model, signals, 0)?, model))
            };
            let (after, model) = run(with)?;
            let Some((before, _)) = run(base) else { return Some(true) };
            let noise = missing_drive::noise_floor(&with.residual);
            let floor = OF_NOISE * error(noise_floor(&model, noise, signals)?);
            let difference = prove::difference(&after, &before, self.nominal);
            Some(difference * difference > LEAST_EFFECT * LEAST_EFFECT + floor * floor)
        };
        [self.train, self.holdout].into_iter().any(|signals| moved(signals).unwrap_or(false))
    }
}

/// Fit of the closed loop.
pub(super) fn fit_pct(model: &Loop, signals: &Signals) -> Option<FitPct> {
    Some(prove::fit_of(model, &prove::run(model, signals, 0)?, signals))
}

/// Relative error of u, of y where the law is not known.
pub(super) fn error(fit: FitPct) -> f64 {
    0.01 * fit.error()
}

/// The same of the closed loop of a model at its point.
pub(super) fn error_at(model: &Model, signals: &Signals) -> Option<f64> {
    let (model, _) = model.loop_at(&model.x)?;
    Some(error(fit_pct(&model, signals)?))
}

/// How well the improved model fits itself under sensor noise of the size seen.
pub(super) fn noise_floor(improved: &Loop, variance: f64, signals: &Signals) -> Option<FitPct> {
    let quiet = prove::run(improved, signals, 0)?;
    let mut noisy = improved.clone();
    noisy.sensor.noise = libm::sqrt(variance);
    let trace = prove::run(&noisy, signals, 1)?;
    let measured = Signals { y: trace.y, u: trace.u, ..signals.clone() };
    Some(prove::fit_of(improved, &quiet, &measured))
}
