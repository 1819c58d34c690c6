//! A weaker actuator: what reaches the plant is `(1 - loss)*u`. Negative loss: a stronger one.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, Weight, any_values, every_plant,
    shown,
};

pub(super) static KIND: Kind = Kind {
    name: "gain_loss",
    place: Place::Actuator,
    begins: Begins::Later,
    parameters: &[Parameter::new("loss", "1", Range::Between(-10.0, 1.0), |_, _| 1.0)],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(GainLoss { gain: 1.0 - p[0] }),
    search: Starts::Onset(Weight::Drive),
    family: Some(Family::Offset),
    excitation: "Any motion or load that costs effort.",
    ties: &["inertia_change", "viscous_friction", "controller_gain"],
    experiment: "Apply a known load or payload: it anchors the scale of the force.",
    says: |p, _| {
        let percent = shown(100.0 * (1.0 - p[0]), "%");
        format!("The actuator delivers {percent} of what it should.")
    },
};

#[derive(Clone)]
struct GainLoss {
    gain: f64,
}

impl Effect for GainLoss {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Actuator]
    }

    fn actuator(&mut self, _: f64, u: f64) -> f64 {
        self.gain * u
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
