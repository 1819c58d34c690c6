//! Jumps of the random load: at some samples it goes to another level, beside what it drifts by. The filter is told when, and not how far: there the load is as unknown as
//! a jump is large, so that each costs what it takes to find its size, and what it explains counts for every hypothesis alike.

use super::hypothesis::{Hypothesis, Point};
use super::likelihood::{Cache, Data};

/// When the load jumps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Jumps {
    /// The samples of each recording, in order.
    pub at: Vec<Vec<usize>>,
    /// Deviation of a jump, in the drive's unit, over that of the sensor's noise.
    pub ratio: f64,
}

impl Jumps {
    /// Those of one recording.
    pub fn of(&self, recording: usize) -> &[usize] {
        self.at.get(recording).map_or(&[], Vec::as_slice)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.at.iter().map(Vec::len).sum()
    }

    /// Deviation of a jump beside a sensor noise of this deviation, in the drive's unit.
    pub fn deviation(&self, sensor_sd: f64) -> f64 {
        self.ratio * sensor_sd
    }

    /// The same of the levels between which the load jumps: from one to another it jumps by the root of two times as much.
    pub fn level_deviation(&self, sensor_sd: f64) -> f64 {
        libm::sqrt(0.5) * self.deviation(sensor_sd)
    }

    /// How likely a sample is one at which the load jumps, of recordings of so many samples together.
    pub fn rate(&self, samples: usize) -> f64 {
        self.count() as f64 / samples.max(1) as f64
    }

    /// The same in finer samples.
    #[must_use]
    pub fn in_finer_samples(&self, factor: usize) -> Self {
        let finer = |at: &Vec<usize>| at.iter().map(|sample| factor * sample).collect();
        Self { at: self.at.iter().map(finer).collect(), ratio: self.ratio }
    }

    /// The same in coarser samples.
    #[must_use]
    pub fn in_coarser_samples(&self, factor: usize) -> Self {
        let fewer = |at: &Vec<usize>| {
            let mut fewer: Vec<usize> = at.iter().map(|sample| sample / factor.max(1)).collect();
            fewer.dedup();
            fewer
        };
        Self { at: self.at.iter().map(fewer).collect(), ratio: self.ratio }
    }
}

/// Part of the answer's squares after which it counts as over, and samples that are looked at, at most.
const OVER: f64 = 1e-3;
const LONGEST: usize = 1_500;

/// How the scaled innovations answer to a load of 1 that begins, sample after sample, until it is over; `None` where the loop can't be simulated.
pub fn answer(hypothesis: &Hypothesis, point: &Point, data: &Data) -> Option<Vec<f64>> {
    let (part, gains, (phi, rho)) = Cache::settled(hypothesis, point, data)?;
    let (gains, [of_load, of_sensor], (per_deviation, _)) = (gains.0.as_slice(), gains.1, gains.2);
    let n = part.order();
    let (mut x, mut load, mut sensor) = (vec![0.0; n], 1.0, 0.0);
    let unit = hypothesis.scales.noise;
    let mut answer: Vec<f64> = Vec::new();
    let mut sum = 0.0;
    while answer.len() < LONGEST {
        let e = part.c.iter().zip(&x).map(|(c, x)| c * x).sum::<f64>() + sensor;
        let scaled = e * per_deviation / unit;
        answer.push(scaled);
        sum += scaled * scaled;
        let tail: f64 = answer.iter().rev().take(answer.len() / 3).map(|a| a * a).sum();
        if answer.len() > n + 20 && tail < OVER * sum {
            break;
        }
        x.iter_mut().zip(gains).for_each(|(x, k)| *x -= k * e);
        load -= of_load * e;
        sensor -= of_sensor * e;
        let moved = |i: usize| {
            let row = part.f.iter().skip(i * n).take(n);
            row.zip(&x).map(|(f, x)| f * x).sum::<f64>() - part.g.get(i).copied().unwrap_or(0.0) * load
        };
        x = (0..n).map(moved).collect();
        // What the filter knows of the load fades, the load itself stays.
        load = phi * load + (1.0 - phi);
        sensor *= rho;
    }
    Some(answer)
}

#[cfg(test)]
mod tests {
    use super::{Jumps, answer};
    use crate::estimate::all_at_once::{LAG, SAMPLES, SENSOR, placed, ways_apart};
    use crate::estimate::fit::Fit;
    use crate::estimate::likelihood::Data;

    const JUMPS: [usize; 2] = [60, 110];
    const LEVELS: [f64; 3] = [0.0, 0.4, -0.3];

    fn level(n: usize) -> f64 {
        LEVELS[JUMPS.iter().filter(|jump| **jump <= n).count()]
    }

    /// The covariance of all samples at once tells how much likelier they are where the load may have jumped; the filter, sample by sample, tells the same.
    #[test]
    fn jumps_are_as_likely_as_the_covariance_of_all_samples_has_it() {
        let placed = placed(LAG, level);
        for ratio in [0.5, 7.0] {
            let phi = placed.noise().load_phi(1.0);
            // What it has jumped to fades as it does.
            let jumped = |i: usize, k: usize| {
                let begun = JUMPS.iter().filter(|at| **at <= i.min(k));
                ratio * ratio * begun.map(|at| libm::pow(phi, (i + k - 2 * at) as f64)).sum::<f64>()
            };
            let jumps = Jumps { at: vec![JUMPS.to_vec()], ratio };
            let (gained, expected) = ways_apart(&placed, &placed.data.clone().jumping(jumps), jumped);
            assert!(expected > 4.0 && (gained - expected).abs() < 0.01 * expected, "{gained} {expected}");
        }
        assert_eq!(placed.data.recordings[0].len(), SAMPLES);
    }

    /// A load that begins shows in the innovations as it does in two runs that differ by it.
    #[test]
    fn the_answer_to_a_jump_is_the_difference_of_two_runs() {
        let placed = placed(LAG, level);
        let (hypothesis, point, data) = (&placed.hypothesis, &placed.point, &placed.data);
        let rows = |data: &Data| Fit::at(hypothesis, point, data).unwrap().rows;
        let plain = rows(data);
        let mut moved = data.clone();
        let stays = libm::exp(-0.5);
        let mut x = 0.0;
        for y in moved.recordings[0].y.iter_mut().skip(JUMPS[0]) {
            *y += x;
            x = stays * x - (1.0 - stays) * SENSOR;
        }
        let answer = answer(hypothesis, point, data).unwrap();
        let variance = plain.z.iter().map(|z| z * z).sum::<f64>() / plain.count as f64;
        let factor = variance.sqrt() * hypothesis.scales.noise / plain.sensor_sd;
        let differences = rows(&moved).z.into_iter().zip(&plain.z).map(|(a, b)| (a - b) / factor);
        let expected: Vec<f64> = differences.skip(JUMPS[0]).collect();
        let most = expected.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
        assert!(answer.len() > 10 && most > 0.1);
        for (n, (answer, expected)) in answer.iter().zip(&expected).enumerate() {
            assert!((SENSOR * answer - expected).abs() < 1e-3 * most, "{n}: {answer} {expected}");
        }
    }
}
