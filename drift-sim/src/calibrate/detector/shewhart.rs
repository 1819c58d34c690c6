//! Limits on each single residual.

use drift_core::{Detectors, Shewhart};

use super::{Designed, Threshold, Tuning};
use crate::calibrate::caution::Margin;
use crate::calibrate::process::ChannelProcess;
use crate::design::normal;

pub(super) struct Row;

impl Designed for Row {
    fn name(&self) -> &'static str {
        "shewhart"
    }
    fn spoken(&self) -> &'static str {
        "one window alone (Shewhart)"
    }
    fn maxima(&self, _: Tuning, _: Margin, _: &[f64]) -> Option<Vec<f32>> {
        None
    }
    fn place(&self, into: &mut Detectors, _: Tuning, at: Threshold<'_>) {
        if let Threshold::Score(score, law, margin) = at {
            let law = &law.marginal;
            // A limit lies on its own side, however skewed the law.
            let lower = margin.apart(law.at(-score), -score).min(-1e-3);
            let upper = margin.apart(law.at(score), score).max(1e-3);
            into.shewhart = Some(Shewhart { lower: lower as f32, upper: upper as f32 });
        }
    }
    fn delay(&self, of: &Detectors, law: &ChannelProcess) -> Option<f64> {
        let limits = of.shewhart?;
        let law = &law.marginal;
        Some(1.0 / (law.above(f64::from(limits.upper) - 1.0) + law.below(f64::from(limits.lower) - 1.0)))
    }
    fn shows(&self, of: &Detectors, shift: f64, decisions: u64, probability: f64) -> bool {
        of.shewhart.is_some_and(|limits| {
            let limit = f64::from(limits.upper).max(-f64::from(limits.lower));
            1.0 - normal::below(limit - shift).powf(decisions as f64) >= probability
        })
    }
    fn thresholds(&self, of: &Detectors) -> Option<String> {
        of.shewhart.map(|d| format!("below {:.2} or above {:.2}", d.lower, d.upper))
    }
}
