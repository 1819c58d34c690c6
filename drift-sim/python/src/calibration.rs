//! Baselines, and the calibration that makes them.

use std::path::PathBuf;
use std::sync::Arc;

use drift_core::{ChannelKind, Index};
use drift_sim::baseline_file::BaselineFile;
use drift_sim::calibrate::{self as library, Options, Signals};
use drift_sim::recording;
use drift_sim::{Error, sentences};
use pyo3::prelude::*;

use crate::error::raised;
use crate::interrupt;
use crate::page::{self, Shown};
use crate::recording::Recording;

/// What a healthy loop looks like.
#[pyclass(frozen, module = "drift._drift")]
pub struct Baseline(pub BaselineFile);

#[pymethods]
impl Baseline {
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        BaselineFile::read(&path).map(Self).map_err(raised)
    }

    #[staticmethod]
    fn parse(text: &str, name: &str) -> PyResult<Self> {
        BaselineFile::parse(text, name).map(Self).map_err(raised)
    }

    fn to_toml(&self) -> String {
        self.0.to_toml()
    }

    fn to_rust(&self) -> String {
        self.0.to_rust_const()
    }

    fn to_c(&self) -> String {
        self.0.to_c_initialiser()
    }

    #[getter]
    fn sample_time_s(&self) -> f64 {
        self.0.timing.sample_time_s()
    }

    #[getter]
    fn window_s(&self) -> f64 {
        self.0.timing.window_s()
    }

    #[getter]
    fn hop_s(&self) -> f64 {
        self.0.timing.hop_s()
    }

    #[getter]
    fn false_alarm_every_h(&self) -> Option<f64> {
        self.0.promise.map(|promise| promise.false_alarm_every_h)
    }

    #[getter]
    fn operating_point(&self) -> Vec<String> {
        self.0.operating_point.as_ref().map_or_else(Vec::new, |point| point.columns.clone())
    }
}

/// A calibration: the baseline and how it was learnt.
#[pyclass(frozen, extends = Shown, module = "drift._drift")]
pub struct Calibration(Arc<library::Calibration>);

#[pymethods]
impl Calibration {
    #[getter]
    fn baseline(&self) -> Baseline {
        Baseline(self.0.file.clone())
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    fn to_json(&self) -> PyResult<String> {
        page::text(&self.0.to_json())
    }

    fn answer_json(&self) -> PyResult<String> {
        page::text(&sentences::calibration(&self.0).to_json())
    }

    fn answer(&self) -> String {
        page::answer(&sentences::calibration(&self.0))
    }
}

/// The recordings' signals.
fn signals(recordings: &[Arc<recording::Recording>]) -> Vec<Signals<'_>> {
    recordings.iter().map(|recording| recording.as_ref().into()).collect()
}

/// Learns what healthy looks like.
#[pyfunction]
#[pyo3(signature = (
    recordings, *, window_s, hop_s, index, false_alarm_every_h, confidence, channels, effort, effort_memory, operating_point,
    detectors, k, lambda_, saturation, blanking, confirm_hops
))]
#[expect(clippy::too_many_arguments, reason = "they are Python's keywords")]
pub fn calibrate(
    py: Python<'_>,
    recordings: Vec<PyRef<'_, Recording>>,
    window_s: Option<f64>,
    hop_s: Option<f64>,
    index: &str,
    false_alarm_every_h: f64,
    confidence: f64,
    channels: Vec<String>,
    effort: &str,
    effort_memory: Option<u8>,
    operating_point: Vec<String>,
    detectors: Vec<String>,
    k: f64,
    lambda_: f64,
    saturation: Option<(f64, f64)>,
    blanking: Option<(f64, f64)>,
    confirm_hops: u16,
) -> PyResult<Py<Calibration>> {
    let options = Options {
        window_s,
        hop_s,
        index: one_of("index", index, &INDICES)?,
        false_alarm_every_h,
        confidence,
        channels: judged(&channels)?,
        effort: kind_of_effort(effort)?,
        effort_memory,
        operating_point,
        detectors: detectors.join(",").parse().map_err(raised)?,
        k,
        lambda: lambda_,
        saturation: limits(saturation)?,
        blanking,
        confirm_hops,
        ..Options::default()
    };
    let recordings: Vec<Arc<recording::Recording>> =
        recordings.iter().map(|recording| Arc::clone(&recording.0)).collect();
    let learnt_from = recordings.clone();
    let found = interrupt::run(py, move || {
        library::calibrate(&signals(&learnt_from), &options).map_err(|error| match learnt_from.as_slice() {
            [only] => error.in_file(&only.name),
            _ => error,
        })
    })?;
    let found = Arc::new(found);
    let of_page = Arc::clone(&found);
    Shown::by(py, Calibration(found), move || {
        let columns = recordings.first().map(|first| first.columns.clone()).unwrap_or_default();
        of_page.page(&signals(&recordings), &columns, String::new())
    })
}

const INDICES: [(&str, Index); 4] =
    [("iae", Index::Iae), ("ise", Index::Ise), ("itae", Index::Itae), ("itse", Index::Itse)];
const CHANNELS: [(&str, usize); 3] = [("energy_error", 0), ("effort", 1), ("activity", 2)];

/// The kind that a word chooses.
fn kind_of_effort(word: &str) -> PyResult<ChannelKind> {
    let rows = ChannelKind::ROWS.iter();
    let known: Vec<_> = rows.filter_map(|row| row.meaning.chosen_by.map(|word| (word, row.kind))).collect();
    one_of("effort", word, &known)
}

/// What a word means; the error lists those that are allowed.
pub fn one_of<T: Copy>(what: &str, word: &str, known: &[(&str, T)]) -> PyResult<T> {
    known.iter().find(|(name, _)| *name == word).map(|(_, meaning)| *meaning).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        raised(Error::new(format!("{what}: '{word}'")).allowed(names.join(", ")))
    })
}

fn judged(names: &[String]) -> PyResult<[bool; 3]> {
    let mut channels = [false; 3];
    for name in names {
        let place = one_of("channels", name, &CHANNELS)?;
        if let Some(channel) = channels.get_mut(place) {
            *channel = true;
        }
    }
    Ok(channels)
}

fn limits(saturation: Option<(f64, f64)>) -> PyResult<Option<[f64; 2]>> {
    match saturation {
        None => Ok(None),
        Some((low, high)) if low < high => Ok(Some([low, high])),
        Some(_) => Err(raised(Error::new("saturation").allowed("(low, high) with low below high"))),
    }
}
