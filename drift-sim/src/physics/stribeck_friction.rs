//! Stribeck friction: dry friction that is higher at rest than in motion,
//! `coulomb + (breakaway - coulomb)*exp(-(v/stribeck_speed)^2)`.

use super::{Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, grid, is_servo, shown};

pub(super) static KIND: Kind = Kind {
    name: "stribeck_friction",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("coulomb", "{drive}", Range::NotNegative, |s, _| s.drive).of_signals(),
        Parameter::new("breakaway", "{drive}", Range::NotNegative, |s, _| s.drive).of_signals(),
        Parameter::new("stribeck_speed", "{speed}", Range::Positive, |s, _| s.speed).of_signals(),
    ],
    applies: is_servo,
    consistent,
    effect: |p, _| Box::new(StribeckFriction { coulomb: p[0], excess: p[1] - p[0], stribeck_speed: p[2] }),
    search: Starts::Grid(|s| {
        let points = [0.15, 0.35].into_iter().flat_map(|low| [0.2, 0.5].map(|more| (low, more)));
        let points = points.flat_map(|(low, more)| [0.06, 0.15, 0.6].map(|speed| (low, more, speed)));
        grid(points, |(low, more, speed)| vec![low * s.drive, (low + more) * s.drive, speed * s.speed])
    }),
    family: Some(Family::Friction),
    excitation: "Slow motion and stops as well as fast motion.",
    ties: &["coulomb_friction"],
    experiment: "Repeat slow starts from rest: a breakaway above the running friction shows as a jump.",
    says: |p, units| {
        let [coulomb, breakaway] = [p[0], p[1]].map(|level| shown(level, &units.drive));
        let speed = shown(p[2], &units.speed);
        format!(
            "Dry friction of {breakaway} at rest falls to {coulomb} above a speed of about {speed}; the model has none."
        )
    },
};

fn consistent(p: &[f64]) -> Result<(), &'static str> {
    if p[1] >= p[0] { Ok(()) } else { Err("breakaway must not be below coulomb") }
}

/// Square of the speed over the Stribeck speed from which on 4e-18 of the excess is left.
const FAR: f64 = 40.0;

#[derive(Clone)]
struct StribeckFriction {
    coulomb: f64,
    excess: f64,
    stribeck_speed: f64,
}

impl Effect for StribeckFriction {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::VaryingFriction]
    }

    fn friction(&self, _: f64, speed: f64, _: f64) -> f64 {
        let ratio = speed / self.stribeck_speed;
        let square = ratio * ratio;
        // What is left of the excess there does not show in the sum, and an exponential costs more than all else of a step.
        if square > FAR { self.coulomb } else { self.coulomb + self.excess * libm::exp(-square) }
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
