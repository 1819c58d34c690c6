//! `kind = "identify"`: a linear plant is fitted first, so that an export without any model can be diagnosed.
//!
//! `T dy/dt = offset + K u(t - delay) - y`. Given T and the dead time, K and the offset follow by least squares on the simulated output; the
//! best points of a grid over both are searched on (output error), and what is taken is the best on the last third, which no fit
//! has seen. One-step regressions (ARX) were tried: a hidden limit of the actuator makes them unstable. One time constant alone is tried: higher orders need an offset that the other plants don't have.

use nalgebra::{Matrix3, Vector3};

use crate::control_loop::Loop;
use crate::plant::{FirstOrder, Plant};
use crate::{Error, Result};

use super::fit::{Effort, Fit};
use super::model::Model;
use super::signals::{Signals, deviation};
use super::whiten::Whitener;

/// Time constants tried, from three samples to the length of the recording, evenly in their logarithm.
const TIME_CONSTANTS: usize = 18;
/// Dead times tried, in samples.
const DELAYS: [usize; 10] = [0, 1, 2, 3, 5, 8, 13, 21, 34, 55];
/// Longest time constant that a recording can show, in its own lengths.
const SLOWEST: f64 = 10.0;
/// Part of y's variance on the unseen third that a plant may leave, else nothing was identified.
const LEFT_OVER: f64 = 0.5;
/// Starting points that are searched to the end.
const SEARCHED: usize = 4;

/// The loop with a plant fitted to the recording; `None` where its plant is known.
///
/// # Errors
/// No first-order plant explains half of y on the last third.
pub fn plant(model: &Loop, signals: &Signals) -> Result<Option<Loop>> {
    if model.plant != Plant::Identify {
        return Ok(None);
    }
    let cut = 2 * signals.len() / 3;
    let (first, last) = (signals.part(0, cut), signals.part(cut, signals.len()));
    let shortest = 3.0 * signals.sample_time_s;
    let ratio = (signals.duration_s() / shortest).max(1.0);
    let lags: Vec<f64> = (0..TIME_CONSTANTS)
        .map(|i| shortest * libm::pow(ratio, i as f64 / (TIME_CONSTANTS - 1) as f64))
        .collect();
    let mut starts: Vec<Fit> = DELAYS
        .iter()
        .filter(|delay| **delay < first.len() / 10)
        .flat_map(|delay| lags.iter().filter_map(|lag| lagged(&first, *lag, *delay)))
        .filter_map(|plant| fit(model, plant, &first))
        .collect();
    starts.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    starts
        .into_iter()
        .take(SEARCHED)
        .filter_map(|start| {
            let fitted = start.search(&first, Effort::FULL);
            let (found, _) = fitted.model.loop_at(&fitted.model.x)?;
            let unseen = Fit::start(&Model::refit(&found, &last), &last, &Whitener::none())?;
            let slow = matches!(&found.plant, Plant::FirstOrder(p) if p.time_constant_s > SLOWEST * signals.duration_s());
            let variance = deviation(&last.y) * deviation(&last.y);
            (!slow && unseen.variance < LEFT_OVER * variance).then_some((unseen.variance, found))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, found)| Some(found))
        .ok_or_else(|| {
            Error::new("no linear plant of first order follows the recorded u on its last third: nothing can be said on such a plant")
                .allowed("a recording in which u moves y and reaches the plant unchanged (--healthy), or a plant in the loop file")
        })
}

/// The loop with its numbers from healthy recordings: each is fitted by itself, the median of every number is taken.
///
/// # Errors
/// The model follows none of them.
pub fn from_healthy(model: &Loop, healthy: &[Signals]) -> Result<Loop> {
    let fitted: Vec<Loop> = healthy
        .iter()
        .map(|signals| {
            let identified = plant(model, signals)?;
            let start = Model::refit(identified.as_ref().unwrap_or(model), signals);
            let lost = || Error::new("the model can't follow the u of a healthy recording: it diverges");
            let fit = Fit::start(&start, signals, &Whitener::none()).ok_or_else(lost)?;
            let fit = fit.search(signals, Effort::FULL).settle(signals, Effort::FULL);
            fit.model.loop_at(&fit.model.x).map(|found| found.0).ok_or_else(lost)
        })
        .collect::<Result<_>>()?;
    let Some(first) = fitted.first() else { return Ok(model.clone()) };
    let numbers: Vec<Vec<f64>> = fitted
        .iter()
        .map(|found| {
            super::model::plant_numbers(&found.plant).into_iter().map(|(_, value, _)| value).collect()
        })
        .collect();
    let median = |i: usize| {
        let mut values: Vec<f64> = numbers.iter().filter_map(|row| row.get(i).copied()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let medians: Vec<f64> = (0..numbers.first().map_or(0, Vec::len)).map(median).collect();
    let plant = super::model::with_plant_numbers(&first.plant, &medians);
    Ok(Loop { plant, ..first.clone() })
}

fn fit(model: &Loop, plant: FirstOrder, signals: &Signals) -> Option<Fit> {
    let candidate = Loop { plant: Plant::FirstOrder(plant), ..model.clone() };
    Fit::start(&Model::refit(&candidate, signals), signals, &Whitener::none())
}

/// Gain and offset by least squares for a time constant and a dead time: y is linear in both once u is lagged. `None` where
/// u does not move y.
fn lagged(signals: &Signals, time_constant_s: f64, delay: usize) -> Option<FirstOrder> {
    let keep = libm::exp(-signals.sample_time_s / time_constant_s);
    let (y_scale, u_scale) = (deviation(&signals.y).max(1e-300), deviation(&signals.u).max(1e-300));
    let (y0, u0) = (*signals.y.iter().find(|y| y.is_finite())?, *signals.u.first()?);
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let (mut lag, mut start) = (0.0, 1.0);
    for (n, y) in signals.y.iter().enumerate() {
        let row = Vector3::new(lag, 1.0, start);
        if y.is_finite() {
            normal += row * row.transpose();
            right += row * ((y - y0) / y_scale);
        }
        let u = n.checked_sub(delay).and_then(|at| signals.u.get(at)).unwrap_or(&u0);
        lag = keep * lag + (1.0 - keep) * (u - u0) / u_scale;
        start *= keep;
    }
    let solved = normal.lu().solve(&right)?;
    let gain = solved[0] * y_scale / u_scale;
    let plant = FirstOrder {
        gain,
        time_constant_s,
        delay_s: delay as f64 * signals.sample_time_s,
        offset: y0 + solved[1] * y_scale - gain * u0,
    };
    (gain != 0.0 && gain.is_finite() && plant.offset.is_finite()).then_some(plant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::Controller;

    /// A lag of 12 s with 0.8 s of dead time, driven by steps of u: its own numbers come back.
    #[test]
    fn a_lag_with_dead_time_is_identified() {
        let truth = FirstOrder { gain: 0.7, time_constant_s: 12.0, delay_s: 0.8, offset: 20.0 };
        let nominal = Loop { sample_time_s: 0.1, controller: Controller::Recorded, ..Loop::paper() };
        let real = Loop { plant: Plant::FirstOrder(truth), ..nominal.clone() };
        let u: Vec<f64> = (0..6000).map(|i| if (i / 700) % 2 == 0 { 10.0 } else { 30.0 }).collect();
        let y = crate::simulate::replay(&real, &u, &[], 0, None).unwrap().y;
        let r = y.clone();
        let signals =
            Signals { sample_time_s: 0.1, start_s: 0.0, origin_s: 0.0, r, y, u, inputs: Vec::new() };
        let unknown = Loop { plant: Plant::Identify, ..nominal };
        let Plant::FirstOrder(found) = plant(&unknown, &signals).unwrap().unwrap().plant else { panic!() };
        assert!((found.gain - 0.7).abs() < 0.01, "{found:?}");
        assert!((found.time_constant_s - 12.0).abs() < 0.2, "{found:?}");
        assert!((found.delay_s - 0.8).abs() < 0.1, "{found:?}");
        assert!((found.offset - 20.0).abs() < 0.2, "{found:?}");
    }
}
