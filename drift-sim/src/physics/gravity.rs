//! Weight on a lever: force `amplitude*sin(x + phase)` against the drive, x in radians.

use super::{Begins, Effect, Hook, Kind, Motion, Parameter, Place, Range, any_values, is_servo, shown};

pub(super) static KIND: Kind = Kind {
    name: "gravity",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[
        Parameter { name: "amplitude", unit: "{drive}", range: Range::Any },
        Parameter { name: "phase", unit: "rad", range: Range::Any },
    ],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(Gravity { amplitude: p[0], phase: p[1] }),
    starts: |s| {
        (0..4)
            .map(|quarter| vec![0.5 * s.drive_scale, std::f64::consts::FRAC_PI_2 * f64::from(quarter)])
            .collect()
    },
    excitation: "Holding or slow motion over a good part of a turn.",
    ties: &["stiffness", "load_step"],
    experiment: "Hold at several angles over half a turn.",
    says: |p, units| {
        format!("Weight needs up to {} to hold; the model has none.", shown(p[0].abs(), &units.drive))
    },
};

#[derive(Clone)]
struct Gravity {
    amplitude: f64,
    phase: f64,
}

impl Effect for Gravity {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Force]
    }

    fn force(&self, motion: Motion) -> f64 {
        -self.amplitude * libm::sin(motion.position + self.phase)
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
