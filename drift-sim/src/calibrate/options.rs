//! What is asked of a calibration, and whether it can be had.

use std::ops::RangeInclusive;

use drift_core::{ChannelKind, Decision, Detectors, Index, Memory};

use super::{DetectorChoice, operating_point};
use crate::sentences::typed;
use crate::{Error, Result};

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Window, s; chosen from the data if there is none.
    pub window_s: Option<f64>,
    /// From one decision to the next, s; the window if there is none.
    pub hop_s: Option<f64>,
    /// The error index of the energy_error channel.
    pub index: Index,
    /// Wanted mean time between false alarms of the whole monitor, hours.
    pub false_alarm_every_h: f64,
    /// Share of calibrations from as many windows that is aimed to keep it; 0.5 to 0.99. Measured for 0.9 in
    /// the module's table.
    pub confidence: f64,
    /// Judged: energy_error, effort, activity.
    pub channels: [bool; 3],
    /// Effort to hold y, or along the motion.
    pub effort: ChannelKind,
    /// Windows that the effort channel remembers, 0 to 3; the number that sees a lasting shift soonest if there is none. The motion's effort
    /// remembers none.
    pub effort_memory: Option<u8>,
    /// Measured columns that the effort depends on besides y, up to three.
    pub operating_point: Vec<String>,
    /// What watches each channel.
    pub detectors: DetectorChoice,
    /// The CUSUM's reference value, half the shift to be found, sigmas; the SPRT's alternative is twice it.
    pub k: f64,
    /// The EWMA's weight of the newest residual; 0.1 is for shifts of about one sigma (Lucas & Saccucci 1990).
    pub lambda: f64,
    /// Limits of u: `[lower, upper]`.
    pub saturation: Option<[f64; 2]>,
    /// A step of r beyond the first number blanks the second, s.
    pub blanking: Option<(f64, f64)>,
    /// Decisions before a drift is confirmed.
    pub confirm_hops: u16,
    /// Decisions that are simulated; the thresholds' own scatter goes with its root.
    pub simulated_decisions: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            window_s: None,
            hop_s: None,
            index: Index::Iae,
            false_alarm_every_h: 24.0,
            confidence: 0.9,
            channels: [true; 3],
            effort: ChannelKind::Effort,
            effort_memory: None,
            operating_point: Vec::new(),
            detectors: DetectorChoice::default(),
            k: 0.5,
            lambda: 0.1,
            saturation: None,
            blanking: None,
            confirm_hops: Decision::DEFAULT.confirm_hops,
            simulated_decisions: 2_000_000,
        }
    }
}

impl Options {
    /// What [`Self::confidence`] may be.
    pub const CONFIDENCE: RangeInclusive<f64> = 0.5..=0.99;
    /// What [`Self::k`] may be, sigmas.
    pub const K: RangeInclusive<f64> = 0.1..=2.0;
    /// What [`Self::lambda`] may be.
    pub const LAMBDA: RangeInclusive<f64> = 0.02..=1.0;

    /// Whether it can be asked for, whatever the recordings.
    ///
    /// # Errors
    /// The first number that is out of its range, or nothing that is judged.
    pub fn check(&self) -> Result<()> {
        let hours = self.false_alarm_every_h;
        if !(hours > 0.0 && hours.is_finite()) {
            let what = format!("a false alarm every {} h", typed(hours));
            return Err(Error::new(what).allowed("a number of hours above 0"));
        }
        if !Self::CONFIDENCE.contains(&self.confidence) {
            return Err(
                Error::new(format!("confidence is {}", typed(self.confidence))).allowed("0.5 to 0.99")
            );
        }
        if !Self::K.contains(&self.k) {
            return Err(Error::new(format!("k is {}", typed(self.k))).allowed("0.1 to 2 sigmas"));
        }
        if !Self::LAMBDA.contains(&self.lambda) {
            return Err(Error::new(format!("lambda is {}", typed(self.lambda))).allowed("0.02 to 1"));
        }
        if let Some(order) = self.effort_memory.filter(|&order| usize::from(order) > Memory::MOST) {
            return Err(Error::new(format!("a memory of {order} windows")).allowed("0 to 3"));
        }
        if self.detectors.count() == 0 {
            return Err(Error::new("no detector").allowed(Detectors::NAMES.join(", ")));
        }
        if !self.channels.contains(&true) {
            return Err(Error::new("no channel").allowed("energy_error, effort, activity, or several"));
        }
        operating_point::check(&self.operating_point, self.channels[1])
    }
}
