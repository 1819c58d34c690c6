//! A flexible shaft or belt between the actuator and what it moves: the drive passes a resonance
//! `w^2/(s^2 + 2*damping*w*s + w^2)`, `w = 2 pi*frequency_hz`. In a linear loop it could as well be on the side of y.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, grid, shown,
};
use crate::plant::StateSpace;
use crate::plant::zero_order_hold::discretise;

pub(super) static KIND: Kind = Kind {
    name: "flexible_mode",
    place: Place::Plant,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("frequency_hz", "Hz", Range::Positive, |s, _| 0.02 / s.sample_time_s),
        Parameter::new("damping", "1", Range::Between(0.0, 1.0), |_, _| 1.0),
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| Box::new(FlexibleMode::new(p[0], p[1], context.substep_s)),
    search: Starts::Grid(|s| {
        let parts = [0.01, 0.02, 0.04, 0.08, 0.15, 0.35];
        let of_each = parts.iter().flat_map(|part| [0.05, 0.3].map(|damping| (part, damping)));
        grid(of_each, |(part, damping)| vec![part / s.sample_time_s, damping])
    }),
    // Above what the recording shows it is nothing but late.
    family: Some(Family::Lag),
    excitation: "Fast set-point changes or pulses that ring the mode.",
    ties: &["unmodelled_lag"],
    experiment: "Excite with pulses or a sweep around the suspected frequency: a mode rings, a lag does not.",
    says: |p, _| {
        format!(
            "A resonance at {} with damping {} lies between the drive and y; the model has none.",
            shown(p[0], "Hz"),
            shown(p[1], "1")
        )
    },
};

#[derive(Clone)]
struct FlexibleMode {
    step: [[f64; 2]; 2],
    gain: [f64; 2],
    mean: [f64; 2],
    mean_gain: f64,
    state: Option<[f64; 2]>,
}

impl Effect for FlexibleMode {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Filter]
    }

    fn filter(&mut self, w: f64) -> f64 {
        let state = self.state.get_or_insert([w, 0.0]);
        let [x, v] = *state;
        // State: position of the far end and its speed over a sub-step, driven towards w.
        for (next, (row, gain)) in state.iter_mut().zip(self.step.iter().zip(self.gain)) {
            *next = row[0] * x + row[1] * v + gain * w;
        }
        self.mean[0] * x + self.mean[1] * v + self.mean_gain * w
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}

impl FlexibleMode {
    /// The exact response over one sub-step of held input: states (position, speed*h) and the position's mean, from
    /// a matrix exponential of the mode with its integral as third state.
    fn new(frequency_hz: f64, damping: f64, h: f64) -> Self {
        let w = std::f64::consts::TAU * frequency_hz * h;
        // A mode far above the sub-step's own rate is not seen by the loop: it would pass everything.
        let w = w.min(50.0);
        let a = vec![vec![0.0, 1.0, 0.0], vec![-w * w, -2.0 * damping * w, 0.0], vec![1.0, 0.0, 0.0]];
        let mode = StateSpace { a, b: vec![0.0, w * w, 0.0], c: vec![1.0, 0.0, 0.0], d: 0.0 };
        match discretise(&mode, 1.0).map(|held| (held.phi, held.gamma)) {
            Ok((phi, gamma)) if phi.len() == 9 && gamma.len() == 3 => Self {
                step: [[phi[0], phi[1]], [phi[3], phi[4]]],
                gain: [gamma[0], gamma[1]],
                mean: [phi[6], phi[7]],
                mean_gain: gamma[2],
                state: None,
            },
            _ => Self { step: [[0.0; 2]; 2], gain: [1.0, 0.0], mean: [0.0; 2], mean_gain: 1.0, state: None },
        }
    }
}
