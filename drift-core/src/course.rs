//! Disturbance or drift (sections 3.1 and 3.2 of the paper): what comes back to the baseline was a disturbance,
//! what stays is a drift.
//!
//! From an alarm on, every decision adds evidence that the residual stays: a sequential test between "at half the
//! mean distance of the windows that were away" and "back at zero". The mean, because the largest distance grows
//! with the noise alone, and a shift of one sigma would soon be measured against 1.5; only of windows that were
//! away, so that the end of a large disturbance is still seen as one. Evidence is capped on both sides, so that a
//! large disturbance is forgotten as fast as a small one once it is gone, and no single window moves it by more
//! than half of what a verdict needs, so that a tilted curve, whose residual goes up and down with x, is not taken
//! for one that came back. A drift is confirmed when the evidence stands at its cap and `confirm_hops` decisions
//! have passed; before that, nothing can be told from a disturbance of that length.

use core::fmt::Debug;

use crate::channel::{Baseline, FaultCurve};
use crate::detector::Side;
use crate::line_fit::{LINE_BYTES, Line};
use crate::math::{exceeds, half, reaches};
use crate::options::Never;
use crate::store::{Fingerprint, Reader, Writer};

/// How long and how strongly a deviation must stay to be called drift.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Decision {
    /// Decisions after an alarm before a drift can be confirmed: the longest disturbance to be expected.
    pub confirm_hops: u16,
    /// Log odds needed to call it either way; 4.6 is 99 to 1.
    pub log_odds: f32,
    /// The smallest shift that counts as away from the baseline, sigmas.
    pub smallest_shift: f32,
}

impl Decision {
    /// Twenty decisions, 99 to 1, one sigma.
    pub const DEFAULT: Self = Self { confirm_hops: 20, log_odds: 4.6, smallest_shift: 1.0 };

    pub(crate) const fn valid(&self) -> bool {
        self.confirm_hops > 0
            && self.log_odds.is_finite()
            && self.log_odds > 0.0
            && self.smallest_shift.is_finite()
            && self.smallest_shift > 0.0
    }

    pub(crate) fn fingerprint(&self, to: &mut Fingerprint<'_>) {
        to.u32(u32::from(self.confirm_hops));
        to.f32(self.log_odds);
        to.f32(self.smallest_shift);
    }
}

impl Default for Decision {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// What a channel's course amounts to, in rising severity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Verdict {
    /// On the baseline.
    Healthy,
    /// At this decision a deviation ended before it could be called drift: a disturbance, or a false alarm.
    Disturbance,
    /// At this decision a confirmed drift ended: repaired, or a long disturbance.
    Recovered,
    /// An alarm was raised; not yet known which.
    Suspect,
    /// Away from the baseline to stay.
    Drift,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    // The numbers of the verdicts: nothing is looked up.
    Healthy = Verdict::Healthy as isize,
    Suspect = Verdict::Suspect as isize,
    Drift = Verdict::Drift as isize,
}

/// Whether a confirmed drift is refitted, as a type: [`Refitted`] or [`Never`].
pub trait Curve: Copy + Debug + PartialEq + 'static {
    /// What is remembered of the windows since the alarm.
    type State: Copy + Debug + PartialEq;
    /// What is reported of it.
    type Shown: Copy + Debug + PartialEq;
    /// No window yet.
    const EMPTY: Self::State;
    /// No drift.
    const NOT_SHOWN: Self::Shown;
    /// Saved bytes.
    const BYTES: usize;
    /// Adds a window as the `windows`th since the alarm.
    fn add(state: &mut Self::State, windows: u16, x: f32, value: f32);
    /// Reports the curve of a confirmed drift.
    fn show(state: &Self::State, windows: u16, baseline: &Baseline, into: &mut Self::Shown);
    /// Whether such a state can be.
    fn possible(state: &Self::State) -> bool;
    /// Saves.
    fn write(state: &Self::State, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self::State>;
}

/// A confirmed drift is reported with the curve refitted on the windows since the alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refitted;

impl Curve for Refitted {
    type State = Line;
    type Shown = Option<FaultCurve>;
    const EMPTY: Line = Line::EMPTY;
    const NOT_SHOWN: Option<FaultCurve> = None;
    const BYTES: usize = LINE_BYTES;
    #[inline(always)]
    fn add(state: &mut Line, windows: u16, x: f32, value: f32) {
        state.add(u32::from(windows), x, value);
    }
    #[inline(always)]
    fn show(state: &Line, windows: u16, baseline: &Baseline, into: &mut Option<FaultCurve>) {
        *into = Some(FaultCurve::of(state, u32::from(windows), baseline));
    }
    fn possible(state: &Line) -> bool {
        state.possible()
    }
    fn write(state: &Line, to: &mut Writer<'_>) {
        state.write(to);
    }
    fn read(from: &mut Reader<'_>) -> Option<Line> {
        Line::read(from)
    }
}

impl Curve for Never {
    type State = ();
    type Shown = ();
    const EMPTY: () = ();
    const NOT_SHOWN: () = ();
    const BYTES: usize = 0;
    #[inline(always)]
    fn add((): &mut (), _: u16, _: f32, _: f32) {}
    #[inline(always)]
    fn show((): &(), _: u16, _: &Baseline, (): &mut ()) {}
    fn possible((): &()) -> bool {
        true
    }
    fn write((): &(), _: &mut Writer<'_>) {}
    fn read(_: &mut Reader<'_>) -> Option<()> {
        Some(())
    }
}

/// Saved bytes of one course besides its curve.
pub(crate) const COURSE_BYTES: usize = 14;

/// The course of one channel since its last alarm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Course<F: Curve> {
    phase: Phase,
    /// None while it is healthy.
    side: Option<Side>,
    /// Decisions since the alarm, as far as 65535: later windows are then learnt with that one's weight.
    hops: u16,
    hops_away: u16,
    mean_away: f32,
    evidence: f32,
    since: F::State,
}

impl<F: Curve> Course<F> {
    pub(crate) const HEALTHY: Self = Self {
        phase: Phase::Healthy,
        side: None,
        hops: 0,
        hops_away: 0,
        mean_away: 0.0,
        evidence: 0.0,
        since: F::EMPTY,
    };

    /// One decision: the standardised residual, the alarm raised at it, and the window's coordinates.
    pub(crate) fn update(
        &mut self,
        decision: &Decision,
        z: f32,
        alarm: Option<Side>,
        x: f32,
        value: f32,
    ) -> Verdict {
        if self.phase == Phase::Healthy {
            if alarm.is_none() {
                return Verdict::Healthy;
            }
            // Nothing else needs to be set: a course that ended was forgotten as a whole.
            (self.phase, self.side) = (Phase::Suspect, alarm);
        }
        self.hops = self.hops.saturating_add(1);
        F::add(&mut self.since, self.hops, x, value);
        self.weigh(decision, if self.side == Some(Side::Low) { -z } else { z });
        if reaches(-self.evidence, decision.log_odds) {
            let was_drift = self.phase == Phase::Drift;
            *self = Self::HEALTHY;
            return if was_drift { Verdict::Recovered } else { Verdict::Disturbance };
        }
        if self.hops >= decision.confirm_hops && reaches(self.evidence, decision.log_odds) {
            self.phase = Phase::Drift;
        }
        self.verdict()
    }

    fn weigh(&mut self, decision: &Decision, away: f32) {
        let shift = self.shift(decision);
        let step = shift * (away - half(shift));
        let most = 0.5 * decision.log_odds;
        // `clamp` would keep a path to a panic in the image.
        let step_bounded = if exceeds(step, most) {
            most
        } else if exceeds(-step, most) {
            -most
        } else {
            step
        };
        self.evidence += step_bounded;
        if exceeds(self.evidence, decision.log_odds) {
            self.evidence = decision.log_odds;
        }
        if exceeds(step, 0.0) {
            self.hops_away = self.hops_away.saturating_add(1);
            self.mean_away += (away - self.mean_away) / f32::from(self.hops_away);
        }
    }

    /// What the test takes "away" to be, sigmas.
    fn shift(&self, decision: &Decision) -> f32 {
        // `f32::max` would call fmaxf, which a C firmware may not link.
        let mean = half(self.mean_away);
        if exceeds(mean, decision.smallest_shift) { mean } else { decision.smallest_shift }
    }

    pub(crate) fn verdict(&self) -> Verdict {
        match self.phase {
            Phase::Healthy => Verdict::Healthy,
            Phase::Suspect => Verdict::Suspect,
            Phase::Drift => Verdict::Drift,
        }
    }

    pub(crate) fn side(&self) -> Option<Side> {
        self.side
    }

    /// Reports the curve of the windows since the alarm, once the drift is confirmed.
    #[inline(always)]
    pub(crate) fn show_curve(&self, baseline: &Baseline, into: &mut F::Shown) {
        // Written in place: an optional curve that is handed over is copied, its padding included.
        if self.phase == Phase::Drift {
            F::show(&self.since, self.hops, baseline, into);
        } else {
            *into = F::NOT_SHOWN;
        }
    }

    pub(crate) fn possible(&self, decision: &Decision) -> bool {
        let forgotten = self.phase != Phase::Healthy || *self == Self::HEALTHY;
        forgotten && self.evidence.abs() <= decision.log_odds && F::possible(&self.since)
    }

    pub(crate) fn write(&self, to: &mut Writer<'_>) {
        to.u8(match self.phase {
            Phase::Healthy => 0,
            Phase::Suspect => 1,
            Phase::Drift => 2,
        });
        to.u8(u8::from(self.side == Some(Side::Low)));
        to.u16(self.hops);
        to.u16(self.hops_away);
        to.f32(self.mean_away);
        to.f32(self.evidence);
        F::write(&self.since, to);
    }

    pub(crate) fn read(from: &mut Reader<'_>) -> Option<Self> {
        let (phase, low) = (from.u8()?, from.u8()?);
        let (phase, side) = match (phase, low) {
            (0, 0) => (Phase::Healthy, None),
            (1, 0) => (Phase::Suspect, Some(Side::High)),
            (1, 1) => (Phase::Suspect, Some(Side::Low)),
            (2, 0) => (Phase::Drift, Some(Side::High)),
            (2, 1) => (Phase::Drift, Some(Side::Low)),
            _ => return None,
        };
        Some(Self {
            phase,
            side,
            hops: from.u16()?,
            hops_away: from.u16()?,
            mean_away: from.f32()?,
            evidence: from.f32()?,
            since: F::read(from)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(z: impl Iterator<Item = f32>) -> Course<Refitted> {
        let mut course = Course::HEALTHY;
        for (i, z) in z.enumerate() {
            course.update(&Decision::DEFAULT, z, (i == 0).then_some(Side::High), 0.0, z);
        }
        course
    }

    #[test]
    fn what_stays_is_a_drift_only_after_the_confirming_time() {
        assert_eq!(run([2.0; 19].into_iter()).verdict(), Verdict::Suspect);
        assert_eq!(run([2.0; 20].into_iter()).verdict(), Verdict::Drift);
    }

    #[test]
    fn a_large_disturbance_is_forgotten_once_gone() {
        let mut course = run([50.0; 15].into_iter());
        let verdicts: [Verdict; 4] =
            core::array::from_fn(|_| course.update(&Decision::DEFAULT, 0.0, None, 0.0, 0.0));
        assert_eq!(verdicts[3], Verdict::Disturbance, "{verdicts:?}");
    }

    #[test]
    fn a_false_alarm_ends_as_a_disturbance() {
        let mut course = run([3.2].into_iter());
        let ended = (0..20).map(|_| course.update(&Decision::DEFAULT, 0.0, None, 0.0, 0.0));
        assert!(ended.into_iter().any(|v| v == Verdict::Disturbance));
    }

    #[test]
    fn a_repaired_drift_is_said() {
        let mut course = run([6.0; 40].into_iter());
        assert_eq!(course.verdict(), Verdict::Drift);
        let verdicts: [Verdict; 4] =
            core::array::from_fn(|_| course.update(&Decision::DEFAULT, 0.0, None, 0.0, 0.0));
        assert!(verdicts.contains(&Verdict::Recovered), "{verdicts:?}");
    }
}
