//! CUSUM charts over series of standardised residuals that are already there: their time between false alarms, and
//! the threshold for a wanted one. The detector is [`drift_core::Cusum`].

use drift_core::{Baseline, Cusum, Detector};

use super::settings::CUSUM_K;

/// Standardised residuals of one channel.
pub(super) fn standardised(baseline: &Baseline, points: &[(f64, f64)]) -> Vec<f32> {
    let z = |(x, value): &(f64, f64)| {
        let (x, value) = (*x as f32, *value as f32);
        baseline.standardise(x, baseline.residual(x, value))
    };
    points.iter().map(z).collect()
}

/// Several charts side by side, one a channel; the first alarm of any restarts all.
pub(super) struct Charts {
    charts: Vec<(Cusum, drift_core::CusumState)>,
}

impl Charts {
    pub fn new(thresholds: &[f64]) -> Self {
        let chart = |h: &f64| {
            let cusum = Cusum::new(CUSUM_K as f32, *h as f32);
            (cusum, cusum.start())
        };
        Self { charts: thresholds.iter().map(chart).collect() }
    }

    /// One decision: one residual a channel.
    pub fn update(&mut self, z: impl Iterator<Item = f32>) -> bool {
        let mut alarm = false;
        for ((cusum, state), z) in self.charts.iter_mut().zip(z) {
            alarm |= cusum.update(state, z).is_some();
        }
        if alarm {
            for (cusum, state) in &mut self.charts {
                *state = cusum.start();
            }
        }
        alarm
    }
}

/// Run lengths in decisions between the alarms of charts over series of equal length, one a channel.
pub(super) fn run_lengths(thresholds: &[f64], series: &[&[f32]]) -> Vec<f64> {
    let mut charts = Charts::new(thresholds);
    let decisions = series.iter().map(|s| s.len()).min().unwrap_or(0);
    let (mut lengths, mut since) = (Vec::new(), 0u64);
    for i in 0..decisions {
        since += 1;
        if charts.update(series.iter().filter_map(|s| s.get(i).copied())) {
            lengths.push(since as f64);
            since = 0;
        }
    }
    lengths
}

/// Mean decisions between alarms: all decisions over all alarms.
pub(super) fn mean_run_length(thresholds: &[f64], series: &[&[f32]]) -> f64 {
    let decisions = series.iter().map(|s| s.len()).min().unwrap_or(0);
    decisions as f64 / run_lengths(thresholds, series).len() as f64
}

/// The least threshold, to 0.1 %, at which one chart's mean run length is at least `wanted` decisions.
pub(super) fn threshold(wanted: f64, series: &[f32]) -> f64 {
    let (mut low, mut high) = (0.1, 1.0);
    while mean_run_length(&[high], &[series]) < wanted && high < 1e4 {
        (low, high) = (high, 2.0 * high);
    }
    while high / low > 1.001 {
        let middle = (low * high).sqrt();
        if mean_run_length(&[middle], &[series]) < wanted { low = middle } else { high = middle }
    }
    high
}

/// Thresholds for several channels at once: each channel's own mean run length is the same, and that of all together
/// is `wanted` decisions.
pub(super) fn joint_thresholds(wanted: f64, series: &[&[f32]]) -> Vec<f64> {
    let each = |own: f64| -> Vec<f64> { series.iter().map(|s| threshold(own, s)).collect() };
    // Between one chart's share if they never alarm alone, and if they never alarm together.
    let (mut low, mut high) = (wanted, wanted * series.len() as f64);
    while high / low > 1.01 {
        let middle = (low * high).sqrt();
        if mean_run_length(&each(middle), series) < wanted { low = middle } else { high = middle }
    }
    each(high)
}
