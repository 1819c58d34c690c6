//! A constant load from the onset on, subtracted from the plant's drive.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, Weight, any_values, every_plant,
    shown,
};

pub(super) static KIND: Kind = Kind {
    name: "load_step",
    place: Place::Disturbance,
    begins: Begins::Either,
    parameters: &[Parameter::new("level", "{drive}", Range::Any, |s, _| s.drive).of_signals()],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(LoadStep { level: p[0] }),
    search: Starts::Onset(Weight::Load),
    family: Some(Family::Offset),
    excitation: "The onset within the recording, or a load that a nominal model should not need.",
    ties: &["sensor_bias", "injected_signal", "gravity"],
    experiment: "Change the set-point: a load keeps its size, a bias moves with the plant's gain.",
    says: |p, units| format!("A load of {} takes from the drive.", shown(p[0], &units.drive)),
};

#[derive(Clone)]
struct LoadStep {
    level: f64,
}

impl Effect for LoadStep {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Load]
    }

    fn load(&self, _: f64, _: f64) -> f64 {
        self.level
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
