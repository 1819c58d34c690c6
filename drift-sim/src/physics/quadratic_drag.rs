//! Drag that grows with the square of the speed (fans, ships, fast vehicles): `coefficient*v*|v|` against the motion.

use super::{
    Begins, Effect, Hook, Kind, Motion, Parameter, Place, Range, Starts, any_values, grid, is_servo, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "quadratic_drag",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[Parameter::new("coefficient", "{drive}/{speed}^2", Range::NotNegative, |s, _| {
        s.drive / (s.speed * s.speed)
    })],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(QuadraticDrag { coefficient: p[0] }),
    search: Starts::Grid(|s| grid([0.1, 0.5], |part| vec![part * s.drive / (s.speed * s.speed)])),
    family: None,
    excitation: "Motion at two or more speeds that differ by a factor of two.",
    ties: &["viscous_friction"],
    experiment: "Hold three constant speeds: the effort grows with the square of the speed, not in proportion.",
    says: |p, units| {
        format!(
            "A drag of {} times the speed squared opposes the motion; the model has none.",
            shown(p[0], &units.unit("{drive}/{speed}^2"))
        )
    },
};

#[derive(Clone)]
struct QuadraticDrag {
    coefficient: f64,
}

impl Effect for QuadraticDrag {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Force]
    }

    fn force(&self, motion: Motion) -> f64 {
        -self.coefficient * motion.velocity * motion.velocity.abs()
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
