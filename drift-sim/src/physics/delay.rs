//! Dead time on top of the model's own; it need not be a multiple of the sample time. Simulated between actuator and
//! plant; in a linear loop it could as well be in the sensor.

use super::{
    Begins, Effect, Family, Hook, Kind, Numbers, Parameter, Place, Range, Starts, any_values, every_plant,
    grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "delay",
    place: Place::Loop,
    begins: Begins::Start,
    parameters: &[Parameter::new("delay_s", "s", Range::NotNegative, |s, _| 10.0 * s.sample_time_s)
        .rough()
        .of_lags()],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(Delay { delay_s: p[0] }),
    search: Starts::Grid(|s| {
        grid([1.0, 2.0, 3.0, 4.5, 6.0, 10.0, 20.0], |samples| vec![samples * s.sample_time_s])
    }),
    family: Some(Family::Lag),
    excitation: "Sharp edges in r.",
    ties: &["unmodelled_lag", "controller_delay"],
    experiment: "Step the reference sharply and look at the first samples: a delay waits, a lag begins at once.",
    says: |p, _| format!("The loop is {} later than the model.", shown(p[0], "s")),
};

#[derive(Clone)]
struct Delay {
    delay_s: f64,
}

impl Effect for Delay {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Numbers]
    }

    fn numbers(&self, numbers: &mut Numbers) {
        numbers.delay_s += self.delay_s;
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
