//! Heat lost by radiation: adds `-coefficient*((y + 273.15)^4 - (offset + 273.15)^4)` to `time_constant_s*dy/dt`, y and
//! the plant's `offset` (the surroundings) in degC.

use super::{
    Begins, Effect, Hook, Kind, Motion, Parameter, Place, Range, Scales, Start, Starts, any_values, shown,
};
use crate::plant::Plant;

pub(super) static KIND: Kind = Kind {
    name: "radiation",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[Parameter::new("coefficient", "{y}/K^4", Range::NotNegative, |s, _| 0.1 / kelvin_cubed(s))],
    applies: |plant| matches!(plant, Plant::FirstOrder(_)),
    consistent: any_values,
    effect: |p, context| {
        Box::new(Radiation { coefficient: p[0], surroundings: fourth_power(context.plant.drive_offset()) })
    },
    search: Starts::Grid(|s| {
        // Gain and time constant beside it so that the linearised plant stays as it was.
        let beside = |v: f64| libm::log(1.0 + 4.0 * v);
        let start =
            |v: f64| Start { gain: beside(v), time: beside(v), ..Start::of(vec![v / kelvin_cubed(s)]) };
        [0.02, 0.05, 0.1, 0.2, 0.35].map(start).to_vec()
    }),
    family: None,
    excitation: "Two or more temperatures well above the surroundings.",
    ties: &["leak"],
    experiment: "Hold three temperatures: the effort grows faster than the temperature; then change the temperature of the surroundings.",
    says: |p, units| {
        format!(
            "Radiation takes {} times the difference of fourth powers; the model has none.",
            shown(p[0], &units.unit("{y}/K^4"))
        )
    },
};

#[derive(Clone)]
struct Radiation {
    coefficient: f64,
    surroundings: f64,
}

impl Effect for Radiation {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Force]
    }

    fn force(&self, motion: Motion) -> f64 {
        -self.coefficient * (fourth_power(motion.position) - self.surroundings)
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}

/// The slope of the fourth power, a quarter of it, at the recording's mean temperature.
fn kelvin_cubed(s: &Scales) -> f64 {
    let kelvin = s.y_mean + 273.15;
    kelvin * kelvin * kelvin
}

fn fourth_power(celsius: f64) -> f64 {
    let square = (celsius + 273.15) * (celsius + 273.15);
    square * square
}
