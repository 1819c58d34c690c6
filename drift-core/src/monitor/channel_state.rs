//! What a channel makes of a window: its residual, its detectors, its verdict.

use crate::channel::{Channel, ChannelKind, ChannelReport};
use crate::course::{COURSE_BYTES, Course, Curve, Decision, Verdict};
use crate::detector::{Alarms, DetectorSet, DetectorState};
use crate::index::Index;
use crate::index_set::Row;
use crate::memory::MemoryKind;
use crate::options::Options;
use crate::store::{Reader, Writer};

/// What one channel remembers.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChannelState<O: Options> {
    detectors: <O::Detectors as DetectorSet>::State,
    pub(super) course: Course<O::Curve>,
    memory: <O::Memory as MemoryKind>::State,
}

/// What a channel reports.
pub(super) type Out<O> =
    ChannelReport<<<O as Options>::Detectors as DetectorSet>::Shown, <<O as Options>::Curve as Curve>::Shown>;

/// The report of a channel that has not judged anything yet: zeros, of which the kind and the numbers that are not known are
/// still to be written.
#[inline(always)]
pub(super) const fn unjudged<O: Options>() -> Out<O> {
    ChannelReport {
        kind: ChannelKind::EnergyError(Index::Iae),
        x: 0.0,
        value: 0.0,
        residual: 0.0,
        z: 0.0,
        extrapolated: false,
        detectors: O::Detectors::NOT_SHOWN,
        alarms: Alarms::NONE,
        verdict: Verdict::Healthy,
        side: None,
        fault_curve: O::Curve::NOT_SHOWN,
    }
}

impl<O: Options> ChannelState<O> {
    /// Saved bytes.
    pub(super) const BYTES: usize =
        <O::Detectors as DetectorSet>::State::BYTES + COURSE_BYTES + O::Curve::BYTES + O::Memory::BYTES;

    /// Before the detectors are started.
    pub(super) const FRESH: Self =
        Self { detectors: DetectorState::ZERO, course: Course::HEALTHY, memory: O::Memory::START };

    /// Alarms and the course are forgotten, the windows before are not.
    pub(super) fn acknowledge(&mut self, channel: &Channel) {
        self.detectors = O::Detectors::start(&channel.detectors);
        self.course = Course::HEALTHY;
    }

    /// One decision; x and value are in the report already, NaN where they are not known.
    pub(super) fn judge<P: Row<f32>>(
        &mut self,
        decision: &Decision,
        channel: &Channel,
        point: &P,
        out: &mut Out<O>,
    ) {
        (out.residual, out.z) = (f32::NAN, f32::NAN);
        out.extrapolated = false;
        out.alarms = Alarms::NONE;
        out.verdict = self.course.verdict();
        if channel.baseline.learned() {
            self.judge_residual(decision, channel, point, out);
        }
        out.detectors = O::Detectors::shown(&self.detectors);
        out.side = self.course.side();
        self.course.show_curve(&channel.baseline, &mut out.fault_curve);
    }

    #[inline(always)]
    fn judge_residual<P: Row<f32>>(
        &mut self,
        decision: &Decision,
        channel: &Channel,
        point: &P,
        out: &mut Out<O>,
    ) {
        let carried = O::Memory::carried(&channel.memory, &self.memory);
        // An index that is not known leaves a hole in the memory.
        if (out.x + out.value).is_finite() {
            O::Memory::remember(&mut self.memory, out.x, out.value);
        } else {
            O::Memory::forget(&mut self.memory);
        }
        let Some(carried) = carried else { return };
        let mut value = if O::Memory::LINKED { out.value - carried } else { out.value };
        let (baseline, at) = (&channel.baseline, &channel.operating_point);
        // A constant of the index set: without a point, nothing of this is linked.
        let point = point.as_ref().first().filter(|_| at.counts());
        let mut uncertain = 0.0;
        if let Some(&point) = point {
            value -= at.weight * point;
            uncertain = at.leverage(out.x - baseline.x_mean, point);
        }
        let residual = baseline.residual(out.x, value);
        let z = if O::PREDICTION {
            baseline.standardise_with(out.x, residual, uncertain)
        } else {
            residual / baseline.sigma
        };
        // A unit that makes an index overflow must not poison the detectors.
        if !z.is_finite() {
            return;
        }
        out.residual = residual;
        out.z = z;
        let beyond = point.is_some_and(|&point| point < at.min || point > at.max);
        out.extrapolated = beyond || out.x < baseline.x_min || out.x > baseline.x_max;
        O::Detectors::update(&channel.detectors, &mut self.detectors, z, &mut out.alarms);
        out.verdict = self.course.update(decision, z, out.alarms.side(), out.x, value);
    }

    pub(super) fn write(&self, to: &mut Writer<'_>) {
        self.detectors.write(to);
        self.course.write(to);
        O::Memory::write(&self.memory, to);
    }

    /// A state that this channel can hold.
    pub(super) fn read(from: &mut Reader<'_>, decision: &Decision, channel: &Channel) -> Option<Self> {
        let detectors = DetectorState::read(from)?;
        let course = Course::read(from)?;
        let memory = O::Memory::read(from)?;
        let possible = O::Detectors::possible(&channel.detectors, &detectors) && course.possible(decision);
        possible.then_some(Self { detectors, course, memory })
    }
}
