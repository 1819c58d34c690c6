//! JSON Lines of a run, schema `drift.monitor/1`: one object per decision, a summary object as the last line.
//! Numbers that do not exist (nothing judged, not kept) are `null`; times are seconds on the recording's clock.
//!
//! A decision: `{"hop", "from_s", "to_s", "status": "valid|too_few_valid", "verdict", "location",
//! "excluded": {..}, "indices": {..}, "operating_point", "channels": [{"kind", "index", "x", "value", "residual", "z", "cusum_high",
//! "cusum_low", "sprt_high", "sprt_low", "alarms": {"shewhart", "cusum", "sprt"}, "verdict", "side",
//! "extrapolated", "fault_curve"}]}`. `index` is the error index of `energy_error`, else `null`; sides are
//! `"high"` or `"low"`; verdicts `healthy`, `disturbance`, `recovered`, `suspect`, `drift`.
//!
//! The last line: `{"schema": "drift.monitor/1", "summary": {"recording", "start_s", "duration_s",
//! "sample_time_s", "window_s", "hop_s", "samples", "hops", "valid_hops", "excluded": {..}, "verdict":
//! "healthy|disturbance|suspect|drift|not_judged", "channels": [{"kind", "index", "judged", "extrapolated",
//! "mean_z", "max_abs_z", "alarms", "detectable": {"sigmas", "value", "y"}, "verdict", "worst"}], "events": [{"kind", "from_s", "alarm_s", "to_s",
//! "max_z", "location", "channels": [{"channel", "kind", "side", "from_s", "alarm_s", "to_s", "detectors", "max_z",
//! "fault_curve": {"b0_before", "b1_before", "b0", "b1", "shift", "windows", "moved"}}]}], "more_events", "pinned": {"limit", "from_s", "to_s", "mean_e"},
//! "answer": {"status": "healthy|suspect|drift|cant_tell", "sentence", "also", "numbers": [{"value", "label"}]}}}`.

use std::io::{self, Write};

use drift_core::{
    Alarms, ChannelReport, Excluded, FaultCurve, Indices, Location, Moved, Side, Verdict, WindowStatus,
};
use serde::Serialize;

use super::detectable::Detectable;
use super::events::{Course, Event, EventKind, Raised};
use super::pinned::Pinned;
use super::run::Hop;
use super::summary::{ChannelSummary, ExcludedTotal, Summary};
use crate::sentences;

/// Name and version of the schema, in the last line.
pub const SCHEMA: &str = "drift.monitor/1";

/// Writes one decision as one line.
///
/// # Errors
/// The writer's.
pub fn write_hop(out: &mut (impl Write + ?Sized), hop: &Hop) -> io::Result<()> {
    let report = &hop.report;
    line(
        out,
        &HopLine {
            hop: report.hop,
            from_s: hop.from_s,
            to_s: hop.to_s,
            status: report.status,
            verdict: report.verdict,
            location: report.location(),
            excluded: report.excluded,
            indices: report.indices,
            operating_point: hop.operating_point,
            channels: report.channels.each_ref().map(ChannelLine::of),
        },
    )
}

/// Writes the last line.
///
/// # Errors
/// The writer's.
pub fn write_summary(out: &mut (impl Write + ?Sized), summary: &Summary) -> io::Result<()> {
    let content = SummaryContent {
        recording: &summary.recording,
        start_s: summary.start_s,
        duration_s: summary.duration_s(),
        sample_time_s: summary.sample_time_s,
        window_s: summary.window_s,
        hop_s: summary.hop_s,
        samples: summary.samples(),
        hops: summary.hops,
        valid_hops: summary.valid_hops,
        excluded: summary.excluded,
        verdict: match summary.worst {
            None if summary.channels.iter().all(|c| c.judged == 0) => "not_judged",
            None => "healthy",
            Some(kind) => kind.name(),
        },
        channels: summary.channels.each_ref().map(ChannelContent::of),
        events: summary.events.iter().map(EventContent::of).collect(),
        more_events: summary.more_events,
        pinned: summary.pinned,
        answer: sentences::monitoring(summary, &summary.clock()).to_json(),
    };
    line(out, &SummaryLine { schema: SCHEMA, summary: content })
}

fn line(out: &mut (impl Write + ?Sized), value: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer(&mut *out, value)?;
    out.write_all(b"\n")
}

#[derive(Serialize)]
struct HopLine {
    hop: u32,
    from_s: f64,
    to_s: f64,
    status: WindowStatus,
    verdict: Verdict,
    location: Location,
    excluded: Excluded,
    indices: Indices,
    operating_point: Option<f32>,
    channels: [ChannelLine; 3],
}

#[derive(Serialize)]
struct ChannelLine {
    kind: &'static str,
    index: Option<drift_core::Index>,
    x: f32,
    value: f32,
    residual: f32,
    z: f32,
    cusum_high: f32,
    cusum_low: f32,
    sprt_high: f32,
    sprt_low: f32,
    alarms: Alarms,
    verdict: Verdict,
    side: Option<Side>,
    extrapolated: bool,
    fault_curve: Option<FaultCurve>,
}

impl ChannelLine {
    fn of(channel: &ChannelReport) -> Self {
        let (cusum, sprt) = (channel.detectors.cusum, channel.detectors.sprt);
        Self {
            kind: channel.kind.name(),
            index: channel.kind.index(),
            x: channel.x,
            value: channel.value,
            residual: channel.residual,
            z: channel.z,
            cusum_high: cusum.high,
            cusum_low: cusum.low,
            sprt_high: sprt.high,
            sprt_low: sprt.low,
            alarms: channel.alarms,
            verdict: channel.verdict,
            side: channel.side,
            extrapolated: channel.extrapolated,
            fault_curve: channel.fault_curve,
        }
    }
}

#[derive(Serialize)]
struct SummaryLine<'a> {
    schema: &'static str,
    summary: SummaryContent<'a>,
}

#[derive(Serialize)]
struct SummaryContent<'a> {
    recording: &'a str,
    start_s: f64,
    duration_s: f64,
    sample_time_s: f64,
    window_s: f64,
    hop_s: f64,
    samples: u64,
    hops: u64,
    valid_hops: u64,
    excluded: ExcludedTotal,
    verdict: &'static str,
    channels: [ChannelContent; 3],
    events: Vec<EventContent>,
    more_events: u64,
    pinned: Option<Pinned>,
    answer: serde_json::Value,
}

#[derive(Serialize)]
struct ChannelContent {
    kind: &'static str,
    index: Option<drift_core::Index>,
    judged: u64,
    extrapolated: u64,
    mean_z: f64,
    max_abs_z: f64,
    alarms: u64,
    detectable: Option<Detectable>,
    verdict: Verdict,
    worst: Option<EventKind>,
}

impl ChannelContent {
    fn of(channel: &ChannelSummary) -> Self {
        Self {
            kind: channel.kind.name(),
            index: channel.kind.index(),
            judged: channel.judged,
            extrapolated: channel.extrapolated,
            mean_z: channel.mean_z,
            max_abs_z: channel.max_abs_z,
            alarms: channel.alarms,
            detectable: channel.detectable,
            verdict: channel.verdict,
            worst: channel.worst,
        }
    }
}

#[derive(Serialize)]
struct EventContent {
    kind: EventKind,
    from_s: f64,
    alarm_s: f64,
    to_s: Option<f64>,
    max_z: f32,
    location: Location,
    channels: Vec<CourseContent>,
}

impl EventContent {
    fn of(event: &Event) -> Self {
        Self {
            kind: event.kind(),
            from_s: event.from_s(),
            alarm_s: event.alarm_s(),
            to_s: event.to_s(),
            max_z: event.main().map_or(f32::NAN, |c| c.max_z),
            location: event.location,
            channels: event.courses.iter().map(CourseContent::of).collect(),
        }
    }
}

#[derive(Serialize)]
struct CourseContent {
    channel: &'static str,
    kind: EventKind,
    side: Side,
    from_s: f64,
    alarm_s: f64,
    to_s: Option<f64>,
    detectors: Vec<Raised>,
    max_z: f32,
    fault_curve: Option<CurveContent>,
}

#[derive(Serialize)]
struct CurveContent {
    b0_before: f32,
    b1_before: f32,
    b0: f32,
    b1: f32,
    shift: f32,
    windows: u32,
    moved: Moved,
}

impl CourseContent {
    fn of(course: &Course) -> Self {
        Self {
            channel: course.kind.name(),
            kind: course.outcome,
            side: course.side,
            from_s: course.from_s,
            alarm_s: course.alarm_s,
            to_s: course.to_s,
            detectors: course.detectors.clone(),
            max_z: course.max_z,
            fault_curve: course.fault_curve.map(|after| CurveContent {
                b0_before: course.baseline.b0,
                b1_before: course.baseline.b1,
                b0: after.b0,
                b1: after.b1,
                shift: after.shift,
                windows: after.windows,
                moved: after.moved,
            }),
        }
    }
}
