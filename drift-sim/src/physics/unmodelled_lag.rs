//! A first-order lag that the model leaves out. Simulated between actuator and plant, starting settled; in a linear
//! loop it could as well be in the sensor.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "unmodelled_lag",
    place: Place::Loop,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("time_constant_s", "s", Range::Positive, |s, _| 10.0 * s.sample_time_s).of_lags()
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| Box::new(UnmodelledLag::new(context.substep_s / p[0])),
    search: Starts::Grid(|s| grid([1.5, 4.0, 8.0, 15.0, 30.0], |samples| vec![samples * s.sample_time_s])),
    family: Some(Family::Lag),
    excitation: "Edges in r that are sharp against the lag.",
    ties: &["delay", "sensor_lag", "rate_limit"],
    experiment: "Step the reference sharply: a lag begins at once and loses gain at high frequency, a delay does neither.",
    says: |p, _| format!("A lag of {} is in the loop; the model has none.", shown(p[0], "s")),
};

#[derive(Clone)]
struct UnmodelledLag {
    decay: f64,
    mean: f64,
    state: Option<f64>,
}

impl Effect for UnmodelledLag {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Filter]
    }

    fn filter(&mut self, w: f64) -> f64 {
        let state = self.state.get_or_insert(w);
        let off = *state - w;
        *state = w + self.decay * off;
        w + self.mean * off
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}

impl UnmodelledLag {
    /// Exact for a held input: what is left of the difference after a sub-step, and its mean over it.
    fn new(ratio: f64) -> Self {
        let lost = -libm::expm1(-ratio);
        Self { decay: 1.0 - lost, mean: lost / ratio, state: None }
    }
}
