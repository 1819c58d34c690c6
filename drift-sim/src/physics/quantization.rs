//! A coarse sensor: y in whole multiples of `step`.

use super::{Begins, Effect, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, shown};

pub(super) static KIND: Kind = Kind {
    name: "quantization",
    place: Place::Sensor,
    begins: Begins::Start,
    parameters: &[Parameter::new("step", "{y}", Range::Positive, |s, _| s.y).rough()],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(Quantization { step: p[0] }),
    search: Starts::Apart,
    family: None,
    excitation: "Slow motion.",
    ties: &["sensor_noise"],
    experiment: "Move slowly: y goes in equal steps.",
    says: |p, units| format!("The sensor shows y in steps of {}.", shown(p[0], &units.y)),
};

#[derive(Clone)]
struct Quantization {
    step: f64,
}

impl Effect for Quantization {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Sensor]
    }

    fn sensor(&mut self, _: f64, y: f64) -> f64 {
        libm::round(y / self.step) * self.step
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
