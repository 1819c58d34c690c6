//! An independent truth for the filter: the likelihood of few samples from the covariance of all of them at once.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::fit::Fit;
use super::hypothesis::{Hypothesis, Point, Target};
use super::innovations::SETTLING;
use super::likelihood::Data;
use super::measure;
use super::noise::Noise;
use super::signals::Signals;
use crate::control_loop::Loop;
use crate::estimate::noise::sequence;
use crate::likelihood_search::options::Options;

pub const SAMPLES: usize = 160;
pub const SENSOR: f64 = 0.05;
/// A lag of two samples.
pub const LAG: &str = "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"recorded\"\n\
    [plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 2.0\n";

/// A loop with its numbers and its noise, and a recording of it.
pub struct Placed {
    pub hypothesis: Hypothesis,
    pub point: Point,
    pub data: Data,
}

impl Placed {
    /// Its noise.
    pub fn noise(&self) -> Noise {
        self.hypothesis.realise(&self.point).unwrap().noise
    }
}

/// What the lag shows of a u under a load that drifts a little and moves besides.
fn recorded(load: impl Fn(usize) -> f64) -> Signals {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let u = sequence(SAMPLES, 0.3, 0.8, &mut random);
    let drift = sequence(SAMPLES, 0.05, 0.9, &mut random);
    let noise = sequence(SAMPLES, SENSOR, 0.0, &mut random);
    let stays = libm::exp(-0.5);
    let mut x = 0.0;
    let shown = |(n, (drift, noise)): (usize, (f64, f64))| {
        let y = x + noise;
        x = stays * x + (1.0 - stays) * (u[n] - drift - load(n));
        y
    };
    let y: Vec<f64> = drift.into_iter().zip(noise).enumerate().map(shown).collect();
    Signals { sample_time_s: 1.0, r: vec![0.0; SAMPLES], u, y, ..Signals::default() }
}

/// A loop beside that recording, with a load and a sensor noise of about its sizes.
pub fn placed(text: &str, load: impl Fn(usize) -> f64) -> Placed {
    let model = Loop::parse(text, "a loop").unwrap();
    let signals = recorded(load);
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
    Placed { hypothesis, point, data }
}

/// How y answers to a load in each sample: the lag's answers, each seen through what the sensor makes of a y that is held to a straight line between samples.
pub fn answers(seen: impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
    let stays = libm::exp(-0.5);
    let mut answers = DMatrix::zeros(SAMPLES, SAMPLES);
    for k in 0..SAMPLES {
        let y: Vec<f64> = (0..SAMPLES)
            .map(|n| if n > k { -(1.0 - stays) * libm::pow(stays, (n - k - 1) as f64) } else { 0.0 })
            .collect();
        answers.set_column(k, &DVector::from_vec(seen(&y)));
    }
    answers
}

/// Minus two log-likelihoods of the samples that count, given those before, from the covariance of all of them, the load having this covariance, in the square of the sensor noise's
/// deviation, beside what it drifts by: the sensor noise's size is the likeliest one. U acts as a load less.
pub fn by_hand(placed: &Placed, answers: &DMatrix<f64>, besides: impl Fn(usize, usize) -> f64) -> f64 {
    let noise = placed.noise();
    let phi = noise.load_phi(1.0);
    let apart = |i: usize, k: usize| i.abs_diff(k) as f64;
    let loads = DMatrix::from_fn(SAMPLES, SAMPLES, |i, k| {
        noise.load_ratio * noise.load_ratio * libm::pow(phi, apart(i, k)) + besides(i, k)
    });
    let sensor = DMatrix::from_fn(SAMPLES, SAMPLES, |i, k| {
        libm::pow(noise.sensor_rho, apart(i, k)) + if i == k { noise.sensor_white } else { 0.0 }
    });
    let all = answers * loads * answers.transpose() + sensor;
    let signals = &placed.data.recordings[0];
    let y = DVector::from_column_slice(&signals.y) + answers * DVector::from_column_slice(&signals.u);
    let of_first = |samples: usize| {
        let factor = all.view((0, 0), (samples, samples)).into_owned().cholesky().unwrap();
        let y = y.rows(0, samples).into_owned();
        (y.dot(&factor.solve(&y)), 2.0 * factor.l().diagonal().map(f64::ln).sum())
    };
    let ((squares, logs), (before, logs_before)) = (of_first(SAMPLES), of_first(SETTLING));
    let count = (SAMPLES - SETTLING) as f64;
    count * ((squares - before) / count).ln() + logs - logs_before
}

/// What a load that is told to move besides gains: by the filter, on data that know of it, and by hand.
pub fn ways_apart(placed: &Placed, told: &Data, besides: impl Fn(usize, usize) -> f64) -> (f64, f64) {
    let objective = |data: &Data| Fit::at(&placed.hypothesis, &placed.point, data).unwrap().objective();
    let answers = answers(<[f64]>::to_vec);
    let gained = objective(&placed.data) - objective(told);
    (gained, by_hand(placed, &answers, |_, _| 0.0) - by_hand(placed, &answers, besides))
}
