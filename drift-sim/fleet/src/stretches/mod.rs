//! Where in a long log a diagnosis is worth its while: stretches with excitation, by hand, at a limit, in oscillation, and where something
//! changed; after Bittencourt, Isaksson, Peretzki and Forsman, "An Algorithm for Finding Process Identification Intervals from Normal
//! Operating Data" (Processes 3(2), 2015), which searches logs of SP, OP, PV and mode for stretches that a model can be learnt from.
//!
//! One pass, sample by sample, in constant memory. Lengths count samples, not seconds: a loop is logged about as fast as it moves.

mod change;
mod excitation;
mod oscillation;
mod saturation;

use drift_sim::recording::{RowState, Sample};

use change::Changes;
use excitation::Excitation;
use oscillation::Oscillation;
use saturation::Saturation;

/// Stretches of one loop that are kept; further ones are counted only.
pub const KEPT: usize = 1000;
/// Shorter stretches than this many samples are passed over.
const LEAST_SAMPLES: u64 = 60;

/// What a stretch is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// The reference moves, or the hand moves u, and y follows: a model can be learnt.
    Excitation,
    /// The loop is open.
    Manual,
    /// u stands at a limit and the error doesn't vanish.
    Saturation,
    /// The error swings regularly.
    Oscillation,
    /// u or the error's size has moved to another level while r stood still.
    Change,
}

impl Kind {
    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Excitation => "excitation",
            Self::Manual => "manual",
            Self::Saturation => "saturation",
            Self::Oscillation => "oscillation",
            Self::Change => "change",
        }
    }
}

/// A stretch of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// What it is worth.
    pub kind: Kind,
    /// Its first sample, s.
    pub from_s: f64,
    /// Its last sample, s.
    pub to_s: f64,
    /// How clear it is; what it counts depends on the kind: of an excitation Wald's statistic, of a change and of a limit sigmas, of an
    /// oscillation half periods, by hand samples.
    pub score: f64,
}

/// Looks for all kinds at once.
#[derive(Debug, Clone)]
pub struct Finder {
    manual: Option<(Stretch, u64)>,
    excitation: Excitation,
    saturation: Saturation,
    oscillation: Oscillation,
    changes: Changes,
    found: Vec<Stretch>,
    /// Stretches beyond those kept.
    dropped: u64,
}

impl Default for Finder {
    fn default() -> Self {
        Self::new()
    }
}

impl Finder {
    /// Nothing was seen yet.
    pub fn new() -> Self {
        Self {
            manual: None,
            excitation: Excitation::new(),
            saturation: Saturation::default(),
            oscillation: Oscillation::default(),
            changes: Changes::default(),
            found: Vec::new(),
            dropped: 0,
        }
    }

    /// The next sample.
    pub fn sample(&mut self, sample: &Sample<'_>) {
        let (t_s, r, y, u) = (sample.t_s, sample.r, sample.y, sample.u);
        let by_hand = sample.state == RowState::Manual;
        if by_hand {
            let begin = Stretch { kind: Kind::Manual, from_s: t_s, to_s: t_s, score: 0.0 };
            let (stretch, samples) = self.manual.get_or_insert((begin, 0));
            *samples += 1;
            (stretch.to_s, stretch.score) = (t_s, *samples as f64);
        } else {
            self.end_manual();
        }
        let is_known = |x: f64| x.is_finite();
        if !(is_known(y) && is_known(u) && (by_hand || is_known(r))) {
            return;
        }
        let found = self.excitation.sample(t_s, if by_hand { u } else { r }, y, by_hand);
        self.keep(found);
        if by_hand {
            return;
        }
        let e = r - y;
        let found = self.saturation.sample(t_s, e, u);
        self.keep(found);
        let found = self.oscillation.sample(t_s, e);
        self.keep(found);
        let found = self.changes.sample(t_s, r, e, u);
        self.keep(found);
    }

    fn end_manual(&mut self) {
        if let Some((stretch, samples)) = self.manual.take()
            && samples >= LEAST_SAMPLES
        {
            self.keep(Some(stretch));
        }
    }

    fn keep(&mut self, found: Option<Stretch>) {
        let Some(stretch) = found else { return };
        if self.found.len() < KEPT { self.found.push(stretch) } else { self.dropped += 1 }
    }

    /// All stretches in the order of their beginnings, and how many more there were.
    pub fn finish(mut self) -> (Vec<Stretch>, u64) {
        self.end_manual();
        let open = [self.excitation.end(), self.saturation.end(), self.oscillation.end(), self.changes.end()];
        open.into_iter().for_each(|found| self.keep(found));
        self.found.sort_by(|a, b| a.from_s.total_cmp(&b.from_s).then(a.kind.cmp(&b.kind)));
        (self.found, self.dropped)
    }
}
