//! Dry friction that grows with the force that the drive train transmits (gears, screws):
//! `coefficient*|transmitted|`, where the transmitted force is half the difference of the actuator's force and the
//! outside forces (load, gravity, springs), that is, the force through the middle of the train; at rest under a
//! load it is the load.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, any_values, grid, is_servo, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "load_dependent_friction",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[Parameter::new("coefficient", "1", Range::NotNegative, |_, _| 1.0).searched(0.0, 10.0)],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(LoadDependentFriction { coefficient: p[0] }),
    search: Starts::Grid(|_| grid([0.01, 0.03, 0.1, 0.3, 0.6], |part| vec![part])),
    family: Some(Family::Friction),
    excitation: "Motion under different loads.",
    ties: &["coulomb_friction", "gain_loss"],
    experiment: "Repeat the same slow motion with and without a known payload.",
    says: |p, _| {
        format!(
            "Dry friction of {} times the transmitted force opposes the motion; the model has none.",
            shown(p[0], "1")
        )
    },
};

#[derive(Clone)]
struct LoadDependentFriction {
    coefficient: f64,
}

impl Effect for LoadDependentFriction {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::VaryingFriction]
    }

    fn friction(&self, _: f64, _: f64, transmitted: f64) -> f64 {
        self.coefficient * transmitted.abs()
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
