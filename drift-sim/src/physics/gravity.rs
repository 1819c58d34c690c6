//! Weight on a lever: force `amplitude*sin(x + phase)` against the drive, x in radians.

use super::{
    Begins, Effect, Family, Hook, Kind, Motion, Parameter, Place, Range, Starts, any_values, grid, is_servo,
    shown,
};

pub(super) static KIND: Kind = Kind {
    name: "gravity",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("amplitude", "{drive}", Range::Any, |s, _| s.drive).of_signals(),
        Parameter::new("phase", "rad", Range::Any, |_, _| 1.0),
    ],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(Gravity { amplitude: p[0], phase: p[1] }),
    search: Starts::Grid(|s| {
        let points = [0.2, 0.6].into_iter().flat_map(|part| (0..4).map(move |quarter| (part, quarter)));
        grid(points, |(part, quarter)| vec![part * s.drive, std::f64::consts::FRAC_PI_2 * f64::from(quarter)])
    }),
    family: Some(Family::Spring),
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
