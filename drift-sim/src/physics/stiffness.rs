//! A spring towards zero (a hose, a cable, a return spring): force `stiffness*x` against the displacement.

use super::{
    Begins, Effect, Family, Hook, Kind, Motion, Parameter, Place, Range, Starts, any_values, grid, is_servo,
    shown,
};

pub(super) static KIND: Kind = Kind {
    name: "stiffness",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[Parameter::new("stiffness", "{drive}/{position}", Range::Any, |s, _| s.drive / s.position)
        .of_signals()],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(Stiffness { stiffness: p[0] }),
    // Friction that sticks hides a small spring's slope: each size is tried by itself.
    search: Starts::Grid(|s| {
        let points = [0.3, 1.0, 3.0, 0.1, 0.03].into_iter().flat_map(|part| [part, -part]);
        grid(points, |part| vec![part * s.drive / s.position])
    }),
    family: Some(Family::Spring),
    excitation: "Holding at two or more positions.",
    ties: &["gravity"],
    experiment: "Hold at several positions over the whole range: a spring's effort is a straight line, gravity's a sine.",
    says: |p, units| {
        format!(
            "A spring of {} pulls towards zero; the model has none.",
            shown(p[0], &units.unit("{drive}/{position}"))
        )
    },
};

#[derive(Clone)]
struct Stiffness {
    stiffness: f64,
}

impl Effect for Stiffness {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Force]
    }

    fn force(&self, motion: Motion) -> f64 {
        -self.stiffness * motion.position
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
