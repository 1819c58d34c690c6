//! The report as C sees it.

use drift_core::{ChannelKind, ChannelReport, Report, Side};

use crate::codes::{
    self, drift_index_t, drift_kind_t, drift_location_t, drift_moved_t, drift_side_t, drift_verdict_t,
};

/// Bytes of a report.
pub const DRIFT_REPORT_BYTES: usize = 264;
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
    /// Ticks left out since the last decision: no sample.
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
    pub channels: [drift_channel_report_t; 3],
}

fn side(side: Option<Side>) -> drift_side_t {
    match side {
        None => codes::DRIFT_SIDE_NONE,
        Some(Side::High) => codes::DRIFT_SIDE_HIGH,
        Some(Side::Low) => codes::DRIFT_SIDE_LOW,
    }
}

impl drift_report_t {
    pub(crate) fn of<const C: usize>(report: &Report<C>) -> Self {
        let (i, x) = (&report.indices, &report.excluded);
        let mut channels = [drift_channel_report_t::EMPTY; 3];
        for (to, from) in channels.iter_mut().zip(&report.channels) {
            *to = drift_channel_report_t::of(from);
        }
        Self {
            hop: report.hop,
            valid: u8::from(report.status == drift_core::WindowStatus::Valid),
            verdict: report.verdict as u8,
            location: report.location as u8,
            channel_count: C as u8,
            e_u: i.e_u,
            iae: i.iae,
            ise: i.ise,
            itae: i.itae,
            itse: i.itse,
            mean_u: i.mean_u,
            mean_y: i.mean_y,
            mean_e: i.mean_e,
            peak_u: i.peak_u,
            peak_e: i.peak_e,
            reference_activity: i.reference_activity,
            motion_effort: i.motion_effort,
            speed: i.speed,
            missing: x.missing,
            non_finite: x.non_finite,
            out_of_range: x.out_of_range,
            saturated: x.saturated,
            manual: x.manual,
            blanked: x.blanked,
            channels,
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
        alarm_sprt: 0,
        extrapolated: 0,
        has_fault_curve: 0,
        moved: 0,
    };

    fn of(c: &ChannelReport) -> Self {
        let (kind, index) = match c.kind {
            ChannelKind::EnergyError(index) => (codes::DRIFT_ENERGY_ERROR, index as u32),
            ChannelKind::Effort => (codes::DRIFT_EFFORT, 0),
            ChannelKind::MotionEffort => (codes::DRIFT_MOTION_EFFORT, 0),
            ChannelKind::Activity => (codes::DRIFT_ACTIVITY, 0),
        };
        let mut out = Self {
            kind,
            index,
            x: c.x,
            value: c.value,
            residual: c.residual,
            z: c.z,
            cusum_high: c.detectors.cusum.high,
            cusum_low: c.detectors.cusum.low,
            sprt_high: c.detectors.sprt.high,
            sprt_low: c.detectors.sprt.low,
            verdict: c.verdict as u8,
            side: side(c.side),
            alarm_shewhart: side(c.alarms.shewhart),
            alarm_cusum: side(c.alarms.cusum),
            alarm_sprt: side(c.alarms.sprt),
            extrapolated: u8::from(c.extrapolated),
            ..Self::EMPTY
        };
        if let Some(curve) = &c.fault_curve {
            out.has_fault_curve = 1;
            out.moved = curve.moved as u8;
            (out.fault_b0, out.fault_b1, out.fault_shift) = (curve.b0, curve.b1, curve.shift);
            out.fault_windows = curve.windows;
        }
        out
    }
}
