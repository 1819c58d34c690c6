//! The plant that the search starts from: as stated; or, where it is unknown, the likeliest of several structures, each from a grid of its time
//! constants. Healthy recordings are part of the same likelihood: what is looked for is not in them.

use rayon::prelude::*;

use crate::control_loop::Loop;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Hypothesis;
use crate::estimate::likelihood::Data;
use crate::estimate::measure;
use crate::estimate::signals::Signals;
use crate::physics::Scales;
use crate::plant::{FirstOrder, Output, Plant, Servo, StateSpace, TransferFunction};

use super::nominal;
use super::options::Options;

/// The plant with its nominal fit, on the recordings as they are used.
pub struct Identified {
    /// The nominal fit.
    pub nominal: Fit,
    /// The data of the search.
    pub data: Data,
    /// Whether the plant came from the recordings.
    pub is_guessed: bool,
}

/// Time constants tried for each structure, from this many samples to this part of the recording.
const TIMES: usize = 8;
const SHORTEST_SAMPLES: f64 = 3.0;
const LONGEST_PART: f64 = 1.0 / 12.0;
/// Steps of a fit from each.
const STEPS: usize = 6;
/// Prior deviation of the logarithm of a number that was not stated.
const GUESSED_LOG: f64 = 1.5;

/// The stated plant's fit, or the likeliest plant's.
pub fn likeliest(
    model: &Loop,
    recordings: &[Signals],
    fitted: &[usize],
    healthy: &[Signals],
    options: &Options,
) -> Option<Identified> {
    let mut all = recordings.to_vec();
    all.extend_from_slice(healthy);
    let mut seen = fitted.to_vec();
    seen.extend(healthy.iter().map(Signals::len));
    let data_of = |hypothesis: &Hypothesis| {
        Data::new(hypothesis, all.clone(), seen.clone()).with_healthy(recordings.len())
    };
    if model.plant != Plant::Identify {
        let hypothesis = super::hypothesis(model, &all, options);
        let data = data_of(&hypothesis);
        return Some(Identified { nominal: nominal::fit(&hypothesis, &data)?, data, is_guessed: false });
    }
    let mut options = options.clone();
    options.priors.plant_log = GUESSED_LOG;
    // The structure is that of the healthy recordings, where there are any.
    let of = if healthy.is_empty() { recordings } else { healthy };
    let scales = measure::scales(model, of);
    let best = structures(&scales)
        .into_par_iter()
        .filter_map(|plant| {
            let candidate = Loop { plant, ..model.clone() };
            let hypothesis = super::hypothesis(&candidate, of, &options);
            let until =
                if healthy.is_empty() { fitted.to_vec() } else { of.iter().map(Signals::len).collect() };
            let data = Data::new(&hypothesis, of.to_vec(), until);
            let point = nominal::with_noise(&hypothesis, &hypothesis.own_point(), -2.0, -1.0 / 100.0, 0.0);
            let mut fit = Fit::at(&hypothesis, &point, &data)?;
            fit.descend(&data, STEPS, &[]);
            // Schwarz's cost of the plant's numbers.
            let cost = hypothesis.numbers.len() as f64 * libm::log(fit.rows.count.max(2) as f64);
            let realised = fit.hypothesis.realise(&fit.point)?;
            Some((fit.objective() + cost, super::as_file(&realised.model, 0.0).plant, realised.constant_load))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (_, plant, load) = best;
    let mut found = super::as_file(&Loop { plant, ..model.clone() }, load);
    // A load that stays is free in every fit.
    found.physics.truncate(model.physics.len());
    let hypothesis = super::hypothesis(&found, &all, &options);
    let data = data_of(&hypothesis);
    Some(Identified { nominal: nominal::fit(&hypothesis, &data)?, data, is_guessed: true })
}

/// Plants of each structure over their time constants; gains follow from the sizes of u and y.
fn structures(scales: &Scales) -> Vec<Plant> {
    let ts = scales.sample_time_s;
    let shortest = SHORTEST_SAMPLES * ts;
    let longest = (LONGEST_PART * scales.duration_s).max(2.0 * shortest);
    let ratio = longest / shortest;
    let times = (0..TIMES).map(|i| shortest * libm::pow(ratio, i as f64 / (TIMES - 1) as f64));
    let gain = scales.y / scales.u;
    let mut all = Vec::new();
    for time in times {
        for sign in [1.0, -1.0] {
            let gain = sign * gain;
            let delay_s = (0.1 * time).max(ts);
            all.push(Plant::FirstOrder(FirstOrder {
                gain,
                time_constant_s: time,
                delay_s,
                offset: scales.y_mean,
            }));
            all.push(Plant::TransferFunction(TransferFunction {
                num: vec![gain],
                den: vec![0.3 * time * time, 1.3 * time, 1.0],
                delay_s: 0.25 * ts,
                offset: scales.y_mean / gain,
            }));
            all.push(Plant::TransferFunction(TransferFunction {
                num: vec![gain / time],
                den: vec![1.0, 0.0],
                delay_s: 0.25 * ts,
                offset: 0.0,
            }));
            let viscous = sign * scales.u * time / scales.y;
            if sign > 0.0 {
                all.push(Plant::Servo(Servo {
                    output: Output::Position,
                    inertia: viscous * time,
                    viscous,
                    actuator_gain: 1.0,
                }));
            }
            let rate = std::f64::consts::TAU / (4.0 * time);
            all.push(Plant::StateSpace(StateSpace {
                a: vec![vec![-0.1 * rate, rate], vec![-rate, -0.1001 * rate]],
                b: vec![rate * gain, 0.0],
                c: vec![1.0, 0.0],
                d: 0.0,
            }));
        }
    }
    all
}
