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
    use nalgebra::{DMatrix, DVector};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::{Jumps, answer};
    use crate::control_loop::Loop;
    use crate::estimate::fit::Fit;
    use crate::estimate::hypothesis::{Hypothesis, Point, Target};
    use crate::estimate::innovations::SETTLING;
    use crate::estimate::likelihood::Data;
    use crate::estimate::linear_part::LinearPart;
    use crate::estimate::measure;
    use crate::estimate::signals::Signals;
    use crate::likelihood_search::options::Options;
    use crate::likelihood_search::simulates::sequence;

    const SAMPLES: usize = 160;
    const JUMPS: [usize; 2] = [60, 110];
    const LEVELS: [f64; 3] = [0.0, 0.4, -0.3];
    const SENSOR: f64 = 0.05;

    /// A lag of two samples driven by u, under a load that drifts a little and jumps twice.
    fn recorded() -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let u = sequence(SAMPLES, 0.3, 0.8, &mut random);
        let drift = sequence(SAMPLES, 0.05, 0.9, &mut random);
        let noise = sequence(SAMPLES, SENSOR, 0.0, &mut random);
        let stays = libm::exp(-0.5);
        let mut x = 0.0;
        let shown = |(n, (drift, noise)): (usize, (f64, f64))| {
            let y = x + noise;
            let level = LEVELS[JUMPS.iter().filter(|jump| **jump <= n).count()];
            x = stays * x + (1.0 - stays) * (u[n] - drift - level);
            y
        };
        let y: Vec<f64> = drift.into_iter().zip(noise).enumerate().map(shown).collect();
        Signals { sample_time_s: 1.0, r: vec![0.0; SAMPLES], u, y, ..Signals::default() }
    }

    fn placed() -> (Hypothesis, Point, Data) {
        let text = "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"recorded\"\n\
                    [plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 2.0\n";
        let model = Loop::parse(text, "a loop").unwrap();
        let signals = recorded();
        let scales = measure::scales(&model, std::slice::from_ref(&signals));
        let hypothesis = Hypothesis::nominal(&model, &scales, &Options::default().priors);
        let data = Data::new(&hypothesis, vec![signals], vec![SAMPLES]);
        let mut point = hypothesis.own_point();
        for (target, value) in [
            (Target::LoadSize, libm::log(scales.noise / scales.drive)),
            (Target::LoadTau, libm::log(10.0)),
            (Target::SensorRho, 0.2),
        ] {
            let place = hypothesis.place(target).unwrap();
            point.x[place] = hypothesis.free[place].x_of(value);
        }
        (hypothesis, point, data)
    }

    /// Minus two log-likelihoods of the samples that count, given those before, from the covariance of all of them: the sensor noise's size is the likeliest one. U acts as a load less.
    fn by_hand(hypothesis: &Hypothesis, point: &Point, data: &Data, jump: f64) -> f64 {
        let realised = hypothesis.realise(point).unwrap();
        let part = LinearPart::of(&realised.model, 0.0, &data.motions).unwrap();
        let noise = realised.noise;
        let phi = noise.load_phi(1.0);
        // How y answers to a load in each sample.
        let answers = DMatrix::from_fn(SAMPLES, SAMPLES, |n, k| {
            if k < n { -part.c[0] * part.g[0] * libm::pow(part.f[0], (n - k - 1) as f64) } else { 0.0 }
        });
        let apart = |i: usize, k: usize| i.abs_diff(k) as f64;
        let loads = DMatrix::from_fn(SAMPLES, SAMPLES, |i, k| {
            // What it has jumped to fades as it does.
            let begun = JUMPS.iter().filter(|at| **at <= i.min(k));
            let jumped: f64 = begun.map(|at| libm::pow(phi, (i + k - 2 * at) as f64)).sum();
            noise.load_ratio * noise.load_ratio * libm::pow(phi, apart(i, k)) + jump * jump * jumped
        });
        let sensor = DMatrix::from_fn(SAMPLES, SAMPLES, |i, k| {
            libm::pow(noise.sensor_rho, apart(i, k)) + if i == k { noise.sensor_white } else { 0.0 }
        });
        let all = &answers * loads * answers.transpose() + sensor;
        let signals = &data.recordings[0];
        let of_u = &answers * DVector::from_column_slice(&signals.u);
        let y = DVector::from_column_slice(&signals.y) + of_u;
        let of_first = |samples: usize| {
            let factor = all.view((0, 0), (samples, samples)).into_owned().cholesky().unwrap();
            let y = y.rows(0, samples).into_owned();
            (y.dot(&factor.solve(&y)), 2.0 * factor.l().diagonal().map(f64::ln).sum())
        };
        let ((squares, logs), (before, logs_before)) = (of_first(SAMPLES), of_first(SETTLING));
        let count = (SAMPLES - SETTLING) as f64;
        count * ((squares - before) / count).ln() + logs - logs_before
    }

    /// The covariance of all samples at once tells how much likelier they are where the load may have jumped; the filter, sample by sample, tells the same.
    #[test]
    fn jumps_are_as_likely_as_the_covariance_of_all_samples_has_it() {
        let (hypothesis, point, data) = placed();
        let objective = |data: &Data| Fit::at(&hypothesis, &point, data).unwrap().objective();
        for ratio in [0.5, 7.0] {
            let jumps = Jumps { at: vec![JUMPS.to_vec()], ratio };
            let gained = objective(&data) - objective(&data.clone().jumping(jumps));
            let expected =
                by_hand(&hypothesis, &point, &data, 0.0) - by_hand(&hypothesis, &point, &data, ratio);
            assert!(expected > 4.0 && (gained - expected).abs() < 0.01 * expected, "{gained} {expected}");
        }
    }

    /// A load that begins shows in the innovations as it does in two runs that differ by it.
    #[test]
    fn the_answer_to_a_jump_is_the_difference_of_two_runs() {
        let (hypothesis, point, data) = placed();
        let rows = |data: &Data| Fit::at(&hypothesis, &point, data).unwrap().rows;
        let plain = rows(&data);
        let mut moved = data.clone();
        let stays = libm::exp(-0.5);
        let mut x = 0.0;
        for y in moved.recordings[0].y.iter_mut().skip(JUMPS[0]) {
            *y += x;
            x = stays * x - (1.0 - stays) * SENSOR;
        }
        let answer = answer(&hypothesis, &point, &data).unwrap();
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
