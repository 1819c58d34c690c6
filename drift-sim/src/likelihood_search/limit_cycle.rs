//! Whether a loop that cycles by itself does so in its simulation too. Noise leads a cycle's phase astray, so that a simulation of a cycle that is right in
//! everything may miss every sample; its period and its size stay.

use crate::control_loop::Loop;
use crate::diagnose::cycle::{self, AT_REST, LEAST_PERIODS};
use crate::diagnose::prove::quiet_run;
use crate::estimate::signals::{Signals, deviation, held};

/// Factor by which period and size of the simulated cycle may differ from the measured one's.
const NEAR: f64 = 1.35;
/// Part of the measured size below which a loop does not cycle.
const RESTS: f64 = 0.3;
/// Part of a recording over which a simulation finds its cycle.
const SETTLING: f64 = 0.3;
/// Part of its deviation by which a signal must be off its mean to either side between two rises.
const BAND: f64 = 0.5;

/// Whether the recorded cycle is the improved loop's own, and not that of the loop without what was found; false where no loop is closed, r moves, or nothing
/// cycles. Judged by u, which a law makes smoother than y.
pub fn is_made(improved: &Loop, without: &Loop, signals: &Signals) -> bool {
    let is_at_rest = deviation(&signals.r) < AT_REST * deviation(&held(&signals.y));
    if !improved.has_law() || !is_at_rest {
        return false;
    }
    let settled = |u: &[f64]| Cycle::of(u.get((SETTLING * u.len() as f64) as usize..)?);
    let run = |model: &Loop| Some(quiet_run(model, signals)?.u);
    let (Some(measured), Some(made)) = (settled(&signals.u), run(improved).and_then(|u| settled(&u))) else {
        return false;
    };
    let rests = run(without).is_some_and(|u| settled(&u).is_none_or(|own| own.size < RESTS * measured.size));
    rests && measured.is_like(&made)
}

/// A cycle.
struct Cycle {
    /// Mean samples from rise to rise.
    period: f64,
    /// Deviation.
    size: f64,
}

impl Cycle {
    fn of(u: &[f64]) -> Option<Self> {
        let size = deviation(u);
        let rises = cycle::rises(u, BAND * size);
        let (first, last) = (rises.first()?, rises.last()?);
        let count = rises.len() - 1;
        (count >= LEAST_PERIODS).then(|| Self { period: (last - first) as f64 / count as f64, size })
    }

    fn is_like(&self, other: &Self) -> bool {
        let is_near = |a: f64, b: f64| a < NEAR * b && b < NEAR * a;
        is_near(self.period, other.period) && is_near(self.size, other.size)
    }
}
