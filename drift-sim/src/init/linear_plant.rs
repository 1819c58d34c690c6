//! A linear plant between the recorded u and y: one lag, an integrator, an integrator behind a lag (a servo), or two lags,
//! each with an offset and, but for the servo, dead time.
//!
//! Given the time constants and the dead time, y is linear in the gain, the offset and the starting state: these follow
//! by least squares on the simulated output. The rest is searched on the first 70 % of the recording; what is taken is
//! judged on the last 30 %, where only the starting state is found anew. Steps of u are held between samples, so the
//! responses are exact, also for dead times that are no whole number of samples.

use rayon::prelude::*;

use crate::estimate::signals::{Signals, deviation};
use crate::physics::Term;
use crate::plant::{FirstOrder, Output, Plant, Servo, TransferFunction};

use super::least_squares::{COLUMNS_MAX, LeastSquares};
use super::round;

/// Part of the recording that plants are fitted to.
const TRAINING: f64 = 0.7;
/// Time constants tried, from a third of a sample to the length of the recording, evenly in their logarithm.
const TIME_CONSTANTS: usize = 16;
/// Dead times tried first, in samples.
const DELAYS: [f64; 9] = [0.0, 1.0, 2.0, 4.0, 7.0, 12.0, 20.0, 35.0, 60.0];
/// Dead times up to this part of the training samples.
const LONGEST_DELAY: f64 = 0.1;
/// Starting points that are searched to the end.
const SEARCHED: usize = 3;
/// Steps of a search, at most: time constants that can't be told apart make a long valley.
const STEPS: usize = 120;
/// The second time constant is at most this part of the first: equal ones can't be told apart.
const APART: f64 = 0.8;
/// A shape with more numbers has to miss less by this ratio, and this part of y's deviation.
const WORTH: (f64, f64) = (0.9, 1e-3);
/// Part of y's variance on the unseen samples that a plant may leave, else nothing was identified.
const LEFT_OVER: f64 = 0.5;
/// A time constant longer than this many recordings is not seen in one.
const SLOWEST: f64 = 3.0;

/// The forms that are tried, simplest first.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    Lag(f64),
    Integrator,
    Servo(f64),
    TwoLags(f64, f64),
}

/// A plant that was found.
pub struct Found {
    /// As the loop file states it.
    pub plant: Plant,
    /// What it needs beside: an offset at its drive, where its kind has none.
    pub load: Option<Term>,
    /// Its form in words.
    pub says: String,
    /// Part of y's variance on the last 30 % that it explains, from 0 to 1.
    pub explains: f64,
}

#[derive(Debug, Clone, Copy)]
struct Point {
    shape: Shape,
    /// Dead time in samples.
    delay: f64,
}

struct Fit {
    point: Point,
    gain: f64,
    /// y at no drive; of an integrator, its slope there, per second.
    offset: f64,
    left_over: f64,
}

/// Finds the plant; or the most of y's variance on the last 30 % that any explains, which is too little.
///
/// # Errors
/// That part of the variance, at most 0.5; negative where y is better told by its mean.
pub fn find(signals: &Signals) -> Result<Found, f64> {
    let cut = (TRAINING * signals.len() as f64) as usize;
    let unseen = deviation(signals.y.get(cut..).unwrap_or_default());
    let mut judged: Vec<(Fit, f64)> =
        [lags(signals, cut), integrators(cut), servos(signals), two_lags(signals, cut)]
            .into_iter()
            .filter_map(|starts| best(signals, cut, starts))
            .filter(|fit| fit.is_possible(signals))
            .filter_map(|fit| validate(signals, cut, &fit).map(|rms| (fit, rms / unseen.max(1e-300))))
            .collect();
    let least = judged.iter().map(|(_, misses)| *misses).fold(f64::INFINITY, f64::min);
    let simplest = judged.iter().position(|(_, misses)| misses * WORTH.0 <= least + WORTH.1);
    let Some((fit, misses)) = simplest.map(|at| judged.swap_remove(at)) else {
        return Err(f64::NEG_INFINITY);
    };
    let explains = 1.0 - misses * misses;
    if explains < 1.0 - LEFT_OVER { Err(explains) } else { Ok(fit.found(signals, explains)) }
}

fn time_constants(signals: &Signals) -> impl Iterator<Item = f64> + Clone + use<> {
    let shortest = signals.sample_time_s / 3.0;
    let ratio = signals.duration_s() / shortest;
    (0..TIME_CONSTANTS).map(move |i| shortest * libm::pow(ratio, i as f64 / (TIME_CONSTANTS - 1) as f64))
}

fn lags(signals: &Signals, cut: usize) -> Vec<Point> {
    delays(cut)
        .flat_map(|delay| time_constants(signals).map(move |t| Point { shape: Shape::Lag(t), delay }))
        .collect()
}

fn integrators(cut: usize) -> Vec<Point> {
    delays(cut).map(|delay| Point { shape: Shape::Integrator, delay }).collect()
}

/// The loop file's servo has no dead time.
fn servos(signals: &Signals) -> Vec<Point> {
    time_constants(signals).map(|t| Point { shape: Shape::Servo(t), delay: 0.0 }).collect()
}

fn two_lags(signals: &Signals, cut: usize) -> Vec<Point> {
    let every_other = || time_constants(signals).step_by(2);
    let pairs = every_other().flat_map(|slow| {
        every_other().filter(move |fast| *fast < APART * slow).map(move |fast| Shape::TwoLags(slow, fast))
    });
    let pairs: Vec<Shape> = pairs.collect();
    delays(cut)
        .step_by(2)
        .flat_map(|delay| pairs.iter().map(move |shape| Point { shape: *shape, delay }))
        .collect()
}

fn delays(cut: usize) -> impl Iterator<Item = f64> {
    DELAYS.into_iter().filter(move |delay| *delay <= LONGEST_DELAY * cut as f64)
}

/// The best point of a grid, searched to its end.
fn best(signals: &Signals, cut: usize, starts: Vec<Point>) -> Option<Fit> {
    let mut fits: Vec<Fit> = starts.into_par_iter().filter_map(|point| fit(signals, cut, point)).collect();
    fits.sort_by(|a, b| a.left_over.total_cmp(&b.left_over));
    fits.truncate(SEARCHED);
    let searched: Vec<Fit> = fits.into_par_iter().map(|start| search(signals, cut, start)).collect();
    searched.into_iter().min_by(|a, b| a.left_over.total_cmp(&b.left_over))
}

/// Moves one number after the other while it helps, in ever smaller steps.
fn search(signals: &Signals, cut: usize, mut best: Fit) -> Fit {
    let (mut ratio, mut samples) = (1.6_f64, 2.0_f64);
    let longest = LONGEST_DELAY * cut as f64;
    for _ in 0..STEPS {
        if ratio < 1.0001 {
            break;
        }
        let Point { shape, delay } = best.point;
        let shapes: Vec<Shape> = match shape {
            Shape::Lag(t) => vec![Shape::Lag(t * ratio), Shape::Lag(t / ratio)],
            Shape::Integrator => Vec::new(),
            Shape::Servo(t) => vec![Shape::Servo(t * ratio), Shape::Servo(t / ratio)],
            Shape::TwoLags(slow, fast) => {
                [(ratio, 1.0), (1.0 / ratio, 1.0), (1.0, ratio), (1.0, 1.0 / ratio)]
                    .into_iter()
                    .map(|(a, b)| (slow * a, fast * b))
                    .filter(|(slow, fast)| *fast <= APART * slow)
                    .map(|(slow, fast)| Shape::TwoLags(slow, fast))
                    .collect()
            }
        };
        let moved = shapes.into_iter().map(|shape| Point { shape, delay });
        let has_delay = !matches!(shape, Shape::Servo(_));
        let delays = [delay + samples, (delay - samples).max(0.0)];
        let delays = delays.into_iter().filter(|d| has_delay && *d <= longest);
        let delayed = delays.map(|delay| Point { shape, delay });
        let better = moved
            .chain(delayed)
            .filter_map(|point| fit(signals, cut, point))
            .min_by(|a, b| a.left_over.total_cmp(&b.left_over))
            .filter(|fit| fit.left_over < best.left_over);
        match better {
            Some(fit) => best = fit,
            None => (ratio, samples) = (libm::sqrt(ratio), samples / 2.0),
        }
    }
    best
}

/// Gain and offset for the first samples, by least squares.
fn fit(signals: &Signals, cut: usize, point: Point) -> Option<Fit> {
    let (y0, u0) = (signals.y.iter().copied().find(|y| y.is_finite())?, *signals.u.first()?);
    let response = point.response(signals, 0, cut);
    let mut basis = Basis::of(point.shape, signals.sample_time_s);
    let mut regression = LeastSquares::new(2 + basis.free);
    for (y, x) in signals.y.iter().zip(&response) {
        if y.is_finite() {
            regression.add(y - y0, &[*x, basis.offset, basis.fading[0], basis.fading[1]]);
        }
        basis.step();
    }
    let solution = regression.solve()?;
    let &[gain, offset, ..] = solution.coefficients.as_slice() else { return None };
    let offset = match point.shape {
        // The response counts from the first u; for a lag the offset is y at no u at all.
        Shape::Integrator | Shape::Servo(_) => offset - gain * u0,
        Shape::Lag(_) | Shape::TwoLags(..) => y0 + offset - gain * u0,
    };
    (gain != 0.0).then_some(Fit { point, gain, offset, left_over: solution.left_over })
}

/// What the fit misses on the samples from `cut` on, rms, with nothing but the starting state found anew.
fn validate(signals: &Signals, cut: usize, fit: &Fit) -> Option<f64> {
    let u0 = *signals.u.first()?;
    let response = fit.point.response(signals, cut, signals.len());
    let mut basis = Basis::of(fit.point.shape, signals.sample_time_s);
    let mut regression = LeastSquares::new(basis.free);
    let mut count = 0;
    for (y, x) in signals.y.get(cut..)?.iter().zip(&response) {
        if y.is_finite() {
            let known = fit.gain * x + (fit.offset + fit.gain * u0) * basis.offset;
            let mut row = [0.0; COLUMNS_MAX];
            row[..2].copy_from_slice(&basis.fading);
            regression.add(y - known, &row);
            count += 1;
        }
        basis.step();
    }
    Some(libm::sqrt(regression.solve()?.left_over / f64::from(count)))
}

/// What y does without u, sample by sample: how the starting state fades, and what an offset of one makes of y.
struct Basis {
    /// Numbers of the starting state.
    free: usize,
    fading: [f64; 2],
    keep: [f64; 2],
    offset: f64,
    slope: f64,
}

impl Basis {
    fn of(shape: Shape, sample_time_s: f64) -> Self {
        let keep = |t: f64| libm::exp(-sample_time_s / t);
        let (free, keep, offset, slope) = match shape {
            Shape::Lag(t) => (1, [keep(t), 0.0], 1.0, 0.0),
            Shape::Integrator => (1, [1.0, 0.0], 0.0, sample_time_s),
            Shape::Servo(t) => (2, [1.0, keep(t)], 0.0, sample_time_s),
            Shape::TwoLags(slow, fast) => (2, [keep(slow), keep(fast)], 1.0, 0.0),
        };
        Self { free, fading: [1.0, if free == 2 { 1.0 } else { 0.0 }], keep, offset, slope }
    }

    fn step(&mut self) {
        self.fading = [self.fading[0] * self.keep[0], self.fading[1] * self.keep[1]];
        self.offset += self.slope;
    }
}

impl Point {
    /// The response of a gain of one to u less its first value, from rest at sample `from`.
    fn response(&self, signals: &Signals, from: usize, to: usize) -> Vec<f64> {
        let one = |t: Option<f64>| lagged(signals, t, self.delay, from, to);
        match self.shape {
            Shape::Lag(t) => one(Some(t)),
            Shape::Integrator => one(None),
            // 1/(s (T s + 1)) = 1/s - T/(T s + 1)
            Shape::Servo(t) => one(None).iter().zip(one(Some(t))).map(|(a, b)| a - t * b).collect(),
            Shape::TwoLags(slow, fast) => {
                let (a, b) = (one(Some(slow)), one(Some(fast)));
                a.iter().zip(&b).map(|(a, b)| (slow * a - fast * b) / (slow - fast)).collect()
            }
        }
    }
}

/// u behind a lag (or an integrator) and a dead time of `delay` samples. Within the sample where a delayed step of u
/// arrives, the part of the sample that it has acted counts.
fn lagged(signals: &Signals, t: Option<f64>, delay: f64, from: usize, to: usize) -> Vec<f64> {
    let ts = signals.sample_time_s;
    let whole = delay as usize;
    let part = 1.0 - (delay - whole as f64);
    let keep = |samples: f64| t.map_or(1.0, |t| libm::exp(-samples * ts / t));
    let add = |samples: f64| t.map_or(samples * ts, |t| -libm::expm1(-samples * ts / t));
    let (keep_part, add_part, keep_one, add_one) = (keep(part), add(part), keep(1.0), add(1.0));
    let u0 = signals.u.first().copied().unwrap_or(0.0);
    let mut state = 0.0;
    // At rest before the first sample: what the plant did before is in its starting state.
    (from..to)
        .map(|n| {
            let u = u_before(signals, n, whole, u0) - u0;
            let now = keep_part * state + add_part * u;
            state = keep_one * state + add_one * u;
            now
        })
        .collect()
}

/// The u whose delayed step acts just before sample `n`.
fn u_before(signals: &Signals, n: usize, whole: usize, u0: f64) -> f64 {
    n.checked_sub(whole + 1).and_then(|at| signals.u.get(at)).copied().unwrap_or(u0)
}

impl Fit {
    /// A time constant that the recording can show; a servo's inertia and friction above zero, its drive turned round
    /// being no servo of the loop file.
    fn is_possible(&self, signals: &Signals) -> bool {
        match self.point.shape {
            Shape::Lag(t) | Shape::TwoLags(t, _) => t <= SLOWEST * signals.duration_s(),
            Shape::Servo(t) => self.gain > 0.0 && t <= SLOWEST * signals.duration_s(),
            Shape::Integrator => true,
        }
    }

    fn found(&self, signals: &Signals, explains: f64) -> Found {
        let delay_s = round(self.point.delay * signals.sample_time_s);
        let (gain, offset) = (round(self.gain), round(self.offset));
        let load =
            |level: f64| Term::new("load_step", &[("level", round(level))]).ok().filter(|_| level != 0.0);
        let behind =
            if delay_s > 0.0 { format!(" behind a dead time of {delay_s} s") } else { String::new() };
        let (plant, load, says) = match self.point.shape {
            Shape::Lag(t) => {
                let plant = FirstOrder { gain, time_constant_s: round(t), delay_s, offset };
                (Plant::FirstOrder(plant), None, format!("one lag of {} s{behind}", round(t)))
            }
            Shape::Integrator => {
                let plant = TransferFunction { num: vec![gain], den: vec![1.0, 0.0], delay_s, offset: 0.0 };
                let says = format!("an integrator{behind}");
                (Plant::TransferFunction(plant), load(-self.offset / self.gain), says)
            }
            Shape::Servo(t) => {
                // Forces can only be told in the unit of u: the drive that a unit of it makes is one.
                let (inertia, viscous) = (round(t / self.gain), round(1.0 / self.gain));
                let servo = Servo { output: Output::Position, inertia, viscous, actuator_gain: 1.0 };
                let says =
                    format!("a servo's position, with a lag of {} s; forces are in the unit of u", round(t));
                (Plant::Servo(servo), load(-self.offset / self.gain), says)
            }
            Shape::TwoLags(slow, fast) => {
                let den = vec![round(slow * fast), round(slow + fast), 1.0];
                let plant = TransferFunction { num: vec![gain], den, delay_s, offset: 0.0 };
                let says = format!("two lags of {} s and {} s{behind}", round(slow), round(fast));
                (Plant::TransferFunction(plant), load(-self.offset / self.gain), says)
            }
        };
        Found { plant, load, says, explains }
    }
}
