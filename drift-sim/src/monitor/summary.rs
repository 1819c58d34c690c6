//! What a person wants to know of a whole run, counted while it runs.

use drift_core::{Channel, ChannelKind, Config, Excluded, Verdict, WindowStatus};

use super::detectable::Detectable;
use super::events::{Event, EventKind, Events};
use super::pinned::Pinned;
use super::run::Hop;
use crate::physics::Units;
use crate::recording::Quality;
use crate::sentences::Clock;

/// When a run is to end with exit code 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailOn {
    /// At any event.
    Disturbance,
    /// At a drift, or a deviation that is still open at the end.
    Suspect,
    /// At a confirmed drift, whether it ended or not.
    Drift,
}

/// Samples that entered no sum, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct ExcludedTotal {
    /// A row or one of its values is missing.
    pub missing: u64,
    /// Not finite as f32.
    pub non_finite: u64,
    /// Beyond what the sums can hold.
    pub out_of_range: u64,
    /// u at a limit.
    pub saturated: u64,
    /// A condition on the rows does not hold.
    pub manual: u64,
    /// After a step of the reference.
    pub blanked: u64,
}

impl ExcludedTotal {
    fn add(&mut self, hop: &Excluded) {
        for (total, new) in [
            (&mut self.missing, hop.missing),
            (&mut self.non_finite, hop.non_finite),
            (&mut self.out_of_range, hop.out_of_range),
            (&mut self.saturated, hop.saturated),
            (&mut self.manual, hop.manual),
            (&mut self.blanked, hop.blanked),
        ] {
            *total += u64::from(new);
        }
    }

    /// Samples left out, whatever the reason.
    pub fn total(&self) -> u64 {
        self.missing + self.non_finite + self.out_of_range + self.saturated + self.manual + self.blanked
    }
}

/// One channel over the whole run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelSummary {
    /// Which index is compared with which.
    pub kind: ChannelKind,
    /// Whether it has a baseline.
    pub learned: bool,
    /// Decisions that it judged.
    pub judged: u64,
    /// Of those, with x outside what calibration saw.
    pub extrapolated: u64,
    /// Mean z; NaN where nothing was judged.
    pub mean_z: f64,
    /// Largest |z|; NaN where nothing was judged.
    pub max_abs_z: f64,
    /// The smallest lasting shift that would have shown; `None` where nothing would have.
    pub detectable: Option<Detectable>,
    /// Decisions with an alarm.
    pub alarms: u64,
    /// The verdict at the last decision.
    pub verdict: Verdict,
    /// The most severe course that it had; `None` without any.
    pub worst: Option<EventKind>,
}

/// All that a run found, in bounded memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// What errors and reports call the recording.
    pub recording: String,
    /// Its first sample, s.
    pub start_s: f64,
    /// From one sample to the next, s.
    pub sample_time_s: f64,
    /// Length of a window, s.
    pub window_s: f64,
    /// From one decision to the next, s.
    pub hop_s: f64,
    /// The date at t = 0, where the recording has dates: seconds since 1970 as written.
    pub zero_s: Option<f64>,
    /// The units of r, y and u, where somebody knows them.
    pub units: Units,
    /// What was found while reading.
    pub quality: Quality,
    /// Decisions, with or without enough valid samples.
    pub hops: u64,
    /// Those whose window had enough valid samples.
    pub valid_hops: u64,
    /// Samples that entered no sum, up to the last decision.
    pub excluded: ExcludedTotal,
    /// In the configuration's order.
    pub channels: [ChannelSummary; 3],
    /// In the order of time; the last may be open.
    pub events: Vec<Event>,
    /// How many events came after those kept in `events`.
    pub more_events: u64,
    /// The most severe of all events; `None` without any.
    pub worst: Option<EventKind>,
    /// u stood at a limit and the error did not vanish; `None` where it never did.
    pub pinned: Option<Pinned>,
}

impl Summary {
    /// Samples of the recording, valid or not.
    pub fn samples(&self) -> u64 {
        self.quality.samples
    }

    /// From the first sample to the end of the last, s.
    pub fn duration_s(&self) -> f64 {
        self.samples() as f64 * self.sample_time_s
    }

    /// How the recording tells the time.
    pub fn clock(&self) -> Clock {
        Clock::new(self.zero_s, self.duration_s())
    }

    /// Whether the run reached the level.
    pub fn reaches(&self, level: FailOn) -> bool {
        let at_least = match level {
            FailOn::Disturbance => EventKind::Disturbance,
            FailOn::Suspect => EventKind::Suspect,
            FailOn::Drift => EventKind::Drift,
        };
        self.worst.is_some_and(|worst| worst >= at_least)
    }
}

#[derive(Debug, Clone, Copy)]
struct ChannelTally {
    summary: ChannelSummary,
    sum_z: f64,
    channel: Channel,
}

/// Counts decisions as they come.
#[derive(Debug, Clone)]
pub(super) struct Tally {
    hops: u64,
    valid_hops: u64,
    excluded: ExcludedTotal,
    channels: [ChannelTally; 3],
    events: Events,
    window_ticks: u32,
    hop_ticks: u32,
}

impl Tally {
    pub(super) fn new(config: &Config<f32, 3>) -> Self {
        Self {
            hops: 0,
            valid_hops: 0,
            excluded: ExcludedTotal::default(),
            channels: config.channels.each_ref().map(|c| ChannelTally {
                summary: ChannelSummary {
                    kind: c.kind,
                    learned: c.baseline.sigma > 0.0,
                    judged: 0,
                    extrapolated: 0,
                    mean_z: f64::NAN,
                    max_abs_z: f64::NAN,
                    detectable: None,
                    alarms: 0,
                    verdict: Verdict::Healthy,
                    worst: None,
                },
                sum_z: 0.0,
                channel: *c,
            }),
            events: Events::new(config),
            window_ticks: config.window_ticks(),
            hop_ticks: config.hop_ticks(),
        }
    }

    pub(super) fn add(&mut self, hop: &Hop) {
        self.hops += 1;
        self.valid_hops += u64::from(hop.report.status == WindowStatus::Valid);
        self.excluded.add(&hop.report.excluded);
        for (tally, channel) in self.channels.iter_mut().zip(&hop.report.channels) {
            let summary = &mut tally.summary;
            summary.verdict = channel.verdict;
            if channel.z.is_nan() {
                continue;
            }
            let z = f64::from(channel.z);
            summary.judged += 1;
            summary.extrapolated += u64::from(channel.extrapolated);
            summary.alarms += u64::from(channel.alarms.side().is_some());
            summary.max_abs_z = summary.max_abs_z.max(z.abs());
            tally.sum_z += z;
        }
        self.events.add(hop);
    }

    pub(super) fn finish(
        self,
        recording: String,
        start_s: f64,
        sample_time_s: f64,
        quality: Quality,
    ) -> Summary {
        let (events, more_events, dropped_worst) = self.events.finish();
        let channels = self.channels.map(|tally| {
            let mut summary = tally.summary;
            if summary.judged > 0 {
                summary.mean_z = tally.sum_z / summary.judged as f64;
            }
            summary.detectable = Detectable::of(&tally.channel, summary.judged);
            let courses = events.iter().flat_map(|e| &e.courses).filter(|c| c.kind == summary.kind);
            summary.worst = courses.map(|c| c.outcome).max();
            summary
        });
        Summary {
            recording,
            start_s,
            sample_time_s,
            window_s: f64::from(self.window_ticks) * sample_time_s,
            hop_s: f64::from(self.hop_ticks) * sample_time_s,
            zero_s: None,
            units: Units::default(),
            quality,
            hops: self.hops,
            valid_hops: self.valid_hops,
            excluded: self.excluded,
            channels,
            worst: events.iter().map(Event::kind).max().max(dropped_worst),
            events,
            more_events,
            pinned: None,
        }
    }
}
