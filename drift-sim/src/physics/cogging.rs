//! Cogging: a force that repeats over position (magnets, a screw's pitch, an unbalanced wheel),
//! `amplitude*sin(2 pi x/period + phase)` against the drive. Where y is a speed, x is its integral from the start.

use super::{
    Begins, Effect, Family, Hook, Kind, Motion, Over, Parameter, Place, Range, Starts, any_values, is_servo,
    shown,
};

pub(super) static KIND: Kind = Kind {
    name: "cogging",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("amplitude", "{drive}", Range::NotNegative, |s, _| s.drive).of_signals(),
        Parameter::new("period", "{position}", Range::Positive, |s, period| period * period / s.position),
        Parameter::new("phase", "rad", Range::Any, |_, _| 1.0),
    ],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| {
        Box::new(Cogging { amplitude: p[0], wave_number: std::f64::consts::TAU / p[1], phase: p[2] })
    },
    search: Starts::Wave(Over::Position),
    family: Some(Family::Wave),
    excitation: "Slow motion over several periods.",
    ties: &["periodic_load"],
    experiment: "Repeat the motion at half the speed: cogging keeps its period over position, a periodic load keeps it over time.",
    says: |p, units| {
        format!(
            "A force of {} repeats every {} of travel; the model has none.",
            shown(p[0], &units.drive),
            shown(p[1], &units.position)
        )
    },
};

#[derive(Clone)]
struct Cogging {
    amplitude: f64,
    wave_number: f64,
    phase: f64,
}

impl Effect for Cogging {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Force]
    }

    fn force(&self, motion: Motion) -> f64 {
        -self.amplitude * libm::sin(self.wave_number * motion.position + self.phase)
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
