//! Feeds a recording to the monitor. Samples are read as f64 and rounded to f32, the number that the monitor of a
//! controller computes in; indices, residuals and detectors are then the controller's, bit for bit.

use std::io::{self, Write};

use drift_core::{Config, IndicesAt, Input, Report};

use super::chart::Chart;
use super::summary::{Summary, Tally};
use super::{json_lines, pinned};
use crate::baseline_file::{HostMonitor, HostMonitorAt, PointColumns};
use crate::recording::{RecordingStream, RowState, Sample, Samples};
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

/// What a decision's times are reckoned from, s.
#[derive(Debug, Clone, Copy)]
struct Spans {
    sample_time_s: f64,
    window_s: f64,
    hop_s: f64,
}

impl Spans {
    /// The decision that fell with the sample at `t_s`.
    fn hop(self, t_s: f64, report: &Report<3>, operating_point: Option<f32>) -> Hop {
        let to_s = t_s + self.sample_time_s;
        let (from_s, new_from_s) = (to_s - self.window_s, to_s - self.hop_s);
        Hop { from_s, new_from_s, to_s, report: *report, operating_point }
    }
}

/// The monitor and its clock.
#[derive(Debug, Clone)]
pub struct Runner {
    monitor: Watching,
    spans: Spans,
    /// How long a block is, and how many ticks its end is away: a decision falls with the end of a block.
    block_ticks: u32,
    to_block_end: u32,
}

/// Samples that are rounded to single precision at once: they stay in the processor's nearest memory.
const ROUNDED_AT_ONCE: usize = 512;

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
        let off = (sample_time_s - expected).abs();
        if off.is_nan() || off > SAMPLE_TIME_TOLERANCE * expected {
            let what = format!(
                "sampled every {sample_time_s} s, but the baseline was learnt at {} s",
                config.sample_time_s
            );
            return Err(Error::new(what).allowed("a recording at that sample time, or --resample"));
        }
        let seconds = |ticks: u32| f64::from(ticks) * sample_time_s;
        let (window_s, hop_s) = (seconds(config.window_ticks()), seconds(config.hop_ticks()));
        let spans = Spans { sample_time_s, window_s, hop_s };
        let block_ticks = config.block_ticks;
        Ok(Self { monitor, spans, block_ticks, to_block_end: block_ticks })
    }

    /// One sample, taken at `t_s`. `Some` once per hop, from the first full window on. Of a baseline that depends on an
    /// operating point, none counts before [`Runner::operating_point`] was told.
    #[inline]
    pub fn tick(&mut self, t_s: f64, input: Input<f32>) -> Option<Hop> {
        let (report, operating_point) = self.report(input)?;
        Some(self.spans.hop(t_s, &report, operating_point))
    }

    /// What the monitor says of one more sample, and at which operating point.
    #[inline]
    fn report(&mut self, input: Input<f32>) -> Option<(Report<3>, Option<f32>)> {
        self.to_block_end = if self.to_block_end == 1 { self.block_ticks } else { self.to_block_end - 1 };
        match &mut self.monitor {
            Watching::Plain(monitor) => {
                let report = match input {
                    Input::Sample { r, y, u } => monitor.tick(r, y, u),
                    other => monitor.tick_input(other),
                };
                Some((*report?, None))
            }
            Watching::At(monitor) => {
                let report = monitor.tick_input(input)?;
                Some((without_point(report), Some(report.indices.operating_point)))
            }
        }
    }

    /// Many samples of r, y and u at once: the same, bit for bit, as [`Runner::tick`] one by one, and faster where no operating point
    /// counts. A sample of which a value is NaN is missing. Reads as many as the shortest slice has; `t_s` says when each of them was
    /// taken, `each` is told every decision.
    pub fn ticks(&mut self, [r, y, u]: [&[f32]; 3], t_s: impl Fn(usize) -> f64, mut each: impl FnMut(Hop)) {
        let count = r.len().min(y.len()).min(u.len());
        let spans = self.spans;
        let mut from = 0;
        while from < count {
            let to = count.min(from + self.to_block_end as usize);
            let part = [r, y, u].map(|signal| signal.get(from..to).unwrap_or_default());
            self.ticks_in_block(part, &mut |report, point| each(spans.hop(t_s(to - 1), report, point)));
            from = to;
        }
    }

    /// Samples of one block: at most one decision falls, with the last of them. Compiled by itself and not into every caller, where the sums of a
    /// block would share the processor's registers with what the caller holds: that cost up to a tenth of the time.
    #[inline(never)]
    fn ticks_in_block(&mut self, [r, y, u]: [&[f32]; 3], each: &mut dyn FnMut(&Report<3>, Option<f32>)) {
        if let Watching::Plain(monitor) = &mut self.monitor
            && ![r, y, u].into_iter().any(has_nan)
        {
            monitor.ticks(r, y, u, |report| each(report, None));
            let left = self.to_block_end.saturating_sub(r.len() as u32);
            self.to_block_end = if left == 0 { self.block_ticks } else { left };
            return;
        }
        for ((r, y), u) in r.iter().zip(y).zip(u) {
            let (r, y, u) = (*r, *y, *u);
            let missing = r.is_nan() || y.is_nan() || u.is_nan();
            let input = if missing { Input::Missing } else { Input::Sample { r, y, u } };
            if let Some((report, point)) = self.report(input) {
                each(&report, point);
            }
        }
    }

    /// The same of samples in double precision, which are rounded.
    pub fn ticks_rounded(
        &mut self,
        signals: [&[f64]; 3],
        t_s: impl Fn(usize) -> f64,
        mut each: impl FnMut(Hop),
    ) {
        let count = signals.iter().map(|signal| signal.len()).min().unwrap_or(0);
        let mut rounded = [[0.0_f32; ROUNDED_AT_ONCE]; 3];
        for from in (0..count).step_by(ROUNDED_AT_ONCE) {
            let to = count.min(from + ROUNDED_AT_ONCE);
            for (rounded, signal) in rounded.iter_mut().zip(signals) {
                let part = signal.get(from..to).unwrap_or_default();
                rounded.iter_mut().zip(part).for_each(|(rounded, x)| *rounded = *x as f32);
            }
            let part = rounded.each_ref().map(|rounded| rounded.get(..to - from).unwrap_or_default());
            self.ticks(part, |n| t_s(from + n), &mut each);
        }
    }

    /// The operating point from the next sample on; samples do not count while it is not finite.
    #[inline]
    pub fn operating_point(&mut self, point: f32) {
        if let Watching::At(monitor) = &mut self.monitor {
            monitor.operating_point(point);
        }
    }
}

/// All are looked at: without a way out several are compared at once.
fn has_nan(signal: &[f32]) -> bool {
    signal.iter().fold(false, |found, x| found | x.is_nan())
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
        let pinned = pinned::Watch::new(config.saturation, sample_time_s, runner.spans.window_s);
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

    /// Samples that are all valid, of a baseline that depends on no operating point: the same as one by one, and faster.
    /// `each` is told every decision.
    pub fn samples(&mut self, samples: &Samples<'_>, mut each: impl FnMut(&Hop)) {
        let Samples { t_s, r, y, u } = *samples;
        if self.pinned.looks() {
            for (((t_s, r), y), u) in t_s.iter().zip(r).zip(y).zip(u) {
                self.pinned.sample(*t_s, r - y, *u);
            }
        }
        let taken_s = |n: usize| t_s.get(n).copied().unwrap_or(f64::NAN);
        let tally = &mut self.tally;
        self.runner.ticks_rounded([r, y, u], taken_s, |hop| {
            tally.add(&hop);
            each(&hop);
        });
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

impl Outputs<'_> {
    fn samples(&mut self, watcher: &mut Watcher, samples: &Samples<'_>) -> io::Result<()> {
        if let Some(chart) = &mut self.chart {
            chart.samples(samples);
        }
        let mut written = Ok(());
        watcher.samples(samples, |hop| {
            if written.is_ok() {
                written = self.hop(hop);
            }
        });
        written
    }

    fn hop(&mut self, hop: &Hop) -> io::Result<()> {
        if let Some(chart) = &mut self.chart {
            chart.hop(hop);
        }
        self.json.as_mut().map_or(Ok(()), |out| json_lines::write_hop(out, hop))
    }
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
    let (mut index, mut told) = (0, 0);
    loop {
        if let Some(progress) = outputs.progress.filter(|_| index >= told) {
            progress(stream.bytes_read());
            told = index + PROGRESS_EVERY;
        }
        if outputs.operating_point.is_none() {
            let samples = stream.valid_samples();
            if !samples.is_empty() {
                index += samples.len() as u64;
                outputs.samples(&mut watcher, &samples)?;
                continue;
            }
        }
        let Some(sample) = stream.next()? else { break };
        index = sample.index + 1;
        if let Some(chart) = &mut outputs.chart {
            chart.sample(sample.t_s, sample.r, sample.y, sample.u);
        }
        if let Some(hop) = watcher.sample(&sample, outputs.operating_point) {
            outputs.hop(&hop)?;
        }
    }
    let summary = watcher.finish(stream);
    if let Some(out) = &mut outputs.json {
        json_lines::write_summary(out, &summary)?;
    }
    Ok(summary)
}
