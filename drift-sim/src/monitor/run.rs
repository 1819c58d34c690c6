//! Feeds a recording to the monitor. Samples are read as f64 and rounded to f32, the number that the monitor of a
//! controller computes in; indices, residuals and detectors are then the controller's, bit for bit.

use std::io::{self, Write};

use drift_core::{Config, Input, Report};

use super::chart::Chart;
use super::summary::{Summary, Tally};
use super::{json_lines, pinned};
use crate::baseline_file::HostMonitor;
use crate::recording::{RecordingStream, RowState};
use crate::{Error, Result};

/// Sample times that differ by more than this fraction are different ones: the indices scale with it.
const SAMPLE_TIME_TOLERANCE: f64 = 1e-3;

/// One decision and the window that it is about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hop {
    /// Beginning of the window, s on the recording's clock.
    pub from_s: f64,
    /// Beginning of the part that the decision before did not see, s; `from_s` where windows don't overlap.
    pub new_from_s: f64,
    /// Its end, s: the moment of the decision.
    pub to_s: f64,
    /// What the monitor said.
    pub report: Report<3>,
}

/// The monitor and its clock.
#[derive(Debug, Clone)]
pub struct Runner {
    monitor: HostMonitor,
    sample_time_s: f64,
    window_s: f64,
    hop_s: f64,
}

impl Runner {
    /// A monitor that has seen nothing yet; `sample_time_s` is the recording's.
    ///
    /// # Errors
    /// The configuration is impossible, or made for another sample time.
    pub fn new(config: &Config<f32, 3>, sample_time_s: f64) -> Result<Self> {
        let monitor =
            HostMonitor::new(*config).map_err(|e| Error::new(format!("the baseline can't be used: {e}")))?;
        let expected = f64::from(config.sample_time_s);
        if (sample_time_s - expected).abs() > SAMPLE_TIME_TOLERANCE * expected {
            let what = format!(
                "sampled every {sample_time_s} s, but the baseline was learnt at {} s",
                config.sample_time_s
            );
            return Err(Error::new(what).allowed("a recording at that sample time, or --resample"));
        }
        let seconds = |ticks: u32| f64::from(ticks) * sample_time_s;
        let (window_s, hop_s) = (seconds(config.window_ticks()), seconds(config.hop_ticks()));
        Ok(Self { monitor, sample_time_s, window_s, hop_s })
    }

    /// One sample, taken at `t_s`. `Some` once per hop, from the first full window on.
    #[inline]
    pub fn tick(&mut self, t_s: f64, input: Input<f32>) -> Option<Hop> {
        let report = match input {
            Input::Sample { r, y, u } => self.monitor.tick(r, y, u),
            other => self.monitor.tick_input(other),
        }
        .copied()?;
        let to_s = t_s + self.sample_time_s;
        Some(Hop { from_s: to_s - self.window_s, new_from_s: to_s - self.hop_s, to_s, report })
    }
}

/// What to do besides the summary.
#[derive(Default)]
pub struct Outputs<'a> {
    /// Each decision as a line of JSON, and the summary as the last.
    pub json: Option<&'a mut dyn Write>,
    /// Collects what the chart shows.
    pub chart: Option<&'a mut Chart>,
    /// Told now and then how many bytes were read.
    pub progress: Option<&'a dyn Fn(u64)>,
}

/// Why a run ended early.
#[derive(Debug)]
pub enum Stopped {
    /// The recording or the configuration is at fault.
    Input(Error),
    /// The JSON lines can't be written.
    Writing(io::Error),
}

impl From<Error> for Stopped {
    fn from(error: Error) -> Self {
        Self::Input(error)
    }
}

impl From<io::Error> for Stopped {
    fn from(error: io::Error) -> Self {
        Self::Writing(error)
    }
}

/// Bytes are told once in so many samples.
const PROGRESS_EVERY: u64 = 1 << 16;

/// Runs the monitor over a recording to its end.
///
/// # Errors
/// The recording is broken or has another sample time, the configuration is impossible, or the lines can't be
/// written.
pub fn watch(
    stream: &mut RecordingStream,
    config: &Config<f32, 3>,
    mut outputs: Outputs<'_>,
) -> std::result::Result<Summary, Stopped> {
    let name = stream.name().to_owned();
    let mut runner = Runner::new(config, stream.sample_time_s()).map_err(|e| e.in_file(&name))?;
    let mut tally = Tally::new(config);
    let mut pinned = pinned::Watch::new(config.saturation, stream.sample_time_s(), runner.window_s);
    let bytes = |stream: &RecordingStream| stream.bytes_read();
    let mut index = 0u64;
    loop {
        if let Some(progress) = outputs.progress.filter(|_| index.is_multiple_of(PROGRESS_EVERY)) {
            progress(bytes(stream));
        }
        let Some(sample) = stream.next()? else { break };
        index = sample.index + 1;
        if let Some(chart) = &mut outputs.chart {
            chart.sample(sample.t_s, sample.r, sample.y, sample.u);
        }
        if sample.state == RowState::Valid {
            pinned.sample(sample.t_s, sample.r - sample.y, sample.u);
        }
        let input = match sample.state {
            RowState::Valid => Input::Sample { r: sample.r as f32, y: sample.y as f32, u: sample.u as f32 },
            RowState::Missing => Input::Missing,
            RowState::Manual => Input::Manual,
        };
        let Some(hop) = runner.tick(sample.t_s, input) else { continue };
        tally.add(&hop);
        if let Some(chart) = &mut outputs.chart {
            chart.hop(&hop);
        }
        if let Some(out) = &mut outputs.json {
            json_lines::write_hop(out, &hop)?;
        }
    }
    let mut summary = tally.finish(name, stream.start_s(), stream.sample_time_s(), stream.quality());
    summary.zero_s = stream.zero_s();
    summary.pinned = pinned.finish();
    if let Some(out) = &mut outputs.json {
        json_lines::write_summary(out, &summary)?;
    }
    Ok(summary)
}
