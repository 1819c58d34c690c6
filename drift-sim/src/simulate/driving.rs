//! What drives a run from outside: how long it is, and what a recording gives to it.

use crate::control_loop::Loop;
use crate::recording::{MEMORY_LIMIT_BYTES, Recording, SAMPLE_BYTES};
use crate::sentences::typed;
use crate::{Error, Result};

use super::{Start, Trace, replay, simulate};

/// Samples of a run whose length nobody states.
pub const DEFAULT_SAMPLES: usize = 10_000;

/// Samples of a run of so many seconds, at least one.
///
/// # Errors
/// No length, or more samples than a recording of [`MEMORY_LIMIT_BYTES`] holds.
pub fn samples(duration_s: f64, sample_time_s: f64) -> Result<usize> {
    samples_within(duration_s, sample_time_s, MEMORY_LIMIT_BYTES)
}

/// The same where a recording may take so many bytes.
///
/// # Errors
/// No length, or more samples than such a recording holds, so that nothing here could read them.
pub fn samples_within(duration_s: f64, sample_time_s: f64, limit_bytes: u64) -> Result<usize> {
    if duration_s.is_nan() || duration_s <= 0.0 {
        let what = format!("--duration {}", typed(duration_s));
        return Err(Error::new(what).allowed("a number of seconds above 0"));
    }
    let samples = (duration_s / sample_time_s).round().max(1.0);
    let most = (limit_bytes / SAMPLE_BYTES) as f64;
    if samples > most {
        let allowed = format!(
            "--duration up to {} at this sample time, which is {} samples; or a larger --memory-limit",
            typed(most * sample_time_s),
            typed(most)
        );
        let what = format!(
            "--duration {} is {} samples of {} s",
            typed(duration_s),
            typed(samples),
            typed(sample_time_s)
        );
        return Err(Error::new(what).allowed(allowed));
    }
    Ok(samples as usize)
}

/// Time of sample n, s: n*Ts without the last digits that the product's rounding adds, where nine decimals of a sample say it
/// all.
pub fn time_s(n: usize, sample_time_s: f64) -> f64 {
    let per_second = (1.0 / sample_time_s).round();
    if (per_second * sample_time_s - 1.0).abs() < 1e-15 {
        n as f64 / per_second
    } else {
        n as f64 * sample_time_s
    }
}

/// What drives one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Reference.
    pub r: f64,
    /// Controller output, only where the controller is recorded.
    pub u: Option<f64>,
    /// The loop's measured inputs, in its order.
    pub inputs: Vec<f64>,
    /// The columns that they are made of, in the order of [`Loop::input_columns`].
    pub measured: Vec<f64>,
}

impl Row {
    /// One of a loop without measured inputs.
    pub fn of_reference(r: f64) -> Self {
        Self { r, u: None, inputs: Vec::new(), measured: Vec::new() }
    }
}

/// A recording that drives a simulation: its r, its inputs and, for a recorded controller, its u.
#[derive(Debug, Clone)]
pub struct Driving {
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
    /// One signal for each of the loop's inputs.
    inputs: Vec<Vec<f64>>,
    /// The columns that they are made of, each once.
    columns: Vec<Vec<f64>>,
    recorded_controller: bool,
}

impl Driving {
    /// The columns r, y and u and one by name for each of the loop's inputs, at the loop's sample time and without a
    /// gap: a simulation can't make up what drives it.
    ///
    /// # Errors
    /// Another sample time than the loop's, an input that the recording lacks, or a value that is missing.
    pub fn new(recording: Recording, model: &Loop) -> Result<Self> {
        let name = recording.name.clone();
        let of_loop = || {
            model.check_sample_time(recording.sample_time_s)?;
            let inputs = model.inputs.iter().map(|input| input.values(&recording));
            let column = |name: &String| recording.column(name).map(<[f64]>::to_vec);
            let driving = Self {
                inputs: inputs.collect::<Result<_>>()?,
                columns: model.input_columns().iter().map(column).collect::<Result<_>>()?,
                recorded_controller: !model.has_law(),
                r: recording.r,
                y: recording.y,
                u: recording.u,
            };
            driving.complete(recording.sample_time_s)?;
            Ok(driving)
        };
        of_loop().map_err(|e: Error| e.in_file(name))
    }

    fn complete(&self, sample_time_s: f64) -> Result<()> {
        let own = [("r", &self.r), ("y", &self.y), ("u", &self.u)];
        for (name, column) in own.into_iter().chain(self.inputs.iter().map(|column| ("an input", column))) {
            if let Some(n) = column.iter().position(|value| !value.is_finite()) {
                let t = n as f64 * sample_time_s;
                return Err(Error::new(format!("{name} is missing {} s from the start", typed(t)))
                    .allowed("a recording without gaps in r, y, u and the loop's inputs"));
            }
        }
        Ok(())
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.r.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.r.is_empty()
    }

    /// The operating point that the recording begins at.
    pub fn start(&self, model: &Loop) -> Start {
        Start::from_recording(model, &self.r, &self.y, &self.u)
    }

    /// Runs the loop over the first `samples` of the recording, or all of it, from the operating point that it begins at.
    ///
    /// # Errors
    /// The loop is unsound or diverges.
    pub fn trace(&self, model: &Loop, seed: u64, samples: Option<usize>) -> Result<Trace> {
        let length = samples.map_or(self.len(), |samples| samples.min(self.len()));
        let first = |column: &Vec<f64>| column.get(..length).unwrap_or(&[]).to_vec();
        let inputs: Vec<Vec<f64>> = self.inputs.iter().map(first).collect();
        let start = self.start(model);
        if self.recorded_controller {
            replay(model, &first(&self.u), &inputs, seed, Some(&start))
        } else {
            simulate(model, &first(&self.r), &inputs, seed, Some(&start))
        }
    }

    /// The reference.
    pub fn r(&self) -> &[f64] {
        &self.r
    }

    /// The columns that the loop's measured inputs are made of, in the order of [`Loop::input_columns`].
    pub fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    /// What drives sample `n`; NaN behind the end.
    pub fn row(&self, n: usize) -> Row {
        let at = |column: &[f64]| column.get(n).copied().unwrap_or(f64::NAN);
        let each = |columns: &[Vec<f64>]| columns.iter().map(|column| at(column)).collect();
        Row {
            r: at(&self.r),
            u: self.recorded_controller.then(|| at(&self.u)),
            inputs: each(&self.inputs),
            measured: each(&self.columns),
        }
    }
}
