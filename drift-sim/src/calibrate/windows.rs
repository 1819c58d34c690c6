//! The healthy windows: drift-core's own monitor, all channels unlearned, over each recording. A window never spans two recordings, and one with
//! too few valid samples is left out.

use drift_core::{Input, WindowStatus};

use super::Signals;
use crate::baseline_file::{BaselineFile, HostMonitor};
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
}

/// All of them, in order, and the runs of windows without a gap between.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Windows {
    pub rows: Vec<WindowRow>,
    pub stretches: Vec<std::ops::Range<usize>>,
    /// Windows that were left out.
    pub invalid: usize,
}

/// `file`: its timing, samples and channels' kinds; nothing of it is learnt yet.
pub(super) fn collect(recordings: &[Signals<'_>], file: &BaselineFile) -> Result<Windows> {
    let config = file.config()?;
    let (mut rows, mut invalid) = (Vec::new(), 0);
    for (recording, signals) in recordings.iter().enumerate() {
        let mut monitor = HostMonitor::new(config).map_err(|e| Error::new(e.to_string()))?;
        for (tick, input) in signals.inputs().enumerate() {
            let Some(report) = monitor.tick_input(input) else { continue };
            let x = report.channels.each_ref().map(|c| c.x);
            let value = report.channels.each_ref().map(|c| c.value);
            if report.status == WindowStatus::Valid && x.iter().chain(&value).all(|v| v.is_finite()) {
                let end_s = (tick + 1) as f64 * signals.sample_time_s;
                rows.push(WindowRow { recording, hop: report.hop, end_s, x, value });
            } else {
                invalid += 1;
            }
        }
    }
    Ok(Windows { invalid, ..Windows::of(rows) })
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
