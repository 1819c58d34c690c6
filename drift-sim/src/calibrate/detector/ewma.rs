//! The exponentially weighted average.
//!
//! Between two changes of its sign the average makes an excursion. Far out the maxima's squares have an exponential tail, as a
//! Gaussian process has, so the threshold is looked for among the squares.

use drift_core::{Detector, DetectorState, Detectors, Ewma, EwmaState};

use super::{Designed, Threshold, Tuning, both_sides};
use crate::calibrate::caution::Margin;
use crate::calibrate::process::ChannelProcess;
use crate::design;

pub(super) struct Row;

impl Designed for Row {
    fn name(&self) -> &'static str {
        "ewma"
    }
    fn spoken(&self) -> &'static str {
        "the moving average (EWMA)"
    }
    fn maxima(&self, tuning: Tuning, margin: Margin, z: &[f64]) -> Option<Vec<f32>> {
        let chart = Ewma::new(tuning.lambda as f32, f32::MAX);
        let (mut up, mut down) = (EwmaState::ZERO, EwmaState::ZERO);
        let square = |mean: f32| if mean > 0.0 { mean * mean } else { 0.0 };
        Some(both_sides(margin, z, |[high, low]| {
            chart.update(&mut up, high);
            chart.update(&mut down, low);
            [square(up.mean), square(-down.mean)]
        }))
    }
    fn place(&self, into: &mut Detectors, tuning: Tuning, at: Threshold<'_>) {
        if let Threshold::Exceeded(square) = at {
            into.ewma = Some(Ewma::new(tuning.lambda as f32, square.sqrt() as f32));
        }
    }
    /// Of independent residuals with the process's long-run variance, to which an average over many windows comes close.
    fn delay(&self, of: &Detectors, law: &ChannelProcess) -> Option<f64> {
        let sigma = law.long_run_variance.sqrt();
        let chart = of.ewma.map(|e| design::Ewma::new(f64::from(e.lambda), f64::from(e.limit) / sigma))?;
        Some(chart.map_or(f64::NAN, |chart| chart.arl(1.0 / sigma)))
    }
    fn shows(&self, of: &Detectors, shift: f64, decisions: u64, probability: f64) -> bool {
        let chart = of.ewma.and_then(|e| design::Ewma::new(f64::from(e.lambda), f64::from(e.limit)).ok());
        chart.is_some_and(|chart| chart.alarm_within(shift, decisions) >= probability)
    }
    fn thresholds(&self, of: &Detectors) -> Option<String> {
        of.ewma.map(|d| format!("lambda {} limit {:.3}", d.lambda, d.limit))
    }
}
