//! The proof: closed-loop simulations from r alone, against measured y and u.

use crate::control_loop::{Loop, Sensor};
use crate::simulate::{Simulation, Start, Trace, simulate};

use super::part_time;
use super::{cycle, free_run, observer};
use crate::estimate::signals::{Signals, deviation};

/// How well a simulation fits, `100 (1 - |x - xhat|/|x - mean x|)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitPct {
    /// Of y.
    pub y_pct: f64,
    /// Of u; none where the control law is not known.
    pub u_pct: Option<f64>,
}

impl FitPct {
    /// That of u; of y under an unknown law, where u is as it was recorded.
    pub fn that_counts(self) -> f64 {
        self.u_pct.unwrap_or(self.y_pct)
    }

    /// What is left of the signal that counts, in per cent.
    pub fn error(self) -> f64 {
        100.0 - self.that_counts()
    }
}

/// Contiguous blocks for the interval of an improvement.
const BLOCKS: usize = 16;

/// Runs a loop over the recording's reference from the recording's own start. With an unknown control law the recorded u
/// drives the plant instead, from the start that fits best and without noise. A loop that cycles by itself is run anew every period.
/// `None` where it diverges.
pub fn run(model: &Loop, signals: &Signals, seed: u64) -> Option<Trace> {
    if !model.has_law() {
        let y = free_run::free_run(model, signals)?;
        return Some(Trace { true_y: y.clone(), y, u: signals.u.clone() });
    }
    let model = &part_time::of(model.clone(), signals.origin_s);
    let start = Start::from_recording(model, &signals.r, &signals.y, &signals.u);
    match cycle::period(signals) {
        Some(period) => period_by_period(model, signals, seed, &start, period),
        None => simulate(model, &signals.r, &signals.inputs, seed, Some(&start)).ok(),
    }
}

/// The same without the sensor's noise: another draw of it is no better prediction.
pub fn quiet_run(model: &Loop, signals: &Signals) -> Option<Trace> {
    run(&without_noise(model), signals, 0)
}

/// The loop with a sensor that has no noise.
pub fn without_noise(model: &Loop) -> Loop {
    Loop { sensor: Sensor { noise: 0.0 }, ..model.clone() }
}

/// The closed loop of a recording that cycles by itself: from each period's beginning on for a period, from where a simulation beside the
/// recording, of law and plant by themselves, has them then.
fn period_by_period(
    model: &Loop,
    signals: &Signals,
    seed: u64,
    start: &Start,
    period: usize,
) -> Option<Trace> {
    let mut beside = Simulation::new(model, seed).ok()?;
    beside.start(start).ok()?;
    let gains = observer::gains(&model.plant, model.sample_time_s);
    let mut closed = beside.clone();
    let mut inputs = vec![0.0; signals.inputs.len()];
    let mut trace = Trace::default();
    let mut last = start.y;
    for (n, ((r, y), u)) in signals.r.iter().zip(&signals.y).zip(&signals.u).enumerate() {
        signals.inputs_at(n, &mut inputs);
        if n % period == 0 {
            closed = beside.clone();
        }
        let step = closed.step(*r, &inputs);
        trace.y.push(step.y);
        trace.u.push(step.u);
        trace.true_y.push(step.true_y);
        if y.is_finite() {
            last = *y;
        }
        let expected = beside.follow(*r, last, *u, &inputs);
        if y.is_finite() {
            beside.correct(gains.iter().map(|gain| gain * (y - expected.y)));
        }
    }
    trace.y.iter().all(|y| y.is_finite()).then_some(trace)
}

/// Fit of a run.
pub fn fit_of(model: &Loop, trace: &Trace, signals: &Signals) -> FitPct {
    let known = model.has_law();
    FitPct { y_pct: percent(&signals.y, &trace.y), u_pct: known.then(|| percent(&signals.u, &trace.u)) }
}

/// `100 (1 - |x - xhat| / |x - mean x|)` over the samples that were measured.
pub fn percent(measured: &[f64], simulated: &[f64]) -> f64 {
    let squared = |(a, b): (&f64, &f64)| if a.is_finite() { (a - b) * (a - b) } else { 0.0 };
    let known = measured.iter().filter(|x| x.is_finite()).count().max(1) as f64;
    let error: f64 = measured.iter().zip(simulated).map(squared).sum();
    100.0 * (1.0 - libm::sqrt(error / known) / deviation(measured).max(1e-300))
}

/// 95 % interval of the gain in u's fit (y's where the law is unknown), from its scatter over contiguous blocks.
pub fn improvement(before: &Trace, after: &Trace, model: &Loop, signals: &Signals) -> Option<[f64; 2]> {
    let known = model.has_law();
    let (measured, old, new) =
        if known { (&signals.u, &before.u, &after.u) } else { (&signals.y, &before.y, &after.y) };
    let length = (measured.len() / BLOCKS).max(1);
    let parts: Vec<f64> = measured
        .chunks(length)
        .zip(old.chunks(length))
        .zip(new.chunks(length))
        .take(BLOCKS)
        .map(|((m, a), b)| {
            let rms = |x: &[f64]| {
                let squared =
                    m.iter().zip(x).map(|(m, x)| if m.is_finite() { (m - x) * (m - x) } else { 0.0 });
                libm::sqrt(squared.sum::<f64>() / m.len() as f64)
            };
            100.0 * (rms(a) - rms(b)) / deviation(measured).max(1e-300)
        })
        .collect();
    let n = parts.len() as f64;
    if n < 3.0 {
        return None;
    }
    let whole = if known {
        percent(measured, new) - percent(measured, old)
    } else {
        percent(&signals.y, new) - percent(&signals.y, old)
    };
    let mean = parts.iter().sum::<f64>() / n;
    let error = libm::sqrt(parts.iter().map(|p| (p - mean) * (p - mean)).sum::<f64>() / (n - 1.0) / n);
    // Student's 97.5 % point for 15 degrees of freedom.
    Some([whole - 2.13 * error, whole + 2.13 * error])
}

/// How much of u (of y, where the law is unknown) one simulation differs from another, of its own variation.
pub fn difference(one: &Trace, other: &Trace, model: &Loop) -> f64 {
    let (a, b) = if model.has_law() { (&one.u, &other.u) } else { (&one.y, &other.y) };
    let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    libm::sqrt(squared / a.len().max(1) as f64) / deviation(a).max(1e-300)
}
