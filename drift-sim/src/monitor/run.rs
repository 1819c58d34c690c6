//! Feeds a recording to the monitor. Samples are read as f64 and rounded to f32, the number that the monitor of a
//! controller computes in; indices, residuals and detectors are then the controller's, bit for bit.

use std::io::{self, Write};

use drift_core::{Config, IndicesAt, Input, Report};

use super::chart::Chart;
use super::summary::{Summary, Tally};
use super::{json_lines, pinned};
use crate::baseline_file::{HostMonitor, HostMonitorAt, PointColumns};
use crate::recording::{RecordingStream, RowState, Sample};
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
    /// The operating point's mean over the window, where the baseline depends on one.
    pub operating_point: Option<f32>,
}

/// With a measured operating point or without.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "there is one for a whole run, and a box would cost each tick")]
enum Watching {
    Plain(HostMonitor),
    At(HostMonitorAt),
}

/// The monitor and its clock.
#[derive(Debug, Clone)]
pub struct Runner {
    monitor: Watching,
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
        let refused = |e| Error::new(format!("the baseline can't be used: {e}"));
        let monitor = if config.channels.iter().any(|channel| channel.operating_point.counts()) {
            Watching::At(HostMonitorAt::new(*config).map_err(refused)?)
        } else {
            Watching::Plain(HostMonitor::new(*config).map_err(refused)?)
        };
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

    /// One sample, taken at `t_s`. `Some` once per hop, from the first full window on. Of a baseline that depends on an
    /// operating point, none counts before [`Runner::operating_point`] was told.
    #[inline]
    pub fn tick(&mut self, t_s: f64, input: Input<f32>) -> Option<Hop> {
        let (report, operating_point) = match &mut self.monitor {
            Watching::Plain(monitor) => {
                let report = match input {
                    Input::Sample { r, y, u } => monitor.tick(r, y, u),
                    other => monitor.tick_input(other),
                };
                (*report?, None)
            }
            Watching::At(monitor) => {
                let report = monitor.tick_input(input)?;
                (without_point(report), Some(report.indices.operating_point))
            }
        };
        let to_s = t_s + self.sample_time_s;
        let (from_s, new_from_s) = (to_s - self.window_s, to_s - self.hop_s);
        Some(Hop { from_s, new_from_s, to_s, report, operating_point })
    }

    /// The operating point from the next sample on; samples do not count while it is not finite.
    #[inline]
    pub fn operating_point(&mut self, point: f32) {
        if let Watching::At(monitor) = &mut self.monitor {
            monitor.operating_point(point);
        }
    }
}

fn without_point(report: &Report<3, IndicesAt>) -> Report<3> {
    let Report { hop, status, verdict, excluded, channels, .. } = *report;
    Report { hop, status, verdict, indices: report.indices.indices, excluded, channels }
}

/// One run of the monitor over samples that come one by one, and the count of what it says.
#[derive(Debug, Clone)]
pub struct Watcher {
    runner: Runner,
    tally: Tally,
    pinned: pinned::Watch,
}

impl Watcher {
    /// A run that has seen nothing yet; `sample_time_s` is the recording's.
    ///
    /// # Errors
    /// As [`Runner::new`].
    pub fn new(config: &Config<f32, 3>, sample_time_s: f64) -> Result<Self> {
        let runner = Runner::new(config, sample_time_s)?;
        let pinned = pinned::Watch::new(config.saturation, sample_time_s, runner.window_s);
        Ok(Self { runner, tally: Tally::new(config), pinned })
    }

    /// The next sample. `Some` once per hop; `point` names the columns of the operating point, where the baseline depends on
    /// one: the recording's first further columns.
    #[inline]
    pub fn sample(&mut self, sample: &Sample<'_>, point: Option<&PointColumns>) -> Option<Hop> {
        if sample.state == RowState::Valid {
            self.pinned.sample(sample.t_s, sample.r - sample.y, sample.u);
        }
        let input = match sample.state {
            RowState::Valid => Input::Sample { r: sample.r as f32, y: sample.y as f32, u: sample.u as f32 },
            RowState::Missing => Input::Missing,
            RowState::Manual => Input::Manual,
        };
        if let Some(columns) = point {
            let measured = sample.extra.get(..columns.columns.len()).unwrap_or(&[]);
            self.runner.operating_point(columns.point(measured));
        }
        let hop = self.runner.tick(sample.t_s, input)?;
        self.tally.add(&hop);
        Some(hop)
    }

    /// What the run found; `stream` is the recording that it watched, read to its end.
    pub fn finish(self, stream: &RecordingStream) -> Summary {
        let (name, quality) = (stream.name().to_owned(), stream.quality());
        let mut summary = self.tally.finish(name, stream.start_s(), stream.sample_time_s(), quality);
        summary.zero_s = stream.zero_s();
        summary.pinned = self.pinned.finish();
        summary
    }
}

/// What a run is given and asked for besides the summary.
#[derive(Default)]
pub struct Outputs<'a> {
    /// Each decision as a line of JSON, and the summary as the last.
    pub json: Option<&'a mut dyn Write>,
    /// Collects what the chart shows.
    pub chart: Option<&'a mut Chart>,
    /// The columns of the operating point, where the baseline depends on one: the recording's first further columns.
    pub operating_point: Option<&'a PointColumns>,
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
    let mut watcher = Watcher::new(config, stream.sample_time_s()).map_err(|e| e.in_file(stream.name()))?;
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
        let Some(hop) = watcher.sample(&sample, outputs.operating_point) else { continue };
        if let Some(chart) = &mut outputs.chart {
            chart.hop(&hop);
        }
        if let Some(out) = &mut outputs.json {
            json_lines::write_hop(out, &hop)?;
        }
    }
    let summary = watcher.finish(stream);
    if let Some(out) = &mut outputs.json {
        json_lines::write_summary(out, &summary)?;
    }
    Ok(summary)
}
