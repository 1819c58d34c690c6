//! Residual channels: each compares one index with what the healthy loop shows at the same operating point
//! (equations 5 to 7), with its own baseline and detectors.

mod kind;

pub use kind::{ChannelKind, ChannelMeaning, ChannelRow};

use crate::detector::{Alarms, DetectorStates, Detectors};
use crate::line_fit::Line;
use crate::math;
use crate::memory::Memory;
use crate::operating_point::OperatingPoint;
use crate::store::Fingerprint;

/// The healthy relation `value = b0 + b1*x` and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Baseline {
    /// Intercept (equation 5), value units.
    pub b0: f32,
    /// Slope (equation 5), value units per x unit.
    pub b1: f32,
    /// Standard deviation of a healthy residual, value units; 0 means not learnt: the channel is only reported.
    pub sigma: f32,
    /// Independent windows that it was learnt from; 0 takes it as exactly known.
    pub windows: f32,
    /// Mean x of those windows, x units.
    pub x_mean: f32,
    /// Their sum of squared deviations of x, x units squared; 0 takes the slope as exactly known.
    pub x_ss: f32,
    /// Smallest x seen; a window outside x_min..=x_max is flagged as extrapolated.
    pub x_min: f32,
    /// Largest x seen, x units.
    pub x_max: f32,
}

impl Baseline {
    /// Not learnt yet: indices and coordinates are reported, nothing is judged.
    pub const UNLEARNED: Self = Self {
        b0: 0.0,
        b1: 0.0,
        sigma: 0.0,
        windows: 0.0,
        x_mean: 0.0,
        x_ss: 0.0,
        x_min: f32::MIN,
        x_max: f32::MAX,
    };

    /// A relation taken as exactly known.
    pub const fn known(b0: f32, b1: f32, sigma: f32) -> Self {
        Self { b0, b1, sigma, ..Self::UNLEARNED }
    }

    /// Equation 7: the window's value minus the healthy one.
    pub fn residual(&self, x: f32, value: f32) -> f32 {
        value - (self.b0 + self.b1 * x)
    }

    /// The residual in units of its own standard deviation, with the uncertainty of the baseline at this x
    /// (prediction variance `sigma^2 (1 + 1/n + (x - mean)^2/Sxx)`). One square root and two divisions.
    pub fn standardise(&self, x: f32, residual: f32) -> f32 {
        self.standardise_with(x, residual, 0.0)
    }

    /// The same where something else besides x adds `more` to the prediction variance, in units of sigma squared.
    #[inline]
    pub fn standardise_with(&self, x: f32, residual: f32, more: f32) -> f32 {
        let from_mean = x - self.x_mean;
        let mut inflation = 1.0 + more;
        if self.windows > 0.0 {
            inflation += 1.0 / self.windows;
        }
        if self.x_ss > 0.0 {
            inflation += from_mean * (from_mean / self.x_ss);
        }
        residual / (self.sigma * math::sqrt(inflation))
    }

    pub(crate) fn learned(&self) -> bool {
        self.sigma > 0.0
    }

    pub(crate) const fn valid(&self) -> bool {
        self.b0.is_finite()
            && self.b1.is_finite()
            && self.sigma.is_finite()
            && self.windows.is_finite()
            && self.x_mean.is_finite()
            && self.x_ss.is_finite()
            && self.x_min.is_finite()
            && self.x_max.is_finite()
            && self.sigma >= 0.0
            && self.windows >= 0.0
            && self.x_ss >= 0.0
            && self.x_min <= self.x_max
    }

    const fn words(&self) -> [f32; 8] {
        [self.b0, self.b1, self.sigma, self.windows, self.x_mean, self.x_ss, self.x_min, self.x_max]
    }
}

/// One residual channel's configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Channel {
    /// Which index is compared with which.
    pub kind: ChannelKind,
    /// The healthy relation; [`Channel::unlearned`] leaves it open.
    pub baseline: Baseline,
    /// What the windows before add to it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub memory: Memory,
    /// What a measured operating point adds to it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub operating_point: OperatingPoint,
    /// What watches its residual.
    pub detectors: Detectors,
}

impl Channel {
    /// A channel with a known relation of this window alone.
    pub const fn new(kind: ChannelKind, baseline: Baseline, detectors: Detectors) -> Self {
        Self { kind, baseline, memory: Memory::NONE, operating_point: OperatingPoint::NONE, detectors }
    }

    /// A channel that is only reported until its baseline is known.
    pub const fn unlearned(kind: ChannelKind) -> Self {
        Self::new(kind, Baseline::UNLEARNED, Detectors::NONE)
    }

    pub(crate) fn fingerprint(&self, to: &mut Fingerprint<'_>) {
        to.u32(self.kind.tag());
        self.baseline.words().into_iter().for_each(|w| to.f32(w));
        self.memory.fingerprint(to);
        self.operating_point.fingerprint(to);
        self.detectors.fingerprint(to);
    }
}

/// How a curve moved after a confirmed drift, judged at three standard errors. While x has not varied enough to
/// tell a tilt, a curve that is away from the baseline at the windows seen counts as lifted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
// A word wide: padding beside it would be copied by a routine of its own.
#[repr(u32)]
pub enum Moved {
    /// Neither, at three standard errors: too few windows yet, or a change of scatter only.
    // From 1: an absent curve is then a byte of zero, and a state without one is cleared, not filled.
    Undecided = 1,
    /// b0 alone: the curve was lifted or lowered.
    Intercept,
    /// b1 alone: it was tilted about x = 0.
    Slope,
    /// b0 and b1: it was lifted and tilted.
    Both,
}

impl Moved {
    /// `shift`: mean distance from the baseline at the windows seen; `tilt`: change of slope.
    #[inline(always)]
    fn judge(fit: &Line, windows: u32, baseline: &Baseline, shift: f32, tilt: f32) -> Self {
        let variance = baseline.sigma * baseline.sigma;
        // Nine times the variance on the right of each comparison: three standard errors without a square root.
        let mut shift_variance = variance / windows as f32;
        if baseline.windows > 0.0 {
            shift_variance += variance / baseline.windows;
        }
        let mut tilt_variance =
            if math::exceeds(fit.x_ss(), 0.0) { variance / fit.x_ss() } else { f32::INFINITY };
        if baseline.x_ss > 0.0 {
            tilt_variance += variance / baseline.x_ss;
        }
        let tilted = windows > 2 && math::exceeds(tilt * tilt, 9.0 * tilt_variance);
        if !tilted {
            let lifted = math::exceeds(shift * shift, 9.0 * shift_variance);
            return if lifted { Self::Intercept } else { Self::Undecided };
        }
        let x = fit.x_mean();
        let lift = shift - tilt * x;
        let lift_variance = shift_variance + tilt_variance * (x * x);
        if math::exceeds(lift * lift, 9.0 * lift_variance) { Self::Both } else { Self::Slope }
    }
}

/// The curve refitted on the windows since the alarm: f_fault of equations 8 and 9.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FaultCurve {
    /// Intercept, value units.
    pub b0: f32,
    /// Slope, value units per x unit.
    pub b1: f32,
    /// Mean distance from the baseline at the windows seen, value units.
    pub shift: f32,
    /// Windows that it was fitted on.
    pub windows: u32,
    /// How it differs from the baseline.
    pub moved: Moved,
}

impl FaultCurve {
    #[inline(always)]
    pub(crate) fn of(fit: &Line, windows: u32, baseline: &Baseline) -> Self {
        let windows = windows.max(1);
        let shift = baseline.residual(fit.x_mean(), fit.value_mean());
        let b1 = fit.b1(windows);
        let b0 = fit.value_mean() - b1 * fit.x_mean();
        let moved = Moved::judge(fit, windows, baseline, shift, b1 - baseline.b1);
        Self { b0, b1, shift, windows, moved }
    }
}

/// One channel at one decision. `D`: what the detectors hold ([`DetectorStates`], or nothing); `F`: the refitted curve
/// (or nothing), both as the monitor's options have it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ChannelReport<D = DetectorStates, F = Option<FaultCurve>> {
    /// Which index is compared with which.
    pub kind: ChannelKind,
    /// The window's place on the baseline's axis, x units: E_u, mean y, the speed, or the reference's activity,
    /// by `kind`.
    pub x: f32,
    /// The index that is judged, value units: J_e, mean u, the effort along the motion, or E_u, by `kind`.
    pub value: f32,
    /// Its distance from the baseline, value units; NaN where nothing could be judged.
    pub residual: f32,
    /// The same in standard deviations; NaN where nothing could be judged.
    pub z: f32,
    /// x lies outside what calibration saw: the baseline is extrapolated.
    pub extrapolated: bool,
    /// What the detectors hold after this decision.
    pub detectors: D,
    /// Which of them alarmed.
    pub alarms: Alarms,
    /// What the channel's course amounts to.
    pub verdict: crate::course::Verdict,
    /// To which side it moved, while it is away from the baseline.
    pub side: Option<crate::detector::Side>,
    /// The refitted curve, once a drift is confirmed.
    pub fault_curve: F,
}
