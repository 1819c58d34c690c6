//! The monitor: fed sample by sample or in arrays, and over a whole recording.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use drift_core::Input;
use drift_sim::baseline_file::{BaselineFile, PointColumns};
use drift_sim::monitor::{self as library, Chart, Hop, Outputs, Runner, Stopped, Summary};
use drift_sim::recording::{ColumnMap, RecordingStream};
use drift_sim::{Error, Result, sentences};
use numpy::ndarray::ArrayView1;
use numpy::{Element, PyReadonlyArray1};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::calibration::Baseline;
use crate::error::raised;
use crate::page::{self, Shown};
use crate::recording::Recording;
use crate::{interrupt, reading};

/// Samples that are pushed between two looks for Ctrl-C: some hundredths of a second.
const SAMPLES_AT_ONCE: usize = 1 << 22;

/// A monitor at work.
#[pyclass(module = "drift._drift")]
pub struct Monitor {
    runner: Runner,
    point: Option<PointColumns>,
    start_s: f64,
    sample_time_s: f64,
    samples: u64,
}

/// A number that a sample is made of.
trait Number: Element + Copy + Send + Sync {
    fn single(self) -> f32;
}

impl Number for f64 {
    #[inline]
    fn single(self) -> f32 {
        self as f32
    }
}

impl Number for f32 {
    #[inline]
    fn single(self) -> f32 {
        self
    }
}

/// What the monitor is told of a sample: what is not a number is missing, as in a recording.
#[inline]
fn input(r: f32, y: f32, u: f32) -> Input<f32> {
    if r.is_nan() || y.is_nan() || u.is_nan() { Input::Missing } else { Input::Sample { r, y, u } }
}

/// A decision as the line of JSON that the command writes.
fn line(hop: &Hop) -> PyResult<String> {
    let mut line = Vec::new();
    library::write_hop(&mut line, hop).map_err(|e| PyValueError::new_err(e.to_string()))?;
    String::from_utf8(line).map_err(|e| PyValueError::new_err(e.to_string()))
}

impl Monitor {
    #[inline]
    fn tick(&mut self, input: Input<f32>) -> Option<Hop> {
        let t_s = self.start_s + self.samples as f64 * self.sample_time_s;
        self.samples += 1;
        self.runner.tick(t_s, input)
    }

    fn push_all<T: Number>(
        &mut self,
        r: &ArrayView1<'_, T>,
        y: &ArrayView1<'_, T>,
        u: &ArrayView1<'_, T>,
        hops: &mut Vec<Hop>,
    ) {
        if let (Some(r), Some(y), Some(u)) = (r.to_slice(), y.to_slice(), u.to_slice()) {
            let samples = r.iter().zip(y).zip(u);
            hops.extend(
                samples.filter_map(|((r, y), u)| self.tick(input(r.single(), y.single(), u.single()))),
            );
        } else {
            let samples = r.iter().zip(y).zip(u);
            hops.extend(
                samples.filter_map(|((r, y), u)| self.tick(input(r.single(), y.single(), u.single()))),
            );
        }
    }

    /// Array views of one type, pushed a part at a time.
    fn push_views<T: Number>(
        &mut self,
        py: Python<'_>,
        signals: [ArrayView1<'_, T>; 3],
    ) -> PyResult<Vec<String>> {
        let length = signals[0].len();
        if signals.iter().any(|signal| signal.len() != length) {
            let [r, y, u] = signals.map(|signal| signal.len());
            return Err(raised(
                Error::new(format!("r, y and u have {r}, {y} and {u} values")).allowed("equally many"),
            ));
        }
        let mut hops = Vec::new();
        let mut from = 0;
        while from < length {
            let to = (from + SAMPLES_AT_ONCE).min(length);
            let [r, y, u] = signals.each_ref().map(|signal| signal.slice(numpy::ndarray::s![from..to]));
            py.detach(|| self.push_all(&r, &y, &u, &mut hops));
            py.check_signals()?;
            from = to;
        }
        hops.iter().map(line).collect()
    }
}

#[pymethods]
impl Monitor {
    #[new]
    fn new(baseline: &Baseline, sample_time_s: Option<f64>, start_s: f64) -> PyResult<Self> {
        let sample_time_s = sample_time_s.unwrap_or_else(|| baseline.0.timing.sample_time_s());
        let config = baseline.0.config().map_err(raised)?;
        let runner = Runner::new(&config, sample_time_s).map_err(raised)?;
        Ok(Self { runner, point: baseline.0.operating_point.clone(), start_s, sample_time_s, samples: 0 })
    }

    #[getter]
    fn samples(&self) -> u64 {
        self.samples
    }

    /// Time of the next sample, s.
    #[getter]
    fn time_s(&self) -> f64 {
        self.start_s + self.samples as f64 * self.sample_time_s
    }

    /// What the loop's operating point is from the next sample on, in the baseline's order.
    fn operating_point(&mut self, measured: Vec<f64>) -> PyResult<()> {
        let Some(point) = &self.point else {
            return Err(raised(
                Error::new("the baseline was learnt without an operating point")
                    .allowed("a baseline of calibrate(..., operating_point=[...])"),
            ));
        };
        if measured.len() != point.columns.len() {
            return Err(raised(
                Error::new(format!("an operating point of {} numbers", measured.len()))
                    .allowed(format!("one for each of {}", point.columns.join(", "))),
            ));
        }
        self.runner.operating_point(point.point(&measured));
        Ok(())
    }

    /// One sample; the decision as JSON where one falls.
    fn push(&mut self, r: f64, y: f64, u: f64) -> PyResult<Option<String>> {
        self.tick(input(r as f32, y as f32, u as f32)).as_ref().map(line).transpose()
    }

    /// One sample with the loop in manual.
    fn push_manual(&mut self) -> PyResult<Option<String>> {
        self.tick(Input::Manual).as_ref().map(line).transpose()
    }

    /// Arrays of float64 or of float32; all decisions that fall, as JSON.
    fn push_arrays(
        &mut self,
        py: Python<'_>,
        r: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
        u: &Bound<'_, PyAny>,
    ) -> PyResult<Vec<String>> {
        if let (Ok(r), Ok(y), Ok(u)) = (doubles(r), doubles(y), doubles(u)) {
            return self.push_views(py, [r.as_array(), y.as_array(), u.as_array()]);
        }
        if let (Ok(r), Ok(y), Ok(u)) = (singles(r), singles(y), singles(u)) {
            return self.push_views(py, [r.as_array(), y.as_array(), u.as_array()]);
        }
        Err(PyTypeError::new_err("r, y and u are arrays of one dimension, all float64 or all float32"))
    }
}

fn doubles<'py>(values: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f64>> {
    Ok(values.extract()?)
}

fn singles<'py>(values: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f32>> {
    Ok(values.extract()?)
}

/// What the monitor found in a whole recording.
#[pyclass(frozen, module = "drift._drift")]
pub struct Monitoring {
    summary: Summary,
    lines: String,
    chart: Chart,
    baseline: BaselineFile,
    columns: ColumnMap,
    shown: OnceLock<Shown>,
}

#[pymethods]
impl Monitoring {
    /// Every decision as a line of JSON, and the summary as the last.
    fn json_lines(&self) -> &str {
        &self.lines
    }

    fn answer(&self) -> String {
        page::answer(&sentences::monitoring(&self.summary, &self.summary.clock()))
    }

    fn html(&self) -> PyResult<String> {
        self.shown().map(|shown| shown.html().to_owned())
    }

    fn first_screen(&self) -> PyResult<String> {
        self.shown().map(|shown| shown.first_screen().to_owned())
    }

    /// Signals, residuals and events.
    fn figure(&self) -> PyResult<String> {
        page::figure(&self.chart.figure(&self.summary))
    }
}

impl Monitoring {
    fn shown(&self) -> PyResult<&Shown> {
        if let Some(shown) = self.shown.get() {
            return Ok(shown);
        }
        let page = library::page(&self.summary, &self.chart, &self.baseline, &self.columns, String::new());
        let made = Shown::of(page).map_err(raised)?;
        Ok(self.shown.get_or_init(|| made))
    }
}

/// Runs a monitor over a recording in memory, or over a file without holding it.
#[pyfunction]
#[pyo3(signature = (baseline, *, recording, path, operating_point, reading))]
pub fn watch(
    py: Python<'_>,
    baseline: &Baseline,
    recording: Option<&Recording>,
    path: Option<PathBuf>,
    operating_point: Vec<String>,
    reading: Option<Bound<'_, PyDict>>,
) -> PyResult<Monitoring> {
    let baseline = baseline.0.clone();
    let columns = baseline.point_columns(&operating_point).map_err(raised)?;
    let further = columns.as_ref().map_or_else(Vec::new, |point| point.columns.clone());
    let options = reading::options(reading.as_ref(), further.clone())?;
    let recording = recording.map(|recording| Arc::clone(&recording.0));
    interrupt::run(py, move || {
        let mut stream = match (&recording, &path) {
            (Some(recording), _) => RecordingStream::from_recording(recording, &further)?,
            (None, Some(path)) => RecordingStream::open(path, &options)?,
            (None, None) => {
                return Err(Error::new("nothing to monitor").allowed("a recording, a table or a path"));
            }
        };
        run(&mut stream, baseline, columns.as_ref())
    })
}

fn run(
    stream: &mut RecordingStream,
    baseline: BaselineFile,
    point: Option<&PointColumns>,
) -> Result<Monitoring> {
    let config = baseline.config()?;
    let (mut chart, mut lines) = (Chart::new(&config), Vec::new());
    let outputs =
        Outputs { json: Some(&mut lines), chart: Some(&mut chart), operating_point: point, progress: None };
    let summary = library::watch(stream, &config, outputs).map_err(|stopped| match stopped {
        Stopped::Input(error) => error,
        Stopped::Writing(error) => Error::new(format!("can't be written: {error}")),
    })?;
    let lines = String::from_utf8(lines).map_err(|e| Error::new(format!("JSON can't be written: {e}")))?;
    let columns = stream.columns().clone();
    Ok(Monitoring { summary, lines, chart, baseline, columns, shown: OnceLock::new() })
}
