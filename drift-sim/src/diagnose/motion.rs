//! The motion that a recording shows.

use crate::control_loop::Loop;
use crate::plant::{Output, Plant};

use crate::estimate::signals::Signals;

/// Position and speed as measured; those of a plant that is no servo are y and its rate.
pub fn motion(model: &Loop, signals: &Signals) -> (Vec<f64>, Vec<f64>) {
    let ts = signals.sample_time_s;
    if matches!(&model.plant, Plant::Servo(p) if p.output == Output::Speed) {
        let mut x = 0.0;
        let position = signals.y.iter().map(|v| {
            x += if v.is_finite() { v * ts } else { 0.0 };
            x
        });
        return (position.collect(), signals.y.clone());
    }
    let mut speed: Vec<f64> = signals.y.windows(3).map(|w| (w[2] - w[0]) / (2.0 * ts)).collect();
    speed.insert(0, speed.first().copied().unwrap_or(0.0));
    speed.push(speed.last().copied().unwrap_or(0.0));
    (signals.y.clone(), speed)
}
