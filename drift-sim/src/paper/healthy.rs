//! Long healthy operation of the paper's loop: what thresholds are set on, and fresh runs that verify them.

use crate::cores::AcrossCores as _;
use drift_core::{ChannelKind, Index};

use super::line;
use super::settings::{HOPS_PER_WINDOW, Settings, Use};
use super::windows::{Drift, Stream, Window, coordinates};
use crate::Result;
use crate::calibrate::regression::Fit;

/// The channels of the delay table.
pub(super) const CHANNELS: [ChannelKind; 3] =
    [ChannelKind::EnergyError(Index::Iae), ChannelKind::Effort, ChannelKind::Activity];

/// The windows of many streams one after the other, every 0.5 s.
pub(super) fn streams(what: Use, settings: &Settings, step: &(dyn Fn() + Sync)) -> Result<Vec<Window>> {
    let runs = (0..settings.streams)
        .into_par_iter()
        .map(|i| {
            let stream = Stream::learning(&Drift::over(0.0, 0.0, 1.0), settings.seed_of(what, i))?;
            let windows = whole_windows(stream.windows_within(settings.stream_s as f64));
            step();
            Ok(windows)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(runs.concat())
}

/// Cuts a run so that every 6th window of runs put together is one that overlaps none of the others taken.
fn whole_windows(mut windows: Vec<Window>) -> Vec<Window> {
    windows.truncate(windows.len() - windows.len() % HOPS_PER_WINDOW);
    windows
}

/// Those that don't overlap: every 6th.
pub(super) fn tumbling(windows: &[Window]) -> Vec<Window> {
    windows.iter().step_by(HOPS_PER_WINDOW).copied().collect()
}

/// Each channel's line over these windows.
pub(super) fn lines(windows: &[Window]) -> Result<Vec<Fit>> {
    CHANNELS.iter().map(|kind| line::fit(&coordinates(windows, *kind))).collect()
}
