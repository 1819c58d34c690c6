//! A noisier sensor: the sensor's own noise (`[sensor] noise` of the loop) times `ratio`. Without such noise in the
//! loop it changes nothing.

use super::{
    Begins, Effect, Hook, Kind, Numbers, Parameter, Place, Range, Starts, any_values, every_plant, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "sensor_noise",
    place: Place::Sensor,
    begins: Begins::Later,
    parameters: &[Parameter::new("ratio", "1", Range::NotNegative, |_, _| 1.0)
        .around(1.0)
        .searched(QUIETEST, LOUDEST)],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(SensorNoise { ratio: p[0] }),
    search: Starts::NoiseChange,
    family: None,
    excitation: "The onset within the recording, or a healthy recording beside it.",
    ties: &["sensor_drift"],
    experiment: "Hold still before and after: noise alone changes.",
    says: |p, _| format!("The sensor is {} times as noisy as before.", shown(p[0], "1")),
};

/// Noise that shrinks is none: what a model lacks had been taken for noise before.
const QUIETEST: f64 = 1.0;
/// Beyond this the samples before were none of a sensor's: they were held.
const LOUDEST: f64 = 100.0;

#[derive(Clone)]
struct SensorNoise {
    ratio: f64,
}

impl Effect for SensorNoise {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Numbers]
    }

    fn numbers(&self, numbers: &mut Numbers) {
        numbers.sensor_noise *= self.ratio;
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
