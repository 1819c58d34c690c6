//! A rounded y: in whole multiples of a step, which a coarse sensor has large against what y does between them.

use super::signals::{Signals, held, noise_variance};

/// The kind that rounds y.
pub const ROUNDING: &str = "quantization";

/// Part of the samples that may show a value of their own.
const MOST_VALUES: f64 = 0.25;
/// How far from a whole multiple a difference of two values may lie, as part of the step: rounding in the file.
const OFF: f64 = 0.02;
/// Values, and changes from one to another, below which y tells no step.
const LEAST_VALUES: usize = 2;
const LEAST_CHANGES: usize = 50;
/// Steps that y changes by from sample to sample (the median, where it changes) at most: a finer lattice is that of the file's digits.
const MOST_STEPS: f64 = 10.0;
/// Multiples of the smallest difference up to which differences tell the step.
const FEW_STEPS: f64 = 20.0;

/// The step of y in all of these recordings; `None` where y is not on a lattice or uses it finely.
pub fn step(recordings: &[Signals]) -> Option<f64> {
    let is_fine = |signals: &Signals| {
        values(signals).len() as f64 > MOST_VALUES * signals.y.iter().filter(|y| y.is_finite()).count() as f64
    };
    let step = rounding(recordings)?;
    let changes = changes(recordings);
    let typical = changes.get(changes.len() / 2).copied().unwrap_or(f64::INFINITY);
    let is_coarse = typical < MOST_STEPS * step && changes.len() >= LEAST_CHANGES;
    (is_coarse && !recordings.iter().any(is_fine)).then_some(step)
}

/// What y is rounded to in all of these recordings, by its sensor or in the file; `None` where too few of its values are near to each other to tell.
pub fn rounding(recordings: &[Signals]) -> Option<f64> {
    let mut gaps: Vec<f64> = Vec::new();
    for signals in recordings {
        let values = values(signals);
        if values.len() < LEAST_VALUES {
            return None;
        }
        gaps.extend(values.windows(2).map(|pair| pair[1] - pair[0]));
    }
    let smallest = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    // Rounding in the file shows in the smallest gap; the mean of the gaps as multiples of it does not.
    let whole = |gap: &f64, step: f64| libm::round(gap / step);
    let (mut sum, mut multiples) = (0.0, 0.0);
    for gap in gaps.iter().filter(|gap| **gap < FEW_STEPS * smallest) {
        sum += gap;
        multiples += whole(gap, smallest);
    }
    let step = sum / f64::max(multiples, 1.0);
    let mut off: Vec<f64> = gaps.iter().map(|gap| (gap / step - whole(gap, step)).abs()).collect();
    off.sort_by(f64::total_cmp);
    let median = off.get(off.len() / 2).copied().unwrap_or(1.0);
    (step > 0.0 && median < OFF).then_some(step)
}

/// The values of y, in order.
fn values(signals: &Signals) -> Vec<f64> {
    let mut values: Vec<f64> = signals.y.iter().copied().filter(|y| y.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// Part of a step's square that the variance of the noise has at least where it makes of rounding a noise like its own: with a deviation of half a step, and what rounding adds, a twelfth.
const DITHERS: f64 = 0.25 + 1.0 / 12.0;

/// Whether these steps are larger than the noise across which y is rounded: what rounding adds then depends on how y moves.
pub fn is_coarse(recordings: &[Signals], step: f64) -> bool {
    is_any_below(recordings, DITHERS * step * step)
}

/// The same of steps between which y tells nothing: its noise has less than half of the variance that rounding adds, or y stays where it is at two of three samples. Of eleven such loops
/// (`tests/cases/run 9302 9303`, `.ci/wide 641 642`) a search beside the steps named six wrongly, sensors with hysteresis among them, of 700 and 1 100 nats; of eight others one.
const HIDES: f64 = 1.5 / 12.0;
const STAYS: f64 = 0.65;

/// Whether these steps hide the noise: what y does between them is not to be told.
pub fn hides_noise(recordings: &[Signals], step: f64) -> bool {
    is_any_below(recordings, HIDES * step * step) || stays(recordings) > STAYS
}

/// Whether the noise of one of these recordings has less than this variance.
fn is_any_below(recordings: &[Signals], variance: f64) -> bool {
    recordings.iter().any(|signals| noise_variance(&held(&signals.y)) < variance)
}

/// Whether y is on a lattice and stays where it is at most samples: its innovations are then no noise.
pub fn rests(recordings: &[Signals]) -> bool {
    stays(recordings) > 0.5 && step(recordings).is_some()
}

/// At what part of the samples y stays where it is.
fn stays(recordings: &[Signals]) -> f64 {
    let pairs = || recordings.iter().flat_map(|signals| signals.y.windows(2));
    let same = pairs().filter(|pair| pair[0] == pair[1]).count();
    same as f64 / pairs().count().max(1) as f64
}

/// How much y changes from sample to sample, where it does, in order.
fn changes(recordings: &[Signals]) -> Vec<f64> {
    let pairs = recordings.iter().flat_map(|signals| signals.y.windows(2));
    let mut changes: Vec<f64> =
        pairs.map(|pair| (pair[1] - pair[0]).abs()).filter(|change| *change > 0.0).collect();
    changes.sort_by(f64::total_cmp);
    changes
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::{Signals, hides_noise, is_coarse, rounding, step};
    use crate::estimate::noise::sequence;

    const NOISE: f64 = 0.01;

    /// y that moves by so much in all, with noise, rounded to a step where there is one.
    fn moved(way: f64, to: Option<f64>) -> Vec<Signals> {
        let noise = sequence(5_000, NOISE, 0.0, &mut ChaCha8Rng::seed_from_u64(2));
        let rounded = |y: f64| to.map_or(y, |step| libm::round(y / step) * step);
        let shown = |(n, noise): (usize, f64)| rounded(way * libm::sin(n as f64 / 400.0) + noise);
        let y: Vec<f64> = noise.into_iter().enumerate().map(shown).collect();
        vec![Signals { sample_time_s: 0.1, r: y.clone(), u: y.clone(), y, ..Signals::default() }]
    }

    fn near(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|found| (found / expected - 1.0).abs() < 1e-6)
    }

    /// Over a long way hardly two samples show the same value, and what y is rounded to still tells; a coarse sensor is one whose step is larger than the noise.
    #[test]
    fn rounding_is_told_over_a_long_way_and_a_coarse_sensor_by_its_noise() {
        let (fine, coarse) = (moved(100.0, Some(NOISE)), moved(0.5, Some(10.0 * NOISE)));
        assert!(near(rounding(&fine), NOISE) && step(&fine).is_none() && !is_coarse(&fine, NOISE));
        assert!(near(step(&coarse), 10.0 * NOISE) && hides_noise(&coarse, 10.0 * NOISE));
        let between = moved(0.5, Some(3.0 * NOISE));
        assert!(is_coarse(&between, 3.0 * NOISE) && !hides_noise(&between, 3.0 * NOISE));
        assert_eq!(rounding(&moved(100.0, None)), None);
    }
}
