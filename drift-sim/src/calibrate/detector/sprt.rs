//! The repeated sequential probability ratio test of a shifted mean.

use drift_core::{Detector, DetectorState, Detectors, Sprt, SprtState};

use super::{Designed, Threshold, Tuning, both_sides};
use crate::calibrate::caution::Margin;
use crate::calibrate::process::ChannelProcess;
use crate::calibrate::run_length::{self, OneSide};
use crate::design::OneSided;

/// Log odds at which it restarts: 1 to 100.
pub(in crate::calibrate) const LOWER: f64 = -4.605_170_185_988_091;

pub(super) struct Row;

fn test(tuning: Tuning, upper: f32) -> Sprt {
    Sprt::mean(2.0 * tuning.k as f32, LOWER as f32, upper)
}

/// A mean SPRT's log-likelihood is its alternative times a CUSUM's sum.
fn as_cusum(of: &Detectors) -> Option<OneSide> {
    let test = of.sprt.filter(|s| s.linear > 0.0)?;
    Some(OneSide { k: 0.5 * f64::from(test.linear), h: f64::from(test.upper) / f64::from(test.linear) })
}

impl Designed for Row {
    fn name(&self) -> &'static str {
        "sprt"
    }
    fn spoken(&self) -> &'static str {
        "the repeated test (SPRT)"
    }
    fn maxima(&self, tuning: Tuning, margin: Margin, z: &[f64]) -> Option<Vec<f32>> {
        let test = test(tuning, f32::MAX);
        let (mut up, mut down) = (SprtState::ZERO, SprtState::ZERO);
        let (mut high, mut low, mut maxima) = (0.0f32, 0.0f32, Vec::new());
        // It restarts at the lower boundary, not where its ratio crosses zero.
        let mut visit = |now: f32, most: &mut f32| {
            *most = most.max(now);
            if now == 0.0 && *most > 0.0 {
                maxima.push(*most);
                *most = 0.0;
            }
        };
        both_sides(margin, z, |[at_high, at_low]| {
            test.update(&mut up, at_high);
            test.update(&mut down, at_low);
            visit(up.high, &mut high);
            visit(down.low, &mut low);
            [0.0; 2]
        });
        Some(maxima)
    }
    fn place(&self, into: &mut Detectors, tuning: Tuning, at: Threshold<'_>) {
        if let Threshold::Exceeded(upper) = at {
            into.sprt = Some(test(tuning, upper as f32));
        }
    }
    fn delay(&self, of: &Detectors, law: &ChannelProcess) -> Option<f64> {
        let side = as_cusum(of)?;
        Some(run_length::cusum(side, 1.0, law.long_run_variance, law.marginal.third_cumulant()))
    }
    fn shows(&self, of: &Detectors, shift: f64, decisions: u64, probability: f64) -> bool {
        let chart = as_cusum(of).and_then(|OneSide { k, h }| OneSided::new(k, h, 0.0).ok());
        chart.is_some_and(|chart| chart.alarms_within(shift, decisions, probability))
    }
    fn thresholds(&self, of: &Detectors) -> Option<String> {
        of.sprt.map(|d| format!("upper {:.2} lower {:.2}", d.upper, d.lower))
    }
}
