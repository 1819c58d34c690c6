//! Signatures: what the missing drive shows, as starting points for the candidates.

use crate::control_loop::Loop;
use crate::physics::Signature;
use crate::plant::{Output, Plant};

use super::missing_drive::MissingDrive;
use super::signals::{Signals, deviation};
use super::spectrum;

/// Peaks tried for frequencies and for pitches.
const PEAKS: usize = 3;

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

/// The signature that says how large the signals are, and no more.
pub fn scales(model: &Loop, signals: &Signals) -> Signature {
    let (_, speed) = motion(model, signals);
    Signature {
        y_scale: deviation(&signals.y),
        u_scale: deviation(&signals.u),
        drive_scale: deviation(&signals.u) * model.plant.drive_gain().abs(),
        speed_scale: deviation(&speed),
        sample_time_s: signals.sample_time_s,
        duration_s: signals.duration_s(),
        ..Signature::default()
    }
}

/// One signature with scales alone, then one for each peak over time and over position.
pub fn signatures(model: &Loop, signals: &Signals, missing: Option<&MissingDrive>) -> Vec<Signature> {
    let (position, _) = motion(model, signals);
    let scales = scales(model, signals);
    let mut all = vec![scales.clone()];
    if let Some(missing) = missing {
        let peaks = spectrum::peaks(&missing.value, PEAKS);
        let pitches = spectrum::periods(&position, &missing.value, PEAKS);
        for i in 0..PEAKS {
            let mut signature = scales.clone();
            if let Some((cycles, amplitude)) = peaks.get(i) {
                signature.peak_hz = cycles / signals.sample_time_s;
                signature.peak_amplitude = *amplitude;
            }
            if let Some((pitch, _)) = pitches.get(i) {
                signature.pitch = *pitch;
            }
            all.push(signature);
        }
    }
    all
}
