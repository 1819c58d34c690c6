//! Waves beside the loop: a pump, a neighbouring loop or the wind makes the load swing at some frequencies. Behind any linear plant and its filter a wave of the load, or of the
//! sensor, is a wave of the same frequency in the innovations: what swings there at these frequencies is taken out of them, the same for every hypothesis, and nothing has to be known of
//! its size. Where dry friction holds a mass that is not exact.

use std::f64::consts::TAU;

use super::inner_product::dot;

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
}

/// Samples after which sine and cosine are asked for anew before what is rounded adds up.
const TURNED: usize = 64;

/// Samples in which a filter forgets that it did not know of a wave where the recording begins: such decays are taken out with the waves, or each hypothesis gains by how soon
/// it forgets.
const FORGOTTEN: [f64; 4] = [20.0, 60.0, 200.0, 600.0];

/// Orthonormal directions of what swings at some frequencies, and of how it begins.
pub struct Swings(Vec<Vec<f64>>);

impl Swings {
    /// Over samples of a recording, those alone that count.
    pub fn over(hz: &[f64], sample_time_s: f64, counts: &[bool]) -> Self {
        let mut directions: Vec<Vec<f64>> = Vec::new();
        let waves = hz.iter().flat_map(|hz| pair(TAU * hz * sample_time_s, counts));
        let forgotten = FORGOTTEN.iter().map(|samples| decaying(*samples, counts));
        for column in waves.chain(forgotten) {
            let size = dot(&column, &column);
            let left = without(&directions, without(&directions, column));
            let norm = libm::sqrt(dot(&left, &left));
            if norm > 1e-6 * libm::sqrt(size) && norm > 0.0 {
                directions.push(left.into_iter().map(|x| x / norm).collect());
            }
        }
        Self(directions)
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
    let at =
        |(n, counts): (usize, &bool)| if *counts { libm::exp(-((n - first) as f64) / samples) } else { 0.0 };
    counts.iter().enumerate().map(at).collect()
}

fn without(directions: &[Vec<f64>], mut x: Vec<f64>) -> Vec<f64> {
    take_out(directions, &mut x);
    x
}

fn take_out(directions: &[Vec<f64>], x: &mut [f64]) {
    for direction in directions {
        let known = direction.get(..x.len()).unwrap_or(direction);
        let along = dot(known, x.get(..known.len()).unwrap_or(&[]));
        x.iter_mut().zip(known).for_each(|(x, d)| *x -= along * d);
    }
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
