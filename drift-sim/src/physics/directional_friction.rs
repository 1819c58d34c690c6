//! Friction that differs forward and back: dry friction `coulomb_pos` and `coulomb_neg`, and viscous friction
//! `viscous_pos*v` and `viscous_neg*v` **on top of** the plant's own (so these two may be negative, and all four at zero
//! change nothing).

use super::{
    Begins, Effect, Family, Hook, Kind, Motion, Parameter, Place, Range, Shared, Starts, any_values, grid,
    is_servo, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "directional_friction",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("coulomb_pos", "{drive}", Range::NotNegative, |s, _| s.drive)
            .of_signals()
            .shared_with(Shared::ConstantLoad),
        Parameter::new("coulomb_neg", "{drive}", Range::NotNegative, |s, _| s.drive)
            .of_signals()
            .shared_with(Shared::ConstantLoad),
        Parameter::new("viscous_pos", "{drive}/{speed}", Range::Any, |s, _| s.drive / s.speed)
            .of_signals()
            .shared_with(Shared::Viscous),
        Parameter::new("viscous_neg", "{drive}/{speed}", Range::Any, |s, _| s.drive / s.speed)
            .of_signals()
            .shared_with(Shared::Viscous),
    ],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(DirectionalFriction { coulomb: [p[0], p[1]], viscous: [p[2], p[3]] }),
    search: Starts::Grid(|s| {
        grid([(0.3, 0.3), (0.1, 0.5), (0.5, 0.1)], |(pos, neg)| vec![pos * s.drive, neg * s.drive, 0.0, 0.0])
    }),
    family: Some(Family::Friction),
    excitation: "Motion at several speeds in both directions.",
    ties: &["coulomb_friction"],
    experiment: "Run the same ramp forward and back at two or more speeds: the steady effort differs between the directions.",
    says: |p, units| {
        let [forward, back] = [p[0], p[1]].map(|level| shown(level, &units.drive));
        let rule = units.unit("{drive}/{speed}");
        let [viscous_forward, viscous_back] = [p[2], p[3]].map(|viscous| shown(viscous, &rule));
        format!(
            "Friction differs by direction: dry {forward} forward and {back} back, viscous {viscous_forward} forward and \
             {viscous_back} back on top of the model's."
        )
    },
};

#[derive(Clone)]
struct DirectionalFriction {
    coulomb: [f64; 2],
    viscous: [f64; 2],
}

impl Effect for DirectionalFriction {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Friction, Hook::Force]
    }

    fn friction(&self, direction: f64, _: f64, _: f64) -> f64 {
        if direction > 0.0 { self.coulomb[0] } else { self.coulomb[1] }
    }

    fn force(&self, motion: Motion) -> f64 {
        let viscous = if motion.velocity > 0.0 { self.viscous[0] } else { self.viscous[1] };
        -viscous * motion.velocity
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
