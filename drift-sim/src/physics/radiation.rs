//! Heat lost by radiation: adds `-coefficient*((y + 273.15)^4 - (offset + 273.15)^4)` to `time_constant_s*dy/dt`, y and
//! the plant's `offset` (the surroundings) in degC.

use super::signature::singles;
use super::{Begins, Effect, Hook, Kind, Motion, Parameter, Place, Range, any_values, shown};
use crate::plant::Plant;

pub(super) static KIND: Kind = Kind {
    name: "radiation",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[Parameter { name: "coefficient", unit: "{y}/K^4", range: Range::NotNegative }],
    applies: |plant| matches!(plant, Plant::FirstOrder(_)),
    consistent: any_values,
    effect: |p, context| {
        Box::new(Radiation { coefficient: p[0], surroundings: fourth_power(context.plant.drive_offset()) })
    },
    starts: |_| singles(vec![1e-9, 3e-9, 1e-8]),
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

fn fourth_power(celsius: f64) -> f64 {
    let square = (celsius + 273.15) * (celsius + 273.15);
    square * square
}
