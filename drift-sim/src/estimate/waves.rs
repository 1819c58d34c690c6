//! Waves beside the loop: a pump, a neighbouring loop or the wind makes the load swing at some frequencies. Behind any linear plant and its filter a wave of the load, or of the
//! sensor, is a wave of the same frequency in the innovations: what swings there at these frequencies is taken out of them, the same for every hypothesis, and nothing has to be known of
//! its size. Where dry friction holds a mass that is not exact.

use std::f64::consts::TAU;
use std::ops::Range;

use super::directions::{orthonormal, take_out};
use super::innovations::SETTLING;
use super::signals::Signals;

/// Waves of a recording, at most.
pub const MOST_WAVES: usize = 3;

/// How fast something swings beside the loop.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Waves {
    /// The frequencies in each recording, in Hz.
    pub hz: Vec<Vec<f64>>,
}

impl Waves {
    /// Those of one recording.
    pub fn of(&self, recording: usize) -> &[f64] {
        self.hz.get(recording).map_or(&[], Vec::as_slice)
    }

    /// How many there are in all recordings.
    pub fn count(&self) -> usize {
        self.hz.iter().map(Vec::len).sum()
    }

    /// What swings beside the loop over those samples of a recording that count.
    pub fn over(&self, recording: usize, signals: &Signals, counted: &Range<usize>) -> Option<Swings> {
        let hz = self.of(recording);
        if hz.is_empty() {
            return None;
        }
        let from = counted.start.max(SETTLING);
        let counts = signals.y.iter().take(counted.end).enumerate();
        let counts: Vec<bool> = counts.map(|(n, y)| n >= from && y.is_finite()).collect();
        Some(Swings::over(hz, signals.sample_time_s, &counts))
    }
}

/// Samples after which sine and cosine are asked for anew before what is rounded adds up.
const TURNED: usize = 64;

/// Samples in which a filter forgets that it did not know of a wave where the recording begins: such decays are taken out with the waves, or each hypothesis gains by how soon
/// it forgets.
const FORGOTTEN: [f64; 4] = [20.0, 60.0, 200.0, 600.0];

/// What is left of a decay that has ended.
const GONE: f64 = 1e-30;

/// Orthonormal directions of what swings at some frequencies, and of how it begins.
#[derive(Debug)]
pub struct Swings(Vec<Vec<f64>>);

impl Swings {
    /// Over samples of a recording, those alone that count.
    pub fn over(hz: &[f64], sample_time_s: f64, counts: &[bool]) -> Self {
        let waves = hz.iter().flat_map(|hz| pair(TAU * hz * sample_time_s, counts));
        let forgotten = FORGOTTEN.iter().map(|samples| decaying(*samples, counts));
        Self(orthonormal(waves.chain(forgotten)))
    }

    /// Takes out what swings so.
    pub fn take_out(&self, innovations: &mut [f64]) {
        take_out(&self.0, innovations);
    }
}

/// Sine and cosine of an angle that grows by so much from sample to sample.
fn pair(angle: f64, counts: &[bool]) -> [Vec<f64>; 2] {
    let mut pair = [Vec::with_capacity(counts.len()), Vec::with_capacity(counts.len())];
    let (turn_sin, turn_cos) = libm::sincos(angle);
    for (from, part) in (0..).step_by(TURNED).zip(counts.chunks(TURNED)) {
        let (mut sin, mut cos) = libm::sincos(angle * f64::from(from));
        for counts in part {
            let weight = f64::from(u8::from(*counts));
            pair[0].push(weight * sin);
            pair[1].push(weight * cos);
            (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
        }
    }
    pair
}

/// What decays in so many samples from the first that counts on.
fn decaying(samples: f64, counts: &[bool]) -> Vec<f64> {
    let first = counts.iter().position(|counts| *counts).unwrap_or(0);
    let stays = libm::exp(-1.0 / samples);
    let (mut left, mut decaying) = (1.0, vec![0.0; first]);
    for counts in counts.iter().skip(first) {
        decaying.push(if *counts { left } else { 0.0 });
        // The slow numbers next to zero are none.
        left = if left > GONE { left * stays } else { 0.0 };
    }
    decaying
}

#[cfg(test)]
mod tests {
    use super::Waves;
    use crate::estimate::all_at_once::{LAG, placed};
    use crate::estimate::fit::Fit;

    const HZ: f64 = 0.07;

    /// A wave of the load leaves no trace: under these numbers the recording with it is as likely as the same recording without it, and without a wave that is told little is taken out.
    #[test]
    fn a_wave_that_is_told_leaves_no_trace() {
        let swings =
            |size: f64| move |n: usize| size * libm::sin(std::f64::consts::TAU * HZ * n as f64 + 1.0);
        let objective = |size: f64, told: bool| {
            let placed = placed(LAG, swings(size));
            let hz = if told { vec![HZ] } else { Vec::new() };
            let data = placed.data.clone().swinging(Waves { hz: vec![hz] });
            Fit::at(&placed.hypothesis, &placed.point, &data).unwrap().objective()
        };
        let (still, told) = (objective(0.0, true), objective(0.3, true));
        assert!((still - told).abs() < 12.0, "{still} {told}");
        assert!(objective(0.3, false) > told + 40.0);
        assert!((objective(0.0, false) - still).abs() < 12.0);
    }
}
