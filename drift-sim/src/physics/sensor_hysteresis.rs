//! Play between the plant and what its sensor shows, as of a gear before the sensor: y stays until the plant has crossed the
//! gap, then follows at its edge; `width` is the total play. Where in the gap it begins, the start says: at rest in the middle. In a loop that integrates it ends in a
//! cycle that no tuning of the gain removes.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "sensor_hysteresis",
    place: Place::Sensor,
    begins: Begins::Start,
    parameters: &[Parameter::new("width", "{y}", Range::NotNegative, |s, _| s.y).rough()],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(SensorHysteresis { half: 0.5 * p[0], shown: None }),
    search: Starts::Grid(|s| grid([0.01, 0.03, 0.1, 0.3, 1.0], |part| vec![part * s.y])),
    family: Some(Family::Play),
    excitation: "Reversals of y.",
    ties: &["backlash", "stiction"],
    experiment: "Reverse y once fast and once slowly: play at the sensor costs the same way of y both times, play at the actuator the same change of u.",
    says: |p, units| {
        format!("Between the plant and what the sensor shows there is a play of {}.", shown(p[0], &units.y))
    },
};

#[derive(Clone)]
struct SensorHysteresis {
    half: f64,
    shown: Option<f64>,
}

impl Effect for SensorHysteresis {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Sense]
    }

    fn sensor(&mut self, _: f64, y: f64) -> f64 {
        let before = self.shown.unwrap_or(y);
        let after = before.max(y - self.half).min(y + self.half);
        self.shown = Some(after);
        after
    }

    fn shows(&mut self, y: f64) {
        self.shown = Some(y);
    }

    fn correct(&mut self, y_by: f64, _: Option<f64>) {
        if let Some(shown) = &mut self.shown {
            *shown += y_by;
        }
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
