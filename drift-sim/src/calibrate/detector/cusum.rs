//! The two-sided CUSUM.

use drift_core::{Cusum, CusumState, Detector, DetectorState, Detectors};

use super::{Designed, Threshold, Tuning, both_sides};
use crate::calibrate::caution::Margin;
use crate::calibrate::process::ChannelProcess;
use crate::calibrate::run_length::{self, OneSide};
use crate::design::OneSided;

pub(super) struct Row;

impl Designed for Row {
    fn name(&self) -> &'static str {
        "cusum"
    }
    fn spoken(&self) -> &'static str {
        "the running sum (CUSUM)"
    }
    fn maxima(&self, tuning: Tuning, margin: Margin, z: &[f64]) -> Option<Vec<f32>> {
        let chart = Cusum::new(tuning.k as f32, f32::MAX);
        let (mut up, mut down) = (CusumState::ZERO, CusumState::ZERO);
        Some(both_sides(margin, z, |[high, low]| {
            chart.update(&mut up, high);
            chart.update(&mut down, low);
            [up.high, down.low]
        }))
    }
    fn place(&self, into: &mut Detectors, tuning: Tuning, at: Threshold<'_>) {
        if let Threshold::Exceeded(h) = at {
            into.cusum = Some(Cusum::new(tuning.k as f32, h as f32));
        }
    }
    fn delay(&self, of: &Detectors, law: &ChannelProcess) -> Option<f64> {
        let side = of.cusum.map(|c| OneSide { k: f64::from(c.k), h: f64::from(c.h) })?;
        Some(run_length::cusum(side, 1.0, law.long_run_variance, law.marginal.third_cumulant()))
    }
    fn shows(&self, of: &Detectors, shift: f64, decisions: u64, probability: f64) -> bool {
        let chart = of.cusum.and_then(|c| OneSided::new(f64::from(c.k), f64::from(c.h), 0.0).ok());
        chart.is_some_and(|chart| chart.alarms_within(shift, decisions, probability))
    }
    fn thresholds(&self, of: &Detectors) -> Option<String> {
        of.cusum.map(|d| format!("k {} h {:.2}", d.k, d.h))
    }
}
