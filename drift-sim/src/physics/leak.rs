//! A loss that grows with y: `-coefficient*y` on the drive (a leak, heat through a wall, back pressure).

use super::{
    Begins, Effect, Family, Hook, Kind, Motion, Parameter, Place, Range, Starts, Weight, any_values, shown,
};
use crate::plant::Plant;

pub(super) static KIND: Kind = Kind {
    name: "leak",
    place: Place::Plant,
    begins: Begins::Either,
    parameters: &[
        Parameter::new("coefficient", "{drive}/{y}", Range::NotNegative, |s, _| s.drive / s.y).of_signals()
    ],
    applies: |plant| !matches!(plant, Plant::Servo(_)),
    consistent: any_values,
    effect: |p, _| Box::new(Leak { coefficient: p[0] }),
    search: Starts::Onset(Weight::Output),
    family: Some(Family::Offset),
    excitation: "Holding at two or more levels.",
    ties: &["radiation", "gain_loss", "load_step"],
    experiment: "Hold three levels far apart: a leak's extra effort is proportional to the level.",
    says: |p, units| {
        format!(
            "A loss of {} times y drains the plant; the model has none.",
            shown(p[0], &units.unit("{drive}/{y}"))
        )
    },
};

#[derive(Clone)]
struct Leak {
    coefficient: f64,
}

impl Effect for Leak {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Force]
    }

    fn force(&self, motion: Motion) -> f64 {
        -self.coefficient * motion.position
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
