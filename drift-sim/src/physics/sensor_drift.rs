//! A sensor that drifts (the paper's injected fault, its section 4): `mu(t) + sigma(t)*N(0, 1)` is added to y, where both
//! grow from zero at the onset, `mu = rate_per_s*(t - onset)` and `sigma = noise_growth_per_s*(t - onset)`. The paper's
//! mu_max and sigma_growth are the two rates times the length of the run.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, Weight, any_values, every_plant,
    shown,
};

pub(super) static KIND: Kind = Kind {
    name: "sensor_drift",
    place: Place::Sensor,
    begins: Begins::Later,
    parameters: &[
        Parameter::new("rate_per_s", "{y}/s", Range::Any, |s, _| s.y / s.duration_s),
        Parameter::new("noise_growth_per_s", "{y}/s", Range::NotNegative, |s, _| s.y / s.duration_s)
            .or(0.0)
            .not_fitted(),
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| {
        Box::new(SensorDrift {
            rate_per_s: p[0],
            noise_growth_per_s: p[1],
            onset_s: context.onset_s,
            noise: context.noise.clone(),
        })
    },
    search: Starts::Ramp(Weight::Sensor),
    family: Some(Family::Ramp),
    excitation: "A recording that is long against the drift.",
    ties: &["load_ramp", "sensor_bias"],
    experiment: "Compare with a second sensor, or bring the plant to a known zero twice.",
    says: |p, units| {
        let rule = units.unit("{y}/s");
        let mut says = format!("The sensor drifts by {}", shown(p[0], &rule));
        if p[1] > 0.0 {
            says += &format!(", its noise grows by {}", shown(p[1], &rule));
        }
        says + "."
    },
};

#[derive(Clone)]
struct SensorDrift {
    rate_per_s: f64,
    noise_growth_per_s: f64,
    onset_s: f64,
    noise: ChaCha8Rng,
}

impl Effect for SensorDrift {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Sensor]
    }

    #[inline]
    fn sensor(&mut self, t: f64, y: f64) -> f64 {
        let age = t - self.onset_s;
        let drifted = y + self.rate_per_s * age;
        if self.noise_growth_per_s == 0.0 {
            return drifted;
        }
        let normal: f64 = StandardNormal.sample(&mut self.noise);
        drifted + self.noise_growth_per_s * age * normal
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
