//! The typical sizes of a recording's signals.

use crate::control_loop::Loop;
use crate::physics::{Motion, Scales};
use crate::plant::{Output, Plant};

use super::lattice;
use super::signals::{Signals, deviation, held, range};

/// Shares of the samples that the sizes of u tried as limits exceed.
const EXCEEDED: [f64; 13] = [0.0005, 0.001, 0.003, 0.01, 0.03, 0.07, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95, 0.99];
/// The same from one end of u alone.
const EXCEEDED_AT_AN_END: [f64; 4] = [0.003, 0.03, 0.1, 0.3];
/// Motions of a recording at which forces are made linear.
const MOTIONS: usize = 64;
/// Median of |x| of a normal x of deviation 1, and the deviation of second differences of white noise of deviation 1.
const MEDIAN_SIZE: f64 = 0.6745;
const SECOND_DIFFERENCE: f64 = 2.449_489_742_783_178;

/// The scales of these recordings together.
pub fn scales(model: &Loop, recordings: &[Signals]) -> Scales {
    let all = |of: &dyn Fn(&Signals) -> Vec<f64>| -> Vec<f64> { recordings.iter().flat_map(of).collect() };
    let rms = |of: &dyn Fn(&Signals) -> f64| {
        let squares: f64 = recordings.iter().map(|s| of(s) * of(s)).sum();
        libm::sqrt(squares / recordings.len().max(1) as f64)
    };
    let positive = |x: f64| if x > 0.0 && x.is_finite() { x } else { 1e-9 };
    let us = all(&|s| s.u.clone());
    let ys = all(&|s| held(&s.y));
    let (u_lowest, u_highest) = range(&us);
    let mut sizes: Vec<f64> = us.iter().map(|u| u.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    // A limit at an end does nothing, however long u dwells there.
    let mut sorted: Vec<f64> = us.iter().copied().filter(|u| *u > u_lowest && *u < u_highest).collect();
    sorted.sort_by(f64::total_cmp);
    let at =
        |x: &[f64], share: f64| x.get(((x.len().max(1) - 1) as f64 * share) as usize).copied().unwrap_or(0.0);
    let mut steps = all(&|s| s.u.windows(2).map(|p| (p[1] - p[0]).abs()).collect());
    steps.sort_by(f64::total_cmp);
    let u = positive(rms(&|s| deviation(&s.u)));
    let y = positive(rms(&|s| deviation(&s.y)));
    let is_position = matches!(&model.plant, Plant::Servo(servo) if servo.output == Output::Position);
    let is_speed = shows_speed(&model.plant);
    let speed = if is_position { rms(&|s| deviation(&speeds(s))) } else { y };
    let ts = model.sample_time_s;
    let position = recordings.iter().map(|s| {
        let positions = positions(held(&s.y), is_speed, ts);
        let (low, high) = range(&positions);
        high - low
    });
    let drive = match &model.plant {
        Plant::Identify => u,
        plant => plant.drive_gain().abs() * u,
    };
    let y_step = lattice::rounding(recordings);
    Scales {
        u,
        u_size: positive(libm::sqrt(us.iter().map(|u| u * u).sum::<f64>() / us.len().max(1) as f64)),
        u_range: positive(recordings.iter().map(|s| span(&s.u)).fold(0.0, f64::max)),
        u_lowest,
        u_highest,
        u_most: at(&sizes, 1.0),
        u_sizes: EXCEEDED.iter().map(|share| at(&sizes, 1.0 - share)).collect(),
        u_upper: EXCEEDED_AT_AN_END.iter().map(|share| at(&sorted, 1.0 - share)).collect(),
        u_lower: EXCEEDED_AT_AN_END.iter().map(|share| at(&sorted, *share)).collect(),
        u_slew: positive(at(&steps, 0.99) / ts),
        y,
        y_mean: ys.iter().sum::<f64>() / ys.len().max(1) as f64,
        u_mean: us.iter().sum::<f64>() / us.len().max(1) as f64,
        noise: noise(recordings).max(1e-9 * y),
        y_step,
        is_coarse: y_step.is_some_and(|step| lattice::is_coarse(recordings, step)),
        speed: positive(speed),
        position: positive(position.fold(0.0, f64::max)),
        drive: positive(drive),
        inputs: (0..model.inputs.len()).map(|i| spread(recordings, i)).collect(),
        sample_time_s: ts,
        duration_s: recordings.first().map_or(ts, Signals::duration_s),
    }
}

/// Deviation of the sensor's white noise as second differences show it: an upper bound, the median of the recordings'.
fn noise(recordings: &[Signals]) -> f64 {
    let of = |signals: &Signals| {
        let mut second: Vec<f64> = signals
            .y
            .windows(3)
            .map(|y| (y[2] - 2.0 * y[1] + y[0]).abs())
            .filter(|d| d.is_finite())
            .collect();
        let middle = second.len() / 2;
        if second.is_empty() {
            return 0.0;
        }
        let (_, median, _) = second.select_nth_unstable_by(middle, f64::total_cmp);
        if *median > 0.0 {
            return *median / MEDIAN_SIZE / SECOND_DIFFERENCE;
        }
        // A coarse sensor mostly shows the same value twice.
        libm::sqrt(second.iter().map(|d| d * d).sum::<f64>() / second.len() as f64) / SECOND_DIFFERENCE
    };
    let mut each: Vec<f64> = recordings.iter().map(of).collect();
    each.sort_by(f64::total_cmp);
    each.get(each.len() / 2).copied().unwrap_or(0.0)
}

/// Mean of a measured input, and its standard deviation about it, of all recordings together.
fn spread(recordings: &[Signals], input: usize) -> (f64, f64) {
    let all: Vec<f64> = recordings
        .iter()
        .filter_map(|s| s.inputs.get(input))
        .flatten()
        .copied()
        .filter(|x| x.is_finite())
        .collect();
    (all.iter().sum::<f64>() / all.len().max(1) as f64, deviation(&all))
}

fn span(x: &[f64]) -> f64 {
    let (low, high) = range(x);
    high - low
}

/// dy/dt by central differences.
fn speeds(signals: &Signals) -> Vec<f64> {
    let y = held(&signals.y);
    y.windows(3).map(|y| 0.5 * (y[2] - y[0]) / signals.sample_time_s).collect()
}

/// Whether y is a speed.
pub fn shows_speed(plant: &Plant) -> bool {
    matches!(plant, Plant::Servo(servo) if servo.output == Output::Speed)
}

/// The way in samples of `ts`: y, or its integral where it is a speed.
pub fn positions(y: Vec<f64>, is_speed: bool, ts: f64) -> Vec<f64> {
    if is_speed { integral(&y, ts) } else { y }
}

/// The integral of x over samples of `ts`, from 0.
pub fn integral(x: &[f64], ts: f64) -> Vec<f64> {
    let mut sum = 0.0;
    x.iter()
        .map(|x| {
            let now = sum;
            sum += x * ts;
            now
        })
        .collect()
}

/// Motions spread over the recordings.
pub fn motions(model: &Loop, recordings: &[Signals]) -> Vec<Motion> {
    let is_speed = shows_speed(&model.plant);
    let mut all: Vec<Motion> = Vec::new();
    for signals in recordings {
        let y = held(&signals.y);
        let every = (y.len() * recordings.len() / MOTIONS).max(1);
        let positions = positions(y.clone(), is_speed, signals.sample_time_s);
        let velocities: Vec<f64> = if is_speed { y } else { speeds(signals) };
        let pairs = positions.iter().zip(&velocities).step_by(every);
        all.extend(pairs.map(|(position, velocity)| Motion { position: *position, velocity: *velocity }));
    }
    all
}
