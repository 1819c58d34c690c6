//! Viscous friction other than the model's: the plant's own `viscous` times `ratio`.

use super::{
    Begins, Effect, Hook, Kind, Numbers, Parameter, Place, Range, Starts, Weight, any_values, is_servo, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "viscous_friction",
    place: Place::Plant,
    begins: Begins::Later,
    parameters: &[Parameter::new("ratio", "1", Range::NotNegative, |_, _| 1.0)
        .around(1.0)
        .searched(0.0, 50.0)],
    applies: is_servo,
    consistent: any_values,
    effect: |p, _| Box::new(ViscousFriction { ratio: p[0] }),
    search: Starts::Onset(Weight::Viscous),
    family: None,
    excitation: "Motion at speed.",
    ties: &["quadratic_drag", "gain_loss", "leak"],
    experiment: "Hold several constant speeds: the effort stays proportional to the speed.",
    says: |p, _| format!("Viscous friction is {} times the model's.", shown(p[0], "1")),
};

#[derive(Clone)]
struct ViscousFriction {
    ratio: f64,
}

impl Effect for ViscousFriction {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Numbers]
    }

    fn numbers(&self, numbers: &mut Numbers) {
        numbers.viscous *= self.ratio;
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
