//! Decisions merged to events. A channel's course runs from its alarm until it is back on the baseline; courses
//! that overlap in time are one event.

use drift_core::{Baseline, ChannelKind, ChannelReport, Config, FaultCurve, Location, Side, Verdict};
use serde::Serialize;

use super::run::Hop;

/// Events that are kept; what comes after is counted only, so that a recording of any length fits.
const KEPT: usize = 1000;

/// What an event was, in rising severity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// It came back to the baseline before it could be called drift: a disturbance, or a false alarm.
    Disturbance,
    /// The recording ends before it can be told.
    Suspect,
    /// Away to stay, or for longer than any disturbance that was to be expected.
    Drift,
}

impl EventKind {
    /// Its name in files and on screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Disturbance => "disturbance",
            Self::Suspect => "suspect",
            Self::Drift => "drift",
        }
    }
}

/// A detector that raised a course, by its name: one of [`drift_core::Detectors::NAMES`].
pub type Raised = &'static str;

/// One channel's way from its alarm back to the baseline.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// The channel that moved.
    pub kind: ChannelKind,
    /// To which side it went.
    pub side: Side,
    /// What it amounts to.
    pub outcome: EventKind,
    /// Estimated beginning, s: where the sum that alarmed last stood at zero (Page 1954).
    pub from_s: f64,
    /// The decision that raised it, s.
    pub alarm_s: f64,
    /// End of the last window that was away; `None` while it still is.
    pub to_s: Option<f64>,
    /// The detectors that raised it.
    pub detectors: Vec<Raised>,
    /// Largest |z| to its side.
    pub max_z: f32,
    /// The healthy relation that it left.
    pub baseline: Baseline,
    /// The part of a lasting shift of the value that the residual shows: less than all, or more, of a relation with memory.
    pub visible: f32,
    /// The refitted curve, once drift was confirmed.
    pub fault_curve: Option<FaultCurve>,
    last_away_s: f64,
}

/// Courses of one or more channels that overlap in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// In the order of their alarms.
    pub courses: Vec<Course>,
    /// Where the deviation seems to be.
    pub location: Location,
}

impl Event {
    /// The most severe of its courses.
    pub fn kind(&self) -> EventKind {
        self.courses.iter().map(|c| c.outcome).max().unwrap_or(EventKind::Disturbance)
    }

    /// Earliest estimated beginning, s.
    pub fn from_s(&self) -> f64 {
        self.courses.iter().map(|c| c.from_s).fold(f64::INFINITY, f64::min)
    }

    /// When the first of its alarms came, s.
    pub fn alarm_s(&self) -> f64 {
        self.courses.iter().map(|c| c.alarm_s).fold(f64::INFINITY, f64::min)
    }

    /// End, s; `None` while any channel is away.
    pub fn to_s(&self) -> Option<f64> {
        self.courses.iter().map(|c| c.to_s).try_fold(f64::NEG_INFINITY, |latest, to| Some(latest.max(to?)))
    }

    /// The course that went farthest.
    pub fn main(&self) -> Option<&Course> {
        self.courses.iter().max_by(|a, b| a.max_z.total_cmp(&b.max_z))
    }
}

/// Where a sum's rise began, for both sides.
#[derive(Debug, Clone, Copy, Default)]
struct Rise {
    high_s: Option<f64>,
    low_s: Option<f64>,
}

impl Rise {
    fn of(&self, side: Side) -> Option<f64> {
        match side {
            Side::High => self.high_s,
            Side::Low => self.low_s,
        }
    }

    /// A sum above zero has been rising since it last was not.
    fn follow(&mut self, high: f32, low: f32, now_s: f64) {
        let step = |since: &mut Option<f64>, sum: f32| {
            *since = if sum > 0.0 { since.or(Some(now_s)) } else { None };
        };
        step(&mut self.high_s, high);
        step(&mut self.low_s, low);
    }
}

/// What one channel remembers between decisions.
#[derive(Debug, Clone, Default)]
struct ChannelTrack {
    cusum: Rise,
    ewma: Rise,
    sprt: Rise,
    /// Place of its open course in the open event.
    open: Option<usize>,
}

/// Merges decisions to events as they come.
#[derive(Debug, Clone)]
pub struct Events {
    baselines: [Baseline; 3],
    visible: [f32; 3],
    smallest_shift: f32,
    tracks: [ChannelTrack; 3],
    open: Option<Event>,
    closed: Vec<Event>,
    /// Events beyond those kept.
    dropped: u64,
    /// The most severe kind among them.
    dropped_worst: Option<EventKind>,
}

impl Events {
    /// None yet.
    pub fn new(config: &Config<f32, 3>) -> Self {
        Self {
            baselines: config.channels.each_ref().map(|c| c.baseline),
            visible: config.channels.each_ref().map(|c| c.memory.visible()),
            smallest_shift: config.decision.smallest_shift,
            tracks: Default::default(),
            open: None,
            closed: Vec::new(),
            dropped: 0,
            dropped_worst: None,
        }
    }

    /// One decision.
    pub fn add(&mut self, hop: &Hop) {
        for (i, channel) in hop.report.channels.iter().enumerate() {
            self.follow(i, channel, hop);
        }
        if let Some(event) = &mut self.open {
            event.location = together(event.location, hop.report.location());
        }
        if self.tracks.iter().all(|t| t.open.is_none())
            && let Some(event) = self.open.take()
        {
            self.keep(event);
        }
    }

    fn follow(&mut self, i: usize, channel: &ChannelReport, hop: &Hop) {
        let Some(track) = self.tracks.get_mut(i) else { return };
        if track.open.is_none()
            && let Some(side) = channel.side.or(channel.alarms.side())
        {
            let course = self.begin(i, channel, side, hop);
            let event =
                self.open.get_or_insert(Event { courses: Vec::new(), location: hop.report.location() });
            event.courses.push(course);
            let place = event.courses.len() - 1;
            if let Some(track) = self.tracks.get_mut(i) {
                track.open = Some(place);
            }
        }
        self.continue_course(i, channel, hop);
        if let Some(track) = self.tracks.get_mut(i) {
            let (cusum, sprt) = (channel.detectors.cusum, channel.detectors.sprt);
            if channel.alarms.cusum.is_some() {
                track.cusum = Rise::default();
            } else {
                track.cusum.follow(cusum.high, cusum.low, hop.new_from_s);
            }
            track.sprt.follow(sprt.high, sprt.low, hop.new_from_s);
            let mean = channel.detectors.ewma.mean;
            track.ewma.follow(mean.max(0.0), (-mean).max(0.0), hop.new_from_s);
        }
    }

    fn begin(&self, i: usize, channel: &ChannelReport, side: Side, hop: &Hop) -> Course {
        let track = self.tracks.get(i).cloned().unwrap_or_default();
        let alarms = channel.alarms;
        // The slow detectors saw it coming; the instant one sees the newest window only.
        let rises = [
            alarms.cusum.and_then(|s| track.cusum.of(s)),
            alarms.ewma.and_then(|s| track.ewma.of(s)),
            alarms.sprt.and_then(|s| track.sprt.of(s)),
            Some(hop.new_from_s),
        ];
        Course {
            kind: channel.kind,
            side,
            outcome: EventKind::Suspect,
            from_s: rises.into_iter().flatten().fold(f64::INFINITY, f64::min),
            alarm_s: hop.to_s,
            to_s: None,
            // The instant one first.
            detectors: alarms.each().rev().filter_map(|(name, side)| side.map(|_| name)).collect(),
            max_z: 0.0,
            baseline: self.baselines.get(i).copied().unwrap_or(Baseline::UNLEARNED),
            visible: self.visible.get(i).copied().unwrap_or(1.0),
            fault_curve: None,
            last_away_s: hop.to_s,
        }
    }

    fn continue_course(&mut self, i: usize, channel: &ChannelReport, hop: &Hop) {
        let Some(track) = self.tracks.get_mut(i) else { return };
        let Some(course) = track.open.and_then(|at| self.open.as_mut().and_then(|e| e.courses.get_mut(at)))
        else {
            return;
        };
        let away = match course.side {
            Side::High => channel.z,
            Side::Low => -channel.z,
        };
        if away > course.max_z {
            course.max_z = away;
        }
        if away > self.smallest_shift {
            course.last_away_s = hop.to_s;
        }
        if channel.fault_curve.is_some() {
            course.fault_curve = channel.fault_curve;
        }
        match channel.verdict {
            Verdict::Drift => course.outcome = EventKind::Drift,
            Verdict::Suspect => {}
            Verdict::Healthy | Verdict::Disturbance | Verdict::Recovered => {
                if course.outcome == EventKind::Suspect {
                    course.outcome = EventKind::Disturbance;
                }
                course.to_s = Some(course.last_away_s);
                track.open = None;
            }
        }
    }

    fn keep(&mut self, event: Event) {
        if self.closed.len() < KEPT {
            self.closed.push(event);
        } else {
            self.dropped += 1;
            self.dropped_worst = self.dropped_worst.max(Some(event.kind()));
        }
    }

    /// All events in order, the open one last; how many more there were, and the most severe kind among those.
    pub fn finish(mut self) -> (Vec<Event>, u64, Option<EventKind>) {
        if let Some(event) = self.open.take() {
            self.keep(event);
        }
        (self.closed, self.dropped, self.dropped_worst)
    }
}

fn together(a: Location, b: Location) -> Location {
    match (a, b) {
        (Location::Nowhere, other) | (other, Location::Nowhere) => other,
        (a, b) if a == b => a,
        _ => Location::Several,
    }
}
