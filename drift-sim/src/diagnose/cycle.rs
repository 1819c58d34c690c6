//! Whether a loop cycles by itself: with the reference at rest y swings on and on, as large as before. Stiction, play and a gain that is
//! too high do that. Of such a loop a simulation from the beginning tells little: a period that is wrong by a hundredth is out of phase after
//! fifty. What it does over one period tells.

use crate::estimate::signals::{Signals, deviation, noise_variance};

/// The least swing, as a part of y's deviation over the recording.
const LEAST_SWING: f64 = 0.3;
/// The same, in standard deviations of the noise.
const OF_NOISE: f64 = 10.0;
/// Between the halves of the swing, and between the longest and the shortest period, a cycle changes by less than this factor.
const STEADY: f64 = 1.5;
/// Periods that make a cycle.
pub const LEAST_PERIODS: usize = 3;
/// Part of y's deviation by which r may move and rest.
pub const AT_REST: f64 = 0.01;

/// The period of the loop's own cycle in samples; `None` where it has none.
pub fn period(signals: &Signals) -> Option<usize> {
    let all = deviation(&signals.y);
    let (from, to) = longest_rest(&signals.r, AT_REST * all);
    // Without what the step of the reference made first; what fades later shows in the halves.
    let swing = signals.y.get(from + (to - from) / 5..to)?;
    let (early, late) = swing.split_at(swing.len() / 2);
    let (size, ratio) = (deviation(swing), deviation(early) / deviation(late).max(1e-300));
    let noise = libm::sqrt(noise_variance(swing));
    let lasts = ratio < STEADY && ratio > 1.0 / STEADY;
    if !(swing.iter().all(|y| y.is_finite()) && size > LEAST_SWING * all && size > OF_NOISE * noise && lasts)
    {
        return None;
    }
    let rises = rises(swing, 0.5 * size);
    let periods: Vec<usize> = rises.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (shortest, longest) = (*periods.iter().min()?, *periods.iter().max()?);
    let regular = periods.len() >= LEAST_PERIODS && (longest as f64) < STEADY * shortest as f64;
    regular.then(|| periods.iter().sum::<usize>() / periods.len())
}

/// From where to where r stays within `least` of where it was for longest.
fn longest_rest(r: &[f64], least: f64) -> (usize, usize) {
    let (mut best, mut from) = ((0, 0), 0);
    for (n, value) in r.iter().enumerate() {
        if r.get(from).is_some_and(|first| (value - first).abs() > least) {
            from = n;
        }
        if n + 1 - from > best.1 - best.0 {
            best = (from, n + 1);
        }
    }
    best
}

/// Where y rises through its mean, having been below it by the band.
pub fn rises(y: &[f64], band: f64) -> Vec<usize> {
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    let mut below = false;
    let mut found = Vec::new();
    for (n, y) in y.iter().enumerate() {
        if *y < mean - band {
            below = true;
        } else if below && *y > mean + band {
            found.push(n);
            below = false;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals(y: impl Fn(f64) -> f64) -> Signals {
        let y: Vec<f64> = (0..2000).map(|n| y(n as f64)).collect();
        // A step of the reference, then rest.
        let r = (0..2000).map(|n| if n < 300 { 0.0 } else { 1.0 }).collect();
        let u = y.clone();
        Signals { sample_time_s: 0.1, start_s: 0.0, origin_s: 0.0, r, y, u, inputs: Vec::new() }
    }

    #[test]
    fn a_swing_that_lasts_is_a_cycle_and_one_that_fades_is_none() {
        let swing = |n: f64| libm::sin(core::f64::consts::TAU * n / 57.0);
        let period = period(&signals(swing)).unwrap();
        assert!(period.abs_diff(57) <= 1, "{period}");
        assert!(super::period(&signals(|n| swing(n) * libm::exp(-n / 400.0))).is_none());
        assert!(super::period(&signals(|n| if n < 300.0 { 0.0 } else { 1.0 })).is_none());
        // Small beside the step.
        assert!(super::period(&signals(|n| if n < 1000.0 { 0.0 } else { 9.0 } + swing(n))).is_none());
    }
}
