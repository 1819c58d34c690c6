//! Recordings that are drawn from what was found, its noise among it: how far that noise alone leads a simulation from what is measured.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::control_loop::Loop;
use crate::diagnose::part_time;
use crate::diagnose::prove::{quiet_run, without_noise};
use crate::estimate::inner_product::dot;
use crate::estimate::noise::{Noise, sequence};
use crate::estimate::signals::Signals;
use crate::estimate::waves::Swings;
use crate::measured_input::{Enters, Input};
use crate::simulate::{self, Start, Trace};

use super::simulates::{MOST_WORSE, Trial};

/// Recordings that are drawn to see how far noise leads a simulation astray: one in twenty that are as the fit has it is led farther than all of them.
const DRAWN: u64 = 19;

impl Trial<'_> {
    /// How many times by as much what is named misses a recording as the loop without it.
    pub(super) fn times_as_far(&self, signals: &Signals) -> Option<f64> {
        let (load, swings) = (self.load_sd()?, self.swings());
        let missed_by = |model: &Loop| missed(model, signals, load, swings.as_ref());
        Some(missed_by(self.model)? / missed_by(&self.found.refitted)?.max(1e-300))
    }

    /// Deviation of the random load.
    fn load_sd(&self) -> Option<f64> {
        let realised = self.fit.hypothesis.realise(&self.fit.point)?;
        Some(realised.noise.load_ratio * self.fit.rows.sensor_sd)
    }

    /// Levels between which the load jumps as often as it did.
    fn drawn_levels(&self, samples: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
        let jumps = self.data.jumps();
        let all: usize = self.data.recordings.iter().map(Signals::len).sum();
        let rate = jumps.rate(self.factor * all);
        let deviation = jumps.level_deviation(self.fit.rows.sensor_sd);
        let mut drawn = || -> f64 { StandardNormal.sample(random) };
        let mut level = 0.0;
        let next = |_| {
            // One in so many normal numbers is beyond a bound.
            if rate > 0.0 && libm::erfc(drawn().abs() * std::f64::consts::FRAC_1_SQRT_2) < rate {
                level = deviation * drawn();
            }
            level
        };
        (0..samples).map(next).collect()
    }

    /// By how much this recording is missed, and those that are drawn from the fit, its noise among it.
    pub(super) fn missed_beside_drawn(&self) -> Option<Missed> {
        let (load, swings) = (self.load_sd()?, self.swings());
        let missed_in = |signals: &Signals| missed(self.model, signals, load, swings.as_ref());
        let drawn = self.each_drawn(missed_in)?;
        let mean_drawn = drawn.iter().sum::<f64>() / DRAWN as f64;
        let least = drawn.iter().copied().fold(f64::INFINITY, f64::min);
        let most = drawn.into_iter().fold(0.0, f64::max);
        let (least_drawn, most_drawn) = if self.is_closed() { (least, most) } else { (0.0, 0.0) };
        Some(Missed { measured: missed_in(self.shown)?, mean_drawn, least_drawn, most_drawn })
    }

    /// What is asked of each recording that is drawn from the fit.
    pub(super) fn each_drawn(&self, asked: impl Fn(&Signals) -> Option<f64>) -> Option<Vec<f64>> {
        let noise = self.fit.hypothesis.realise(&self.fit.point)?.noise;
        (0..DRAWN).map(|seed| asked(&self.drawn(self.model, &noise, seed)?)).collect()
    }

    /// A recording of a loop under the same reference (under the same u, where the law is unknown), with load and sensor noise of the fit's size.
    fn drawn(&self, model: &Loop, noise: &Noise, seed: u64) -> Option<Signals> {
        let signals = self.shown;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let sensor_sd = self.fit.rows.sensor_sd;
        let phi = noise.load_phi(signals.sample_time_s);
        let mut load = sequence(signals.len(), noise.load_ratio * sensor_sd, phi, &mut random);
        let levels = self.drawn_levels(signals.len(), &mut random);
        load.iter_mut().zip(levels).for_each(|(load, level)| *load += level);
        let mut sensor = sequence(signals.len(), sensor_sd, noise.sensor_rho, &mut random);
        let white = sequence(signals.len(), sensor_sd * libm::sqrt(noise.sensor_white), 0.0, &mut random);
        sensor.iter_mut().zip(white).for_each(|(sensor, white)| *sensor += white);
        let colored = |mut white: Vec<f64>| {
            self.data.coloring().color(&mut white);
            white
        };
        let (load, sensor) = (colored(load), colored(sensor));
        let mut noisy = without_noise(model);
        let mut inputs = signals.inputs.clone();
        for (values, enters) in [(load, Enters::Load), (grown(sensor, noise, signals), Enters::Sensor)] {
            noisy.inputs.push(Input::made(enters));
            inputs.push(values);
        }
        let noisy = part_time::of(noisy, signals.origin_s);
        let start = Start::from_recording(&noisy, &signals.r, &signals.y, &signals.u);
        let Trace { y, u, .. } = if noisy.has_law() {
            simulate::simulate(&noisy, &signals.r, &inputs, seed, Some(&start)).ok()?
        } else {
            let run = simulate::replay(&noisy, &signals.u, &inputs, seed, Some(&start)).ok()?;
            Trace { u: signals.u.clone(), ..run }
        };
        Some(Signals { y, u, ..signals.clone() })
    }

    /// What swings beside the loop, at all frequencies that any recording has: in what is drawn nothing does.
    fn swings(&self) -> Option<Swings> {
        let hz = self.data.waves().hz.concat();
        let shown = self.shown;
        (!hz.is_empty()).then(|| Swings::over(&hz, shown.sample_time_s, &vec![true; shown.len()]))
    }
}

/// By how much a simulation misses what was measured, and what is drawn as the fit has it.
#[derive(Clone, Copy)]
pub(super) struct Missed {
    pub(super) measured: f64,
    mean_drawn: f64,
    pub(super) least_drawn: f64,
    /// Both 0 under an unknown law: from u alone noise leads a few of those drawn so far that they would excuse anything.
    most_drawn: f64,
}

impl Missed {
    /// Whether noise explains it.
    pub(super) fn is_as_noise_has_it(self) -> bool {
        self.beyond_mean() < MOST_WORSE || self.measured <= self.most_drawn
    }

    /// How many times worse the measured one is simulated than the mean of those drawn.
    pub(super) fn beyond_mean(self) -> f64 {
        self.measured / self.mean_drawn.max(1e-300)
    }
}

/// Sensor noise that grows where the fit says so.
fn grown(mut sensor: Vec<f64>, noise: &Noise, signals: &Signals) -> Vec<f64> {
    let at = |n: usize| signals.origin_s + n as f64 * signals.sample_time_s;
    sensor.iter_mut().enumerate().for_each(|(n, value)| *value *= noise.growth_at(at(n)));
    sensor
}

/// By how much a simulation misses u (y under an unknown law), in its own unit: how far noise leads a loop does not follow from how far it moves. What a load
/// that stays makes of it does not count: under a random load nothing tells its size for sure, and behind an integrator it leads anywhere. Nor does what swings beside the loop.
fn missed(model: &Loop, signals: &Signals, load: f64, swings: Option<&Swings>) -> Option<f64> {
    let missed_under = |load: f64| {
        let mut missed = differences(model, signals, load)?;
        if let Some(swings) = swings {
            swings.take_out(&mut missed);
        }
        Some(missed)
    };
    let missed = missed_under(0.0)?;
    let taken = missed_under(load).map_or(0.0, |under| {
        let answer: Vec<f64> = under.iter().zip(&missed).map(|(a, b)| a - b).collect();
        let along = dot(&answer, &missed);
        along * along / dot(&answer, &answer).max(1e-300)
    });
    Some(libm::sqrt((dot(&missed, &missed) - taken).max(0.0) / missed.len().max(1) as f64))
}

/// What a simulation under this load misses of u, or of y under an unknown law.
fn differences(model: &Loop, signals: &Signals, load: f64) -> Option<Vec<f64>> {
    let mut model = model.clone();
    model.inputs.push(Input::made(Enters::Load));
    let mut inputs = signals.inputs.clone();
    inputs.push(vec![load; signals.len()]);
    let trace = quiet_run(&model, &Signals { inputs, ..signals.clone() })?;
    let is_open = !model.has_law();
    let (measured, simulated) = if is_open { (&signals.y, &trace.y) } else { (&signals.u, &trace.u) };
    let each = measured.iter().zip(simulated);
    Some(each.map(|(a, b)| if a.is_finite() { a - b } else { 0.0 }).collect())
}
