//! The monitor: fed sample by sample or in arrays, and over a whole recording.

use std::path::PathBuf;
use std::sync::Arc;

use drift_core::Input;
use drift_sim::baseline_file::{BaselineFile, PointColumns};
use drift_sim::monitor::{self as library, Chart, Hop, Outputs, Runner, Stopped, Summary};
use drift_sim::recording::{ColumnMap, RecordingStream};
use drift_sim::{Error, Result, sentences};
use numpy::ndarray::{ArrayView1, s};
use numpy::{Element, PyReadonlyArray1};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::calibration::Baseline;
use crate::decisions::{Decisions, line};
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
    /// From one decision to the next.
    hop_ticks: u32,
    samples: u64,
}

/// A number that a sample is made of.
trait Number: Element + Copy + Send + Sync {
    /// Many samples at once.
    fn ticks(runner: &mut Runner, signals: [&[Self]; 3], t_s: impl Fn(usize) -> f64, each: impl FnMut(Hop));
}

impl Number for f64 {
    fn ticks(runner: &mut Runner, signals: [&[Self]; 3], t_s: impl Fn(usize) -> f64, each: impl FnMut(Hop)) {
        runner.ticks_rounded(signals, t_s, each);
    }
}

impl Number for f32 {
    fn ticks(runner: &mut Runner, signals: [&[Self]; 3], t_s: impl Fn(usize) -> f64, each: impl FnMut(Hop)) {
        runner.ticks(signals, t_s, each);
    }
}

/// What the monitor is told of a sample: what is not a number is missing, as in a recording.
#[inline]
fn input(r: f32, y: f32, u: f32) -> Input<f32> {
    if r.is_nan() || y.is_nan() || u.is_nan() { Input::Missing } else { Input::Sample { r, y, u } }
}

impl Monitor {
    #[inline]
    fn tick(&mut self, input: Input<f32>) -> Option<Hop> {
        let t_s = self.start_s + self.samples as f64 * self.sample_time_s;
        self.samples += 1;
        self.runner.tick(t_s, input)
    }

    /// Array views of one type and length: read where they are, or copied where they don't lie one number behind the other.
    fn push_views<T: Number>(&mut self, signals: [ArrayView1<'_, T>; 3], hops: &mut Vec<Hop>) {
        let signals = signals.each_ref().map(|signal| signal.as_standard_layout());
        let slices = signals.each_ref().map(|signal| signal.as_slice().unwrap_or_default());
        let (first, start_s, sample_time_s) = (self.samples, self.start_s, self.sample_time_s);
        let t_s = |n: usize| start_s + (first + n as u64) as f64 * sample_time_s;
        T::ticks(&mut self.runner, slices, t_s, |hop| hops.push(hop));
        self.samples += slices[0].len() as u64;
    }

    /// Pushes array views a part at a time, without the interpreter's lock.
    fn push_parts<T: Number>(
        &mut self,
        py: Python<'_>,
        signals: [ArrayView1<'_, T>; 3],
    ) -> PyResult<Decisions> {
        let length = signals[0].len();
        if signals.iter().any(|signal| signal.len() != length) {
            let [r, y, u] = signals.map(|signal| signal.len());
            return Err(raised(
                Error::new(format!("r, y and u have {r}, {y} and {u} values")).allowed("equally many"),
            ));
        }
        // Room for all that may fall: a list that grows moves what it holds.
        let mut hops = Vec::with_capacity(length / self.hop_ticks.max(1) as usize + 1);
        for from in (0..length).step_by(SAMPLES_AT_ONCE) {
            let to = (from + SAMPLES_AT_ONCE).min(length);
            let part = signals.each_ref().map(|signal| signal.slice(s![from..to]));
            py.detach(|| self.push_views(part, &mut hops));
            py.check_signals()?;
        }
        Ok(Decisions(hops))
    }
}

#[pymethods]
impl Monitor {
    #[new]
    fn new(baseline: &Baseline, sample_time_s: Option<f64>, start_s: f64) -> PyResult<Self> {
        let sample_time_s = sample_time_s.unwrap_or_else(|| baseline.0.timing.sample_time_s());
        if !start_s.is_finite() {
            return Err(raised(
                Error::new(format!("start_s is {start_s}")).allowed("a finite number of seconds"),
            ));
        }
        let config = baseline.0.config().map_err(raised)?;
        let runner = Runner::new(&config, sample_time_s).map_err(raised)?;
        let (point, hop_ticks) = (baseline.0.operating_point.clone(), config.hop_ticks());
        Ok(Self { runner, point, start_s, sample_time_s, hop_ticks, samples: 0 })
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

    /// Arrays of float64 or of float32; all decisions that fall.
    fn push_arrays(
        &mut self,
        py: Python<'_>,
        r: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
        u: &Bound<'_, PyAny>,
    ) -> PyResult<Decisions> {
        if let (Ok(r), Ok(y), Ok(u)) = (doubles(r), doubles(y), doubles(u)) {
            return self.push_parts(py, [r.as_array(), y.as_array(), u.as_array()]);
        }
        if let (Ok(r), Ok(y), Ok(u)) = (singles(r), singles(y), singles(u)) {
            return self.push_parts(py, [r.as_array(), y.as_array(), u.as_array()]);
        }
        Err(PyTypeError::new_err("r, y and u are arrays of one dimension, all float64 or all float32"))
    }
}

fn doubles<'py>(values: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f64>> {
    values.extract()
}

fn singles<'py>(values: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f32>> {
    values.extract()
}

/// What the monitor found in a whole recording.
#[pyclass(frozen, extends = Shown, module = "drift._drift")]
pub struct Monitoring(Arc<Watched>);

/// A run over a recording.
struct Watched {
    summary: Summary,
    lines: String,
    chart: Chart,
    baseline: BaselineFile,
    columns: ColumnMap,
}

#[pymethods]
impl Monitoring {
    /// Every decision as a line of JSON, and the summary as the last.
    fn json_lines(&self) -> &str {
        &self.0.lines
    }

    fn answer(&self) -> String {
        page::answer(&sentences::monitoring(&self.0.summary, &self.0.summary.clock()))
    }

    /// Signals, residuals and events.
    fn figure(&self) -> PyResult<String> {
        page::figure(&self.0.chart.figure(&self.0.summary))
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
) -> PyResult<Py<Monitoring>> {
    let baseline = baseline.0.clone();
    let columns = baseline.point_columns(&operating_point).map_err(raised)?;
    let further = columns.as_ref().map_or_else(Vec::new, |point| point.columns.clone());
    let options = reading::options(reading.as_ref(), further.clone())?;
    let recording = recording.map(|recording| Arc::clone(&recording.0));
    let watched = interrupt::run(py, move || {
        let mut stream = match (&recording, &path) {
            (Some(recording), _) => RecordingStream::from_recording(recording, &further)?,
            (None, Some(path)) => RecordingStream::open(path, &options)?,
            (None, None) => {
                return Err(Error::new("nothing to monitor").allowed("a recording, a table or a path"));
            }
        };
        run(&mut stream, baseline, columns.as_ref())
    })?;
    let watched = Arc::new(watched);
    let of_page = Arc::clone(&watched);
    Shown::by(py, Monitoring(watched), move || {
        let Watched { summary, chart, baseline, columns, .. } = of_page.as_ref();
        library::page(summary, chart, baseline, columns, String::new())
    })
}

fn run(
    stream: &mut RecordingStream,
    baseline: BaselineFile,
    point: Option<&PointColumns>,
) -> Result<Watched> {
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
    Ok(Watched { summary, lines, chart, baseline, columns })
}
