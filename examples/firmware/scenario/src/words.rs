//! A report as 32-bit words: what is compared between host and target, bit for bit.

use drift_core::{
    Alarms, ChannelReport, DetectorStates, Excluded, FaultCurve, Indices, PairIndices, Report, Side,
    TotalExcluded,
};

/// A part of a report.
pub trait Words {
    /// Every number of it, in order.
    fn words(&self, each: &mut impl FnMut(u32));
}

fn side(side: Option<Side>) -> u32 {
    match side {
        None => 0,
        Some(Side::High) => 1,
        Some(Side::Low) => 2,
    }
}

fn alarms(alarms: &Alarms) -> u32 {
    alarms.each().fold(0, |word, (_, alarm)| word << 2 | side(alarm))
}

/// The sign and payload of a NaN are no result: any NaN is the same word.
fn bits(x: f32) -> u32 {
    if x.is_nan() { 0x7fc0_0000 } else { x.to_bits() }
}

impl Words for Indices {
    fn words(&self, each: &mut impl FnMut(u32)) {
        let i = self;
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
        .into_iter()
        .for_each(|x| each(bits(x)));
    }
}

impl Words for PairIndices {
    fn words(&self, each: &mut impl FnMut(u32)) {
        each(bits(self.e_u));
        each(bits(self.error));
    }
}

impl Words for Excluded {
    fn words(&self, each: &mut impl FnMut(u32)) {
        [self.missing, self.non_finite, self.out_of_range, self.saturated, self.manual, self.blanked]
            .into_iter()
            .for_each(|n| each(u32::from(n)));
    }
}

impl Words for TotalExcluded {
    fn words(&self, each: &mut impl FnMut(u32)) {
        each(u32::from(self.ticks));
    }
}

impl Words for () {
    fn words(&self, _: &mut impl FnMut(u32)) {}
}

impl Words for DetectorStates {
    fn words(&self, each: &mut impl FnMut(u32)) {
        [self.cusum.high, self.cusum.low, self.ewma.mean, self.sprt.high, self.sprt.low]
            .into_iter()
            .for_each(|x| each(bits(x)));
    }
}

impl Words for Option<FaultCurve> {
    fn words(&self, each: &mut impl FnMut(u32)) {
        if let Some(curve) = self {
            [curve.b0, curve.b1, curve.shift].into_iter().for_each(|x| each(bits(x)));
            each(curve.windows);
            each(curve.moved as u32);
        }
    }
}

impl<D: Words, F: Words> Words for ChannelReport<D, F> {
    fn words(&self, each: &mut impl FnMut(u32)) {
        [self.x, self.value, self.residual, self.z].into_iter().for_each(|x| each(bits(x)));
        self.detectors.words(each);
        each(
            u32::from(self.extrapolated)
                | (self.verdict as u32) << 8
                | side(self.side) << 16
                | alarms(&self.alarms) << 20,
        );
        self.fault_curve.words(each);
    }
}

impl<const C: usize, I: Words, X: Words, D: Words, F: Words> Words for Report<C, I, X, ChannelReport<D, F>> {
    fn words(&self, each: &mut impl FnMut(u32)) {
        each(self.hop);
        each(self.status as u32 | (self.verdict as u32) << 8 | (self.location() as u32) << 16);
        self.indices.words(each);
        self.excluded.words(each);
        self.channels.iter().for_each(|c| c.words(each));
    }
}
