//! `kind = "identify"`: a linear plant is fitted first, so that an export without any model can be diagnosed.
//!
//! `T dy/dt = offset + K u(t - delay) - y`. Starting values come from autoregressions with exogenous input by least squares
//! at several sample times and dead times (a fast sample time is for noise, a slow one for slow plants); the best are
//! searched on the simulated output (output error), and the dead time is chosen on the last third, which no fit has
//! seen. One time constant alone is tried: higher orders need an offset that the other plants don't have.

use nalgebra::{Matrix3, Vector3};

use crate::control_loop::Loop;
use crate::plant::{FirstOrder, Plant};
use crate::{Error, Result};

use super::fit::{Effort, Fit};
use super::model::Model;
use super::signals::{Signals, deviation};
use super::whiten::Whitener;

/// Sample times tried, in samples.
const STRIDES: [usize; 5] = [1, 4, 16, 64, 256];
/// Dead times tried, in samples.
const DELAYS: [usize; 10] = [0, 1, 2, 3, 5, 8, 13, 21, 34, 55];
/// Starting points that are searched to the end.
const SEARCHED: usize = 4;

/// The loop with a plant fitted to the recording; `None` where its plant is known.
///
/// # Errors
/// No stable first-order plant follows the recorded u.
pub fn plant(model: &Loop, signals: &Signals) -> Result<Option<Loop>> {
    if model.plant != Plant::Identify {
        return Ok(None);
    }
    let cut = 2 * signals.len() / 3;
    let (first, last) = (signals.part(0, cut), signals.part(cut, signals.len()));
    let mut starts: Vec<Fit> = DELAYS
        .iter()
        .filter(|delay| **delay < first.len() / 10)
        .flat_map(|delay| STRIDES.iter().filter_map(|stride| arx(&first, *stride, *delay)))
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
            Some((unseen.variance, found))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, found)| Some(found))
        .ok_or_else(|| {
            Error::new("no stable linear plant of first order follows the recorded u")
                .allowed("a recording in which u moves y; or a plant in the loop file")
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
        .map(|found| super::model::plant_numbers(&found.plant).into_iter().map(|(_, value, _)| value).collect())
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

/// `y[n+s] = a y[n] + b mean(u) + c` by least squares, at a stride of s samples; `None` where it is not a stable lag.
fn arx(signals: &Signals, stride: usize, delay: usize) -> Option<FirstOrder> {
    let n = signals.len();
    if n < 20 * stride + delay {
        return None;
    }
    let mut cumulated = vec![0.0];
    for u in &signals.u {
        cumulated.push(cumulated.last().copied().unwrap_or(0.0) + u);
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let (y_scale, u_scale) = (deviation(&signals.y).max(1e-300), deviation(&signals.u).max(1e-300));
    let (y0, u0) = (*signals.y.first()?, *signals.u.first()?);
    for i in (delay..n - stride).step_by(stride.div_ceil(4)) {
        let (y, next) = (signals.y.get(i)?, signals.y.get(i + stride)?);
        let mean = (cumulated.get(i + stride - delay)? - cumulated.get(i - delay)?) / stride as f64;
        let row = Vector3::new((y - y0) / y_scale, (mean - u0) / u_scale, 1.0);
        if row.iter().all(|x| x.is_finite()) && next.is_finite() {
            normal += row * row.transpose();
            right += row * ((next - y0) / y_scale);
        }
    }
    let solved = normal.lu().solve(&right)?;
    let (a, b, c) = (solved[0], solved[1], solved[2]);
    if !(a > 0.0 && a < 1.0) {
        return None;
    }
    let gain = b / (1.0 - a) * y_scale / u_scale;
    let plant = FirstOrder {
        gain,
        time_constant_s: -(stride as f64) * signals.sample_time_s / libm::log(a),
        delay_s: delay as f64 * signals.sample_time_s,
        offset: y0 + c / (1.0 - a) * y_scale - gain * u0,
    };
    (plant.time_constant_s.is_finite() && plant.gain.is_finite() && plant.offset.is_finite()).then_some(plant)
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
