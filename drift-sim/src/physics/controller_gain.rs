//! A controller whose gains are not the stated ones: all of them (kp, ki, kd; for the cascade its overall gain) times
//! `ratio`. The integrator stays where it is at the onset.

use super::{
    Begins, Effect, Hook, Kind, Numbers, Parameter, Place, Range, Starts, any_values, every_plant, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "controller_gain",
    place: Place::Controller,
    begins: Begins::Start,
    parameters: &[Parameter::new("ratio", "1", Range::Any, |_, _| 1.0).around(1.0)],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(ControllerGain { ratio: p[0] }),
    search: Starts::Apart,
    family: None,
    excitation: "An error that is not zero.",
    ties: &["gain_loss"],
    experiment: "Replay the stated law on the recorded r and y: its u must be the recorded one.",
    says: |p, _| format!("The controller's gains are {} times the stated ones.", shown(p[0], "1")),
};

#[derive(Clone)]
struct ControllerGain {
    ratio: f64,
}

impl Effect for ControllerGain {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Numbers]
    }

    fn numbers(&self, numbers: &mut Numbers) {
        numbers.law_ratio *= self.ratio;
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
