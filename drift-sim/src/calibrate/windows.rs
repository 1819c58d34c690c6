//! The healthy windows: drift-core's own monitor, all channels unlearned, over each recording. A window never spans two recordings, and one with
//! too few valid samples is left out.

use drift_core::{Config, Everything, FullAt, Input, ReportOf, WindowStatus};

use super::Signals;
use crate::baseline_file::{BaselineFile, CAPACITY, HostMonitorAt, MOST_COLUMNS};
use crate::recording::RowState;
use crate::{Error, Result};

/// One healthy window: where it lies and its indices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowRow {
    /// Which recording, from 0.
    pub recording: usize,
    /// Which decision of it, from 0.
    pub hop: u32,
    /// Time from the recording's start to the window's end, s.
    pub end_s: f64,
    /// Where it lies on each channel's axis.
    pub x: [f32; 3],
    /// The index that each channel judges.
    pub value: [f32; 3],
    /// Means of the operating point's columns; 0 where there are fewer.
    pub columns: [f32; MOST_COLUMNS],
}

/// All of them, in order, and the runs of windows without a gap between.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Windows {
    pub rows: Vec<WindowRow>,
    pub stretches: Vec<std::ops::Range<usize>>,
    /// Windows that were left out.
    pub invalid: usize,
}

/// `file`: its timing, samples and channels' kinds; nothing of it is learnt yet. `columns`: those of the operating point.
pub(super) fn collect(
    recordings: &[Signals<'_>],
    file: &BaselineFile,
    columns: &[String],
) -> Result<Windows> {
    let config = file.config()?;
    let (mut rows, mut invalid) = (Vec::new(), 0);
    for (recording, signals) in recordings.iter().enumerate() {
        let columns = columns.iter().map(|name| signals.column(name)).collect::<Result<Vec<_>>>()?;
        let windows = each_window(&config, signals, &columns, columns.first().copied())?;
        // The monitor has one number: the means of further columns take runs of their own.
        let mut further: Vec<Vec<f32>> = Vec::new();
        for &column in columns.iter().skip(1).take(MOST_COLUMNS - 1) {
            let windows = each_window(&config, signals, &columns, Some(column))?;
            further.push(windows.iter().map(|(_, report)| report.indices.operating_point).collect());
        }
        for (i, (tick, report)) in windows.iter().enumerate() {
            let x = report.channels.each_ref().map(|c| c.x);
            let value = report.channels.each_ref().map(|c| c.value);
            if report.status != WindowStatus::Valid || !x.iter().chain(&value).all(|v| v.is_finite()) {
                invalid += 1;
                continue;
            }
            let mut means = [0.0; MOST_COLUMNS];
            if !columns.is_empty() {
                means[0] = report.indices.operating_point;
            }
            for (to, column) in means.iter_mut().skip(1).zip(&further) {
                *to = column.get(i).copied().unwrap_or(f32::NAN);
            }
            let end_s = (tick + 1) as f64 * signals.sample_time_s;
            rows.push(WindowRow { recording, hop: report.hop, end_s, x, value, columns: means });
        }
    }
    Ok(Windows { invalid, ..Windows::of(rows) })
}

/// A decision of the host's monitor with an operating point.
type Decided = ReportOf<f32, FullAt, Everything<CAPACITY>, 3>;

/// The recording's decisions, each with its tick. Samples at which one of `columns` is missing do not count; the mean of
/// `point`, one of them, is in the reports.
fn each_window(
    config: &Config<f32, 3>,
    signals: &Signals<'_>,
    columns: &[&[f64]],
    point: Option<&[f64]>,
) -> Result<Vec<(usize, Decided)>> {
    let mut monitor = HostMonitorAt::new(*config).map_err(|e| Error::new(e.to_string()))?;
    let mut windows = Vec::new();
    for (tick, input) in signals.inputs().enumerate() {
        let at = |column: &[f64]| column.get(tick).copied().unwrap_or(f64::NAN);
        let known = columns.iter().all(|column| at(column).is_finite());
        let now = point.map_or(0.0, |column| if known { at(column) } else { f64::NAN });
        monitor.operating_point(now as f32);
        if let Some(report) = monitor.tick_input(input) {
            windows.push((tick, *report));
        }
    }
    Ok(windows)
}

impl Windows {
    /// Those at these places, in order.
    pub(super) fn only(&self, places: &[usize]) -> Self {
        let rows = places.iter().filter_map(|&place| self.rows.get(place).copied()).collect();
        Self { invalid: self.invalid, ..Self::of(rows) }
    }

    pub(super) fn of(rows: Vec<WindowRow>) -> Self {
        let follows =
            |a: &WindowRow, b: &WindowRow| a.recording == b.recording && a.hop.checked_add(1) == Some(b.hop);
        let mut start = 0;
        let stretch = |run: &[WindowRow]| {
            let range = start..start + run.len();
            start = range.end;
            range
        };
        let stretches = rows.chunk_by(follows).map(stretch).collect();
        Self { rows, stretches, invalid: 0 }
    }
}

impl Signals<'_> {
    /// A further column by name.
    fn column(&self, name: &str) -> Result<&[f64]> {
        let found = self.further.iter().find(|(column, _)| column == name);
        found.map(|(_, values)| values.as_slice()).ok_or_else(|| {
            Error::new(format!("no column '{name}' for the operating point")).in_file(self.name)
        })
    }

    /// What the monitor gets to see, tick by tick.
    pub fn inputs(&self) -> impl Iterator<Item = Input<f32>> + '_ {
        self.r.iter().zip(self.y).zip(self.u).enumerate().map(|(tick, ((&r, &y), &u))| {
            match self.state.and_then(|s| s.get(tick)).copied().unwrap_or_default() {
                RowState::Valid => Input::Sample { r: r as f32, y: y as f32, u: u as f32 },
                RowState::Missing => Input::Missing,
                RowState::Manual => Input::Manual,
            }
        })
    }
}
