//! The structures that an unknown plant may have, each over a grid of time constants and gains: where an identification begins.

use crate::estimate::signals::Signals;
use crate::physics::Scales;
use crate::plant::{FirstOrder, Output, Plant, Servo, StateSpace, Tank, TransferFunction};

/// Time constants tried for each structure, from this many samples to this part of the recording.
const TIMES: usize = 8;
const SHORTEST_SAMPLES: f64 = 3.0;
const LONGEST_PART: f64 = 1.0 / 12.0;

/// Structures that are tried; two of them have two poles and a zero: one may swing, the other is what a vessel behind a line is.
pub const STRUCTURES: usize = 8;
pub const SWINGS: usize = 5;
pub const HAS_ZERO: usize = 6;

/// Factor by which two gains differ that are both tried.
const OTHER_GAIN: f64 = 3.0;

/// Plants of each structure over their time constants and the gains at each, structure by structure in turn.
pub fn structures(scales: &Scales, of: &[Signals], signs: &[f64]) -> Vec<Plant> {
    let ts = scales.sample_time_s;
    let shortest = SHORTEST_SAMPLES * ts;
    let longest = (LONGEST_PART * scales.duration_s).max(2.0 * shortest);
    let ratio = longest / shortest;
    let times = (0..TIMES).map(|i| shortest * libm::pow(ratio, i as f64 / (TIMES - 1) as f64));
    let gains = |time: f64| {
        let of_sizes = scales.y / scales.u;
        let of_changes = gain_of_changes(of, (time / ts) as usize, scales.noise);
        let is_other = |gain: &f64| (gain / of_sizes).max(of_sizes / gain) > OTHER_GAIN;
        std::iter::once(of_sizes).chain(of_changes.filter(is_other))
    };
    let each = times.flat_map(|time| gains(time).map(move |gain| (time, gain)));
    let signed = each.flat_map(|(time, gain)| signs.iter().map(move |sign| (time, sign * gain)));
    signed.flat_map(|(time, gain)| of_time(scales, time, gain)).collect()
}

/// Changes of y over so many samples, less the noise's, over those of u. The sizes of y and u tell no gain where u makes up for a load and y stays.
pub(super) fn gain_of_changes(of: &[Signals], lag: usize, noise: f64) -> Option<f64> {
    let (mut of_y, mut of_u, mut count) = (0.0, 0.0, 0.0_f64);
    for signals in of {
        let later = signals.y.iter().zip(&signals.u).skip(lag);
        for ((y, u), (later_y, later_u)) in signals.y.iter().zip(&signals.u).zip(later) {
            let (y, u) = (later_y - y, later_u - u);
            if y.is_finite() {
                of_y += y * y;
                of_u += u * u;
                count += 1.0;
            }
        }
    }
    let gain = libm::sqrt((of_y - 2.0 * noise * noise * count).max(0.0) / of_u);
    (gain.is_finite() && gain > 0.0).then_some(gain)
}

/// One plant of each structure.
fn of_time(scales: &Scales, time: f64, gain: f64) -> [Plant; STRUCTURES] {
    let ts = scales.sample_time_s;
    let transfer = |num: Vec<f64>, den: Vec<f64>, offset: f64| {
        Plant::TransferFunction(TransferFunction { num, den, delay_s: 0.25 * ts, offset })
    };
    let offset = scales.y_mean / gain - scales.u_mean;
    // The sign of a servo is its actuator's: mass and friction are positive.
    let viscous = scales.u * time / scales.y;
    let servo = |output, inertia, viscous| {
        Plant::Servo(Servo { output, inertia, viscous, actuator_gain: libm::copysign(1.0, gain) })
    };
    let rate = std::f64::consts::TAU / (4.0 * time);
    [
        Plant::FirstOrder(FirstOrder {
            gain,
            time_constant_s: time,
            delay_s: (0.1 * time).max(ts),
            offset: scales.y_mean - gain * scales.u_mean,
        }),
        transfer(vec![gain], vec![0.3 * time * time, 1.3 * time, 1.0], offset),
        transfer(vec![gain / time], vec![1.0, 0.0], 0.0),
        servo(Output::Position, viscous * time, viscous),
        servo(Output::Speed, time / gain.abs(), 1.0 / gain.abs()),
        Plant::StateSpace(StateSpace {
            a: vec![vec![-0.1 * rate, rate], vec![-rate, -0.1001 * rate]],
            b: vec![rate * gain, 0.0],
            c: vec![1.0, 0.0],
            d: 0.0,
        }),
        transfer(vec![0.4 * gain * time, gain], vec![0.1 * time * time, 1.1 * time, 1.0], offset),
        Plant::Tank(Tank {
            area: time / gain.abs(),
            inflow_gain: libm::copysign(1.0, gain),
            outflow: 2.0 * libm::sqrt(scales.y_mean.max(scales.y)) / gain.abs(),
        }),
    ]
}

/// The same plant with a gain of one: nothing tells a tank's cross-section, so that its flows count as the drive that makes them.
pub fn in_units_of_drive(plant: Plant) -> Plant {
    match plant {
        Plant::Tank(Tank { area, inflow_gain, outflow }) => {
            let size = inflow_gain.abs().max(1e-300);
            Plant::Tank(Tank { area: area / size, inflow_gain: inflow_gain / size, outflow: outflow / size })
        }
        plant => plant,
    }
}

/// Whether y is a level throughout: no tank holds less than nothing.
pub fn is_level(of: &[Signals]) -> bool {
    of.iter().all(|signals| signals.y.iter().all(|y| !y.is_finite() || *y > 0.0))
}
