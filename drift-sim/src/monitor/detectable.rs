//! What a run could have shown: the smallest lasting shift that would have raised an alarm within the decisions so far with a
//! probability of 90 %. A verdict of healthy says no more than that.

use drift_core::Channel;
use serde::Serialize;

use crate::calibrate::detector::{Designed, ROWS};

/// With this probability the shift would have shown.
pub const PROBABILITY: f64 = 0.9;
/// No shift beyond is looked for, sigmas.
const LARGEST: f64 = 100.0;

/// The smallest lasting shift that would have shown.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Detectable {
    /// Of the standardised residual.
    pub sigmas: f64,
    /// Of the value that the channel judges, value units: for the effort channel u.
    pub value: f64,
    /// For the effort channel the shift of y that has the same effect (a sensor's bias), y units; `None` where the effort does
    /// not depend on y.
    pub y: Option<f64>,
}

impl Detectable {
    /// Of a channel that judged so many decisions; `None` if no shift up to 100 sigmas would have shown.
    pub fn of(channel: &Channel, judged: u64) -> Option<Self> {
        let sigmas = smallest(channel, judged)?;
        let residual = sigmas * f64::from(channel.baseline.sigma);
        // What the relation's own memory takes up of a lasting shift does not show.
        let value = residual / f64::from(channel.memory.visible());
        // The effort answers to y of all windows that are remembered.
        let answer =
            f64::from(channel.baseline.b1) + channel.memory.x.iter().map(|x| f64::from(*x)).sum::<f64>();
        let y = (channel.kind.meaning().x_is_y && answer != 0.0).then_some(residual / answer.abs());
        Some(Self { sigmas, value, y })
    }
}

fn smallest(channel: &Channel, judged: u64) -> Option<f64> {
    if judged == 0 || !shows(channel, judged, LARGEST) {
        return None;
    }
    let (mut hidden, mut shown) = (0.0, LARGEST);
    while shown - hidden > 0.005 * shown + 1e-3 {
        let middle = 0.5 * (hidden + shown);
        if shows(channel, judged, middle) { shown = middle } else { hidden = middle }
    }
    Some(shown)
}

/// By any single one of the channel's detectors; together they show no less.
fn shows(channel: &Channel, judged: u64, shift: f64) -> bool {
    let shows = |row: &&dyn Designed| row.shows(&channel.detectors, shift, judged, PROBABILITY);
    // The last is told by a formula.
    ROWS.iter().rev().any(shows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use drift_core::{Baseline, ChannelKind, Cusum, Detector, Detectors};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn channel(detectors: Detectors) -> Channel {
        Channel::new(ChannelKind::Effort, Baseline::known(1.0, 0.5, 0.2), detectors)
    }

    /// Against the detector itself: 4000 runs of so many decisions with the shift that is named.
    #[test]
    fn nine_of_ten_runs_show_the_shift_that_is_named() {
        let cusum = Cusum::new(0.5, 8.0);
        let channel = channel(Detectors { cusum: Some(cusum), ..Detectors::NONE });
        for judged in [12u64, 31, 200] {
            let named = Detectable::of(&channel, judged).unwrap();
            assert!((named.value - 0.2 * named.sigmas).abs() < 1e-6);
            assert!((named.y.unwrap() - named.value / 0.5).abs() < 1e-6);
            let mut rng = ChaCha8Rng::seed_from_u64(judged);
            let runs = 4000;
            let shown = (0..runs).filter(|_| {
                let mut state = cusum.start();
                (0..judged).any(|_| {
                    let z: f64 = StandardNormal.sample(&mut rng);
                    cusum.update(&mut state, (z + named.sigmas) as f32).is_some()
                })
            });
            let share = shown.count() as f64 / f64::from(runs);
            assert!((share - 0.9).abs() < 0.02, "{judged} decisions, {} sigmas: {share}", named.sigmas);
        }
    }

    #[test]
    fn nothing_shows_without_a_detector_or_a_decision() {
        assert_eq!(Detectable::of(&channel(Detectors::NONE), 100), None);
        let cusum = Detectors { cusum: Some(Cusum::new(0.5, 8.0)), ..Detectors::NONE };
        assert_eq!(Detectable::of(&channel(cusum), 0), None);
    }
}
