//! A load that grows: `rate_per_s*(t - onset)` is subtracted from the plant's drive.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, Weight, any_values, every_plant,
    shown,
};

pub(super) static KIND: Kind = Kind {
    name: "load_ramp",
    place: Place::Disturbance,
    begins: Begins::Either,
    parameters: &[
        Parameter::new("rate_per_s", "{drive}/s", Range::Any, |s, _| s.drive / s.duration_s).of_signals()
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| Box::new(LoadRamp { rate_per_s: p[0], onset_s: context.onset_s }),
    search: Starts::Ramp(Weight::Load),
    family: Some(Family::Ramp),
    excitation: "A recording that is long against the ramp.",
    ties: &["sensor_drift", "load_step"],
    experiment: "Compare with a second sensor: a load leaves the sensor right.",
    says: |p, units| format!("A load grows by {}.", shown(p[0], &units.unit("{drive}/s"))),
};

#[derive(Clone)]
struct LoadRamp {
    rate_per_s: f64,
    onset_s: f64,
}

impl Effect for LoadRamp {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Load]
    }

    fn load(&self, t: f64, h: f64) -> f64 {
        self.rate_per_s * (t + 0.5 * h - self.onset_s)
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
