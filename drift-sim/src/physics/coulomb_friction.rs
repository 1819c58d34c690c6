//! Coulomb friction: dry friction that does not depend on speed. Force `level*sign(v)` against the motion; at rest
//! it holds against anything up to `level`.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, any_values, grid, is_servo, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "coulomb_friction",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[Parameter::new("level", "{drive}", Range::NotNegative, |s, _| s.drive)
        .of_signals()
        .rough()],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(CoulombFriction { level: p[0] }),
    search: Starts::Grid(|s| grid([0.01, 0.03, 0.1, 0.3, 0.6, 1.0], |part| vec![part * s.drive])),
    family: Some(Family::Friction),
    excitation: "Motion in both directions, or stops.",
    ties: &["stribeck_friction", "directional_friction", "load_dependent_friction"],
    experiment: "Move slowly and fast, forward and back, with and without load, and let it rest for some seconds in between.",
    says: |p, units| {
        format!("Dry friction of {} opposes the motion; the model has none.", shown(p[0], &units.drive))
    },
};

#[derive(Clone)]
struct CoulombFriction {
    level: f64,
}

impl Effect for CoulombFriction {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Friction]
    }

    fn friction(&self, _: f64, _: f64, _: f64) -> f64 {
        self.level
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
