//! A sensor that is off by a constant: `bias` is added to y, from the onset on or within the term's spans.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, Weight, any_values, every_plant,
    shown,
};

pub(super) static KIND: Kind = Kind {
    name: "sensor_bias",
    place: Place::Sensor,
    begins: Begins::Later,
    parameters: &[Parameter::new("bias", "{y}", Range::Any, |s, _| s.y).of_signals()],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| Box::new(SensorBias { bias: p[0], spans: context.spans.to_vec() }),
    search: Starts::Onset(Weight::Sensor),
    family: Some(Family::Offset),
    excitation: "The onset within the recording, or a plant that does not integrate.",
    ties: &["load_step", "sensor_drift"],
    experiment: "Bring the plant to a known zero, or change the load: a bias stays, a load does not.",
    says: |p, units| format!("The sensor reads {} too much.", shown(p[0], &units.y)),
};

#[derive(Clone)]
struct SensorBias {
    bias: f64,
    /// Empty: all the time.
    spans: Vec<(f64, f64)>,
}

impl Effect for SensorBias {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Sensor]
    }

    fn sensor(&mut self, t: f64, y: f64) -> f64 {
        let within = self.spans.is_empty() || self.spans.iter().any(|(from, to)| (*from..*to).contains(&t));
        if within { y + self.bias } else { y }
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
