//! Runs of a loop.

use drift_sim::control_loop;
use drift_sim::reference::Reference;
use drift_sim::simulate::{self as sampled, DEFAULT_SAMPLES, Driving, Trace, samples, time_s};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::control_loop::Loop;
use crate::error::raised;
use crate::interrupt;
use crate::recording::Recording;

/// A run: one value a sample.
#[pyclass(frozen, module = "drift._drift", get_all)]
pub struct Simulation {
    t: Py<PyArray1<f64>>,
    r: Py<PyArray1<f64>>,
    y: Py<PyArray1<f64>>,
    u: Py<PyArray1<f64>>,
    true_y: Py<PyArray1<f64>>,
    /// The loop's measured inputs, in its order.
    inputs: Vec<Py<PyArray1<f64>>>,
}

/// What a run follows.
enum Followed {
    Recording(Driving),
    Given(Vec<f64>, Vec<Vec<f64>>),
    Random(Box<Reference>, usize),
}

impl Followed {
    fn run(
        self,
        model: &control_loop::Loop,
        seed: u64,
        length: Option<usize>,
    ) -> drift_sim::Result<(Vec<f64>, Vec<Vec<f64>>, Trace)> {
        Ok(match self {
            Self::Recording(driving) => {
                let trace = driving.trace(model, seed, length)?;
                let cut = |x: &[f64]| x.get(..trace.y.len()).unwrap_or(x).to_vec();
                (cut(driving.r()), driving.columns().iter().map(|x| cut(x)).collect(), trace)
            }
            Self::Given(mut r, mut inputs) => {
                if let Some(length) = length {
                    r.truncate(length);
                    inputs.iter_mut().for_each(|column| column.truncate(length));
                }
                if inputs.iter().any(|column| column.len() != r.len()) {
                    return Err(drift_sim::Error::new(
                        "a measured input has another length than the reference",
                    )
                    .allowed("one value for each sample of the reference"));
                }
                let names = model.input_columns();
                let column = |name: &str| {
                    if name == "r" {
                        return Ok(r.as_slice());
                    }
                    let place = names.iter().position(|known| known == name);
                    place.and_then(|place| inputs.get(place)).map(Vec::as_slice).ok_or_else(|| {
                        drift_sim::Error::new(format!(
                            "the measured input is made of {name}, which is not given"
                        ))
                        .allowed("a recording as the reference")
                    })
                };
                let made = model.inputs.iter().map(|input| input.values_of(column));
                let made: Vec<Vec<f64>> = made.collect::<drift_sim::Result<_>>()?;
                let trace = sampled::simulate(model, &r, &made, seed, None)?;
                (r, inputs, trace)
            }
            Self::Random(reference, length) => {
                let r = reference.take_samples(length);
                let trace = sampled::simulate(model, &r, &[], seed, None)?;
                (r, Vec::new(), trace)
            }
        })
    }
}

/// Runs a loop over a recording, over a given reference, or over random levels.
#[pyfunction]
#[pyo3(signature = (model, *, recording, reference, inputs, duration_s, seed, levels))]
#[expect(clippy::too_many_arguments, reason = "they are Python's keywords")]
pub fn simulate(
    py: Python<'_>,
    model: &Loop,
    recording: Option<&Recording>,
    reference: Option<PyReadonlyArray1<'_, f64>>,
    inputs: Vec<PyReadonlyArray1<'_, f64>>,
    duration_s: Option<f64>,
    seed: u64,
    levels: (f64, f64, u64),
) -> PyResult<Simulation> {
    let model = model.0.clone();
    let length =
        duration_s.map(|duration| samples(duration, model.sample_time_s)).transpose().map_err(raised)?;
    let followed = match (recording, reference) {
        (Some(recording), _) => {
            Followed::Recording(Driving::new(recording.0.as_ref().clone(), &model).map_err(raised)?)
        }
        (None, Some(reference)) => {
            let inputs = inputs.iter().map(|column| column.as_array().to_vec()).collect();
            Followed::Given(reference.as_array().to_vec(), inputs)
        }
        (None, None) => {
            let (mean, sd, hold) = levels;
            let random = Box::new(Reference::random(mean, sd, hold, seed));
            Followed::Random(random, length.unwrap_or(DEFAULT_SAMPLES))
        }
    };
    let sample_time_s = model.sample_time_s;
    let (r, inputs, trace) = interrupt::run(py, move || followed.run(&model, seed, length))?;
    let t: Vec<f64> = (0..trace.y.len()).map(|n| time_s(n, sample_time_s)).collect();
    let array = |numbers: Vec<f64>| numbers.into_pyarray(py).unbind();
    Ok(Simulation {
        t: array(t),
        r: array(r),
        y: array(trace.y),
        u: array(trace.u),
        true_y: array(trace.true_y),
        inputs: inputs.into_iter().map(array).collect(),
    })
}
