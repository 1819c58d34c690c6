//! A slow sensor: a first-order lag between the true and the measured y, starting settled. y is taken as a straight line
//! between samples.

use super::{
    Begins, Effect, Family, Follows, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant,
    grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "sensor_lag",
    place: Place::Sensor,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("time_constant_s", "s", Range::Positive, |s, _| 10.0 * s.sample_time_s).of_lags()
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| Box::new(SensorLag::new(p[0] / context.sample_time_s)),
    search: Starts::Grid(|s| grid([1.5, 4.0, 8.0, 15.0, 30.0], |samples| vec![samples * s.sample_time_s])),
    family: Some(Family::Lag),
    excitation: "Edges in r that are sharp against the lag.",
    ties: &["unmodelled_lag", "delay"],
    experiment: "Step the load: the true y moves at once, a slow sensor shows it late; a slow actuator plays no part.",
    says: |p, _| format!("The sensor follows with a lag of {}.", shown(p[0], "s")),
};

#[derive(Clone)]
struct SensorLag {
    decay: f64,
    slope: f64,
    state: Option<[f64; 2]>,
}

impl Effect for SensorLag {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Sense]
    }

    fn sensor(&mut self, _: f64, y: f64) -> f64 {
        let [shown, before] = self.state.unwrap_or([y, y]);
        let lag = self.slope * (y - before);
        let shown = y - lag + (shown - before + lag) * self.decay;
        self.state = Some([shown, y]);
        shown
    }

    fn correct(&mut self, y_by: f64, shown_by: Option<f64>) {
        if let (Some([shown, before]), Some(shown_by)) = (&mut self.state, shown_by) {
            *shown += shown_by;
            *before += y_by;
        }
    }

    fn follows(&self) -> Option<Follows> {
        let Self { decay, slope, .. } = *self;
        let left = slope * decay;
        Some(Follows { new: 1.0 - slope + left, before: slope - left - decay, stays: decay })
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}

impl SensorLag {
    /// Exact for an input that is a straight line over a sample; `ratio` is the time constant in samples.
    fn new(ratio: f64) -> Self {
        Self { decay: libm::exp(-1.0 / ratio), slope: ratio, state: None }
    }
}
