//! The report as C sees it.

use drift_core::{
    ChannelReport, DetectorStates, Excluded, FaultCurve, Indices, IndicesAt, Moved, PairIndices, Report,
    Side, TotalExcluded,
};

use crate::codes::{
    self, drift_index_t, drift_kind_t, drift_location_t, drift_moved_t, drift_side_t, drift_verdict_t,
};
use crate::config::DRIFT_CHANNELS;

/// Bytes of a report.
pub const DRIFT_REPORT_BYTES: usize = 296;
const _: () = assert!(size_of::<drift_report_t>() == DRIFT_REPORT_BYTES);

/// One channel at one decision.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_channel_report_t {
    /// What is compared.
    pub kind: drift_kind_t,
    /// The error index of DRIFT_ENERGY_ERROR.
    pub index: drift_index_t,
    /// The window's place on the baseline's axis.
    pub x: f32,
    /// The index that is judged.
    pub value: f32,
    /// Its distance from the baseline; NaN where nothing could be judged.
    pub residual: f32,
    /// The same in standard deviations.
    pub z: f32,
    /// CUSUM's two sums, sigmas.
    pub cusum_high: f32,
    /// See cusum_high.
    pub cusum_low: f32,
    /// The weighted average, sigmas.
    pub ewma_mean: f32,
    /// SPRT's two log-likelihood ratios.
    pub sprt_high: f32,
    /// See sprt_high.
    pub sprt_low: f32,
    /// The refitted curve, where has_fault_curve is 1.
    pub fault_b0: f32,
    /// Its slope.
    pub fault_b1: f32,
    /// Its mean distance from the baseline.
    pub fault_shift: f32,
    /// Windows that it was fitted on.
    pub fault_windows: u32,
    /// What the channel's course amounts to.
    pub verdict: drift_verdict_t,
    /// To which side it moved.
    pub side: drift_side_t,
    /// The side at which each detector alarmed.
    pub alarm_shewhart: drift_side_t,
    /// See alarm_shewhart.
    pub alarm_cusum: drift_side_t,
    /// See alarm_shewhart.
    pub alarm_ewma: drift_side_t,
    /// See alarm_shewhart.
    pub alarm_sprt: drift_side_t,
    /// 1: x lies outside what calibration saw.
    pub extrapolated: u8,
    /// 1: a drift is confirmed and its curve refitted.
    pub has_fault_curve: u8,
    /// How the curve moved.
    pub moved: drift_moved_t,
}

/// One decision.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_report_t {
    /// Decisions before this one.
    pub hop: u32,
    /// 1: enough valid ticks; 0: indices are NaN, detectors stand still.
    pub valid: u8,
    /// The most severe verdict among the channels.
    pub verdict: drift_verdict_t,
    /// Where the deviation seems to be.
    pub location: drift_location_t,
    /// Channels that are filled in.
    pub channel_count: u8,
    /// Control energy, u-unit^2 s.
    pub e_u: f32,
    /// Integral of |e|; what the monitor does not keep is NaN.
    pub iae: f32,
    /// Integral of e^2.
    pub ise: f32,
    /// Integral of t |e|.
    pub itae: f32,
    /// Integral of t e^2.
    pub itse: f32,
    /// Mean of u.
    pub mean_u: f32,
    /// Mean of y.
    pub mean_y: f32,
    /// Mean of e.
    pub mean_e: f32,
    /// Largest |u|.
    pub peak_u: f32,
    /// Largest |e|.
    pub peak_e: f32,
    /// Sum of the reference's squared steps.
    pub reference_activity: f32,
    /// Mean of u sign(dy).
    pub motion_effort: f32,
    /// Mean of |dy|/dt.
    pub speed: f32,
    /// Mean of the operating point, in the kinds of drift_full_at_init.
    pub operating_point: f32,
    /// Ticks left out since the last decision, whatever the reason.
    pub left_out: u16,
    /// Of them, where the kind of monitor tells them apart: no sample.
    pub missing: u16,
    /// NaN or infinite.
    pub non_finite: u16,
    /// Too large.
    pub out_of_range: u16,
    /// u at a limit.
    pub saturated: u16,
    /// Loop open.
    pub manual: u16,
    /// After a step of the reference.
    pub blanked: u16,
    /// The channels.
    pub channels: [drift_channel_report_t; DRIFT_CHANNELS],
}

fn side(side: Option<Side>) -> drift_side_t {
    match side {
        None => codes::DRIFT_SIDE_NONE,
        Some(Side::High) => codes::DRIFT_SIDE_HIGH,
        Some(Side::Low) => codes::DRIFT_SIDE_LOW,
    }
}

/// An index set's numbers in a report.
pub(crate) trait ReportedIndices {
    /// Writes them.
    fn report(&self, into: &mut drift_report_t);
}

impl ReportedIndices for PairIndices {
    fn report(&self, into: &mut drift_report_t) {
        (into.e_u, into.iae) = (self.e_u, self.error);
    }
}

impl ReportedIndices for Indices {
    fn report(&self, into: &mut drift_report_t) {
        (into.e_u, into.iae, into.ise, into.itae, into.itse) =
            (self.e_u, self.iae, self.ise, self.itae, self.itse);
        (into.mean_u, into.mean_y, into.mean_e) = (self.mean_u, self.mean_y, self.mean_e);
        (into.peak_u, into.peak_e) = (self.peak_u, self.peak_e);
        (into.reference_activity, into.motion_effort) = (self.reference_activity, self.motion_effort);
        into.speed = self.speed;
    }
}

impl ReportedIndices for IndicesAt {
    fn report(&self, into: &mut drift_report_t) {
        self.indices.report(into);
        into.operating_point = self.operating_point;
    }
}

/// Counts of ticks left out in a report.
pub(crate) trait ReportedExclusions {
    /// Writes them.
    fn report(&self, into: &mut drift_report_t);
}

impl ReportedExclusions for TotalExcluded {
    fn report(&self, into: &mut drift_report_t) {
        into.left_out = self.ticks;
    }
}

impl ReportedExclusions for Excluded {
    fn report(&self, into: &mut drift_report_t) {
        into.left_out = self.total().min(u32::from(u16::MAX)) as u16;
        (into.missing, into.non_finite, into.out_of_range) =
            (self.missing, self.non_finite, self.out_of_range);
        (into.saturated, into.manual, into.blanked) = (self.saturated, self.manual, self.blanked);
    }
}

/// What detectors hold in a report.
pub(crate) trait ReportedDetectors {
    /// Writes it.
    fn report(&self, into: &mut drift_channel_report_t);
}

impl ReportedDetectors for () {
    fn report(&self, _: &mut drift_channel_report_t) {}
}

impl ReportedDetectors for DetectorStates {
    fn report(&self, into: &mut drift_channel_report_t) {
        (into.cusum_high, into.cusum_low) = (self.cusum.high, self.cusum.low);
        into.ewma_mean = self.ewma.mean;
        (into.sprt_high, into.sprt_low) = (self.sprt.high, self.sprt.low);
    }
}

/// The refitted curve in a report.
pub(crate) trait ReportedCurve {
    /// Writes it.
    fn report(&self, into: &mut drift_channel_report_t);
}

impl ReportedCurve for () {
    fn report(&self, _: &mut drift_channel_report_t) {}
}

impl ReportedCurve for Option<FaultCurve> {
    fn report(&self, into: &mut drift_channel_report_t) {
        if let Some(curve) = self {
            into.has_fault_curve = 1;
            into.moved = match curve.moved {
                Moved::Undecided => codes::DRIFT_MOVED_UNDECIDED,
                Moved::Intercept => codes::DRIFT_MOVED_INTERCEPT,
                Moved::Slope => codes::DRIFT_MOVED_SLOPE,
                Moved::Both => codes::DRIFT_MOVED_BOTH,
            };
            (into.fault_b0, into.fault_b1, into.fault_shift) = (curve.b0, curve.b1, curve.shift);
            into.fault_windows = curve.windows;
        }
    }
}

impl drift_report_t {
    const EMPTY: Self = Self {
        hop: 0,
        valid: 0,
        verdict: 0,
        location: 0,
        channel_count: 0,
        e_u: f32::NAN,
        iae: f32::NAN,
        ise: f32::NAN,
        itae: f32::NAN,
        itse: f32::NAN,
        mean_u: f32::NAN,
        mean_y: f32::NAN,
        mean_e: f32::NAN,
        peak_u: f32::NAN,
        peak_e: f32::NAN,
        reference_activity: f32::NAN,
        motion_effort: f32::NAN,
        speed: f32::NAN,
        operating_point: f32::NAN,
        left_out: 0,
        missing: 0,
        non_finite: 0,
        out_of_range: 0,
        saturated: 0,
        manual: 0,
        blanked: 0,
        channels: [drift_channel_report_t::EMPTY; DRIFT_CHANNELS],
    };

    /// Writes a report.
    ///
    /// # Safety
    /// `into` is aligned and points to memory of its type.
    pub(crate) unsafe fn fill<const C: usize, I, X, D, F>(
        into: *mut Self,
        report: &Report<C, I, X, ChannelReport<D, F>>,
    ) where
        I: ReportedIndices,
        X: ReportedExclusions,
        D: ReportedDetectors,
        F: ReportedCurve,
    {
        // SAFETY: the caller's promise; written before it is referred to.
        let into = unsafe {
            into.write(Self::EMPTY);
            &mut *into
        };
        into.hop = report.hop;
        into.valid = u8::from(report.status == drift_core::WindowStatus::Valid);
        (into.verdict, into.location) = (report.verdict as u8, report.location() as u8);
        into.channel_count = C as u8;
        report.indices.report(into);
        report.excluded.report(into);
        for (to, from) in into.channels.iter_mut().zip(&report.channels) {
            to.fill(from);
        }
    }
}

impl drift_channel_report_t {
    const EMPTY: Self = Self {
        kind: 0,
        index: 0,
        x: f32::NAN,
        value: f32::NAN,
        residual: f32::NAN,
        z: f32::NAN,
        cusum_high: 0.0,
        cusum_low: 0.0,
        ewma_mean: 0.0,
        sprt_high: 0.0,
        sprt_low: 0.0,
        fault_b0: 0.0,
        fault_b1: 0.0,
        fault_shift: 0.0,
        fault_windows: 0,
        verdict: 0,
        side: 0,
        alarm_shewhart: 0,
        alarm_cusum: 0,
        alarm_ewma: 0,
        alarm_sprt: 0,
        extrapolated: 0,
        has_fault_curve: 0,
        moved: 0,
    };

    fn fill<D: ReportedDetectors, F: ReportedCurve>(&mut self, c: &ChannelReport<D, F>) {
        (self.kind, self.index) = (c.kind.number(), c.kind.index().map_or(0, |index| index as u32));
        (self.x, self.value, self.residual, self.z) = (c.x, c.value, c.residual, c.z);
        (self.verdict, self.side) = (c.verdict as u8, side(c.side));
        (self.alarm_shewhart, self.alarm_cusum) = (side(c.alarms.shewhart), side(c.alarms.cusum));
        (self.alarm_ewma, self.alarm_sprt) = (side(c.alarms.ewma), side(c.alarms.sprt));
        self.extrapolated = u8::from(c.extrapolated);
        c.detectors.report(self);
        c.fault_curve.report(self);
    }
}
