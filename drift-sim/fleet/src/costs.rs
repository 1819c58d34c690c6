//! What a fault costs: how much more (or less) than its healthy relation a loop pays, as a share of what the healthy loop would pay over
//! the same time, in per cent. One number for each of the monitor's channels: the error (its index), the effort (mean u) and the energy
//! (u^2).
//!
//! Only decisions count in which the channel was away from its baseline (suspect or drift), so that a healthy loop costs nothing; the share is
//! of all decisions that were judged, so that a fault of an hour in a year costs little.

use drift_core::Verdict;
use drift_sim::monitor::Hop;

/// Names of the costs, in the order of the monitor's channels.
pub const NAMES: [&str; 3] = ["error", "effort", "energy"];

/// Sums over decisions, for each channel.
#[derive(Debug, Clone, Copy, Default)]
pub struct Costs {
    extra: [f64; 3],
    healthy: [f64; 3],
}

impl Costs {
    /// One decision.
    pub fn add(&mut self, hop: &Hop) {
        for ((extra, healthy), channel) in
            self.extra.iter_mut().zip(&mut self.healthy).zip(&hop.report.channels)
        {
            let (value, residual) = (f64::from(channel.value), f64::from(channel.residual));
            if channel.z.is_nan() || !value.is_finite() || !residual.is_finite() {
                continue;
            }
            *healthy += (value - residual).abs();
            if matches!(channel.verdict, Verdict::Suspect | Verdict::Drift) {
                *extra += residual;
            }
        }
    }

    /// Per cent for each channel; `None` where nothing was judged.
    pub fn percent(&self) -> [Option<f64>; 3] {
        [0, 1, 2].map(|i: usize| {
            let (extra, healthy) = (self.extra.get(i)?, self.healthy.get(i)?);
            (*healthy > 0.0).then(|| 100.0 * extra / healthy).filter(|x| x.is_finite())
        })
    }
}
