//! What a channel makes of a window: its residual, its detectors, its verdict.

use crate::channel::{Channel, ChannelKind, ChannelReport, FaultCurve};
use crate::course::{Course, Decision, Verdict};
use crate::detector::{Alarms, DetectorStates};
use crate::index::Indices;

/// What one channel remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ChannelState {
    pub(super) detectors: DetectorStates,
    pub(super) course: Course,
}

/// The report of a window that no channel has judged yet.
pub(super) fn unjudged(kind: ChannelKind) -> ChannelReport {
    ChannelReport {
        kind,
        x: f32::NAN,
        value: f32::NAN,
        residual: f32::NAN,
        z: f32::NAN,
        extrapolated: false,
        detectors: DetectorStates {
            cusum: crate::detector::CusumState::ZERO,
            sprt: crate::detector::SprtState::ZERO,
        },
        alarms: Alarms::NONE,
        verdict: Verdict::Healthy,
        side: None,
        fault_curve: None,
    }
}

impl ChannelState {
    #[inline(never)]
    pub(super) fn judge(
        &mut self,
        decision: &Decision,
        channel: &Channel,
        indices: Option<&Indices>,
        out: &mut ChannelReport,
    ) {
        out.verdict = self.course.verdict();
        if let Some(indices) = indices {
            (out.x, out.value) = channel.kind.coordinates(indices);
            if channel.baseline.learned() {
                self.judge_residual(decision, channel, out);
            }
        }
        out.detectors = self.detectors;
        out.side = self.course.side();
        out.fault_curve = self.course.drifted().map(|fit| FaultCurve::of(fit, &channel.baseline));
    }

    fn judge_residual(&mut self, decision: &Decision, channel: &Channel, out: &mut ChannelReport) {
        let residual = channel.baseline.residual(out.x, out.value);
        let z = channel.baseline.standardise(out.x, residual);
        // A unit that makes an index overflow must not poison the detectors.
        if !z.is_finite() {
            return;
        }
        out.residual = residual;
        out.z = z;
        out.extrapolated = out.x < channel.baseline.x_min || out.x > channel.baseline.x_max;
        out.alarms = channel.detectors.update(&mut self.detectors, z);
        out.verdict = self.course.update(decision, z, out.alarms.side(), out.x, out.value);
    }
}
