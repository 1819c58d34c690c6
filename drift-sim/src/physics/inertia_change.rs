//! More or less mass than the model's (a payload picked up or dropped): the plant's own `inertia` times `ratio`. The
//! speed stays continuous at the onset.

use super::{
    Begins, Effect, Hook, Kind, Numbers, Parameter, Place, Range, Starts, Weight, any_values, is_servo, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "inertia_change",
    place: Place::Plant,
    begins: Begins::Later,
    parameters: &[Parameter::new("ratio", "1", Range::Between(1e-3, 1e3), |_, _| 1.0)
        .around(1.0)
        .searched(0.05, 20.0)],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(InertiaChange { ratio: p[0] }),
    search: Starts::Onset(Weight::Acceleration),
    family: None,
    excitation: "Acceleration.",
    ties: &["gain_loss"],
    experiment: "Hold a constant speed or a known payload: inertia costs no effort there, a weaker actuator does.",
    says: |p, _| format!("The moving mass is {} times the model's.", shown(p[0], "1")),
};

#[derive(Clone)]
struct InertiaChange {
    ratio: f64,
}

impl Effect for InertiaChange {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Numbers]
    }

    fn numbers(&self, numbers: &mut Numbers) {
        numbers.inertia *= self.ratio;
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
