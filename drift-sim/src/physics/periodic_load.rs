//! A periodic load: `amplitude*sin(2 pi*frequency_hz*t + phase)` is subtracted from the plant's drive, t from the start of the run.

use super::{
    Begins, Effect, Family, Hook, Kind, Over, Parameter, Place, Range, Starts, any_values, every_plant, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "periodic_load",
    place: Place::Disturbance,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("amplitude", "{drive}", Range::Any, |s, _| s.drive).of_signals(),
        Parameter::new("frequency_hz", "Hz", Range::Positive, |s, _| 1.0 / s.duration_s),
        Parameter::new("phase", "rad", Range::Any, |_, _| 1.0).or(0.0),
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| {
        Box::new(PeriodicLoad { amplitude: p[0], rate: std::f64::consts::TAU * p[1], phase: p[2] })
    },
    search: Starts::Wave(Over::Time),
    family: Some(Family::Wave),
    excitation: "Several periods.",
    ties: &["cogging"],
    experiment: "Repeat at half the speed: a periodic load keeps its period over time, cogging over position.",
    says: |p, units| {
        format!("A load of {} comes and goes at {}.", shown(p[0].abs(), &units.drive), shown(p[1], "Hz"))
    },
};

#[derive(Clone)]
struct PeriodicLoad {
    amplitude: f64,
    rate: f64,
    phase: f64,
}

impl Effect for PeriodicLoad {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Load]
    }

    fn load(&self, t: f64, h: f64) -> f64 {
        self.amplitude * libm::sin(self.rate * (t + 0.5 * h) + self.phase)
    }

    /// Sine and cosine turn by a sample's angle, and are asked for anew before what is rounded adds up.
    fn load_over(&self, from: usize, sample_time_s: f64, sums: &mut [f64]) {
        const TURNED: usize = 64;
        let (turn_sin, turn_cos) = libm::sincos(self.rate * sample_time_s);
        for (from, part) in (from..).step_by(TURNED).zip(sums.chunks_mut(TURNED)) {
            let angle = self.rate * ((from as f64 + 0.5) * sample_time_s) + self.phase;
            let (mut sin, mut cos) = libm::sincos(angle);
            for sum in part {
                *sum += self.amplitude * sin;
                (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
            }
        }
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
