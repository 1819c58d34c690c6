//! A report as 32-bit words: what is compared between host and target, bit for bit.

use drift_core::{Alarms, ChannelReport, Indices, Report, Side};

fn side(side: Option<Side>) -> u32 {
    match side {
        None => 0,
        Some(Side::High) => 1,
        Some(Side::Low) => 2,
    }
}

fn alarms(alarms: Alarms) -> u32 {
    side(alarms.shewhart) | side(alarms.cusum) << 2 | side(alarms.sprt) << 4
}

fn indices(i: &Indices) -> [f32; 13] {
    [
        i.e_u,
        i.iae,
        i.ise,
        i.itae,
        i.itse,
        i.mean_u,
        i.mean_y,
        i.mean_e,
        i.peak_u,
        i.peak_e,
        i.reference_activity,
        i.motion_effort,
        i.speed,
    ]
}

/// The sign and payload of a NaN are no result: any NaN is the same word.
fn bits(x: f32) -> u32 {
    if x.is_nan() { 0x7fc0_0000 } else { x.to_bits() }
}

/// Every field of a report, in order.
pub fn of<const C: usize>(report: &Report<C>, mut each: impl FnMut(u32)) {
    each(report.hop);
    each(report.status as u32 | (report.verdict as u32) << 8 | (report.location as u32) << 16);
    indices(&report.indices).into_iter().for_each(|x| each(bits(x)));
    let x = &report.excluded;
    each(u32::from(x.missing) | u32::from(x.non_finite) << 16);
    each(u32::from(x.out_of_range) | u32::from(x.saturated) << 16);
    each(u32::from(x.manual) | u32::from(x.blanked) << 16);
    report.channels.iter().for_each(|c| channel(c, &mut each));
}

fn channel(c: &ChannelReport, each: &mut impl FnMut(u32)) {
    [c.x, c.value, c.residual, c.z].into_iter().for_each(|x| each(bits(x)));
    let d = &c.detectors;
    [d.cusum.high, d.cusum.low, d.sprt.high, d.sprt.low].into_iter().for_each(|x| each(bits(x)));
    each(
        u32::from(c.extrapolated)
            | (c.verdict as u32) << 8
            | side(c.side) << 16
            | alarms(c.alarms) << 20
            | u32::from(c.fault_curve.is_some()) << 30,
    );
    if let Some(curve) = &c.fault_curve {
        [curve.b0, curve.b1, curve.shift].into_iter().for_each(|x| each(bits(x)));
        each(curve.windows);
        each(curve.moved as u32);
    }
}
