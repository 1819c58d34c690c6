//! A constant load under a servo. The other plants have an offset among their own numbers, or take one up in their
//! state; a servo has none, and a load that is there from the start bends every term that is fitted without it. It is
//! therefore laid under the search and judged at its end like any other term.

use crate::physics::Term;
use crate::plant::Plant;

use super::fit::Fit;
use super::model::Target;
use super::signals::{Signals, deviation};
use super::whiten::Whitener;

/// The fit's point with a small constant load beside, not yet refitted; `None` where the plant has an offset of its own or a load is stated.
pub fn under(fit: &Fit, signals: &Signals) -> Option<Fit> {
    let nominal = &fit.model.nominal;
    let has_one = nominal.physics.iter().any(|term| term.kind.name == "load_step");
    if has_one || !matches!(nominal.plant, Plant::Servo(_)) {
        return None;
    }
    // A small one, so that its scale is the drive's and not the number one.
    let little = 1e-3 * deviation(&signals.u) * nominal.plant.drive_gain().abs();
    let load = Term::new("load_step", &[("level", little)]).ok()?;
    let model = fit.model.with_term(&load, false, signals.duration_s());
    Fit::start(&model, signals, &Whitener::none())
}

/// The level of the constant load among the free numbers of a fit, in the drive's unit; 0 where there is none.
pub fn laid_under(fit: &Fit) -> f64 {
    let physics = &fit.model.nominal.physics;
    let load = physics.iter().position(|term| term.kind.name == "load_step" && term.onset_s == 0.0);
    load.and_then(|term| fit.value(Target::Term { term, parameter: 0 })).unwrap_or(0.0)
}
