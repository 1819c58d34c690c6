//! The control law behind a recording: u regressed on what the laws of the loop file make of the recorded r and y, and
//! then replayed. Both sides are measured, so feedback doesn't bias it, and a law that is right is right to the rounding.

use crate::control_loop::Loop;
use crate::controller::{Controller, Limits, PVelocity, Pi, Pid, VelocityRule};
use crate::estimate::law_replay::{TOLERANCE, replay};
use crate::estimate::signals::{Signals, centred, deviation, rms};

use super::least_squares::{COLUMNS_MAX, LeastSquares, Solution};
use super::limits::{inside, seen};
use super::round;

/// The last part of the recording, on which the law has to hold as well as on the whole.
const LAST: f64 = 0.3;
/// Shortest stretch between limits that is used, samples.
const STRETCH: usize = 5;
/// A law with more numbers has to miss less by this ratio, and this much of u's deviation.
const WORTH: (f64, f64) = (0.8, 1e-4);
/// Derivative filters tried, in samples, in even ratios between these; and none.
const FILTERS: (f64, f64, usize) = (0.3, 300.0, 19);
/// Parts of the recording that are left out where its start does not fit: a recording may begin before its controller.
const SETTLING: [f64; 2] = [0.02, 0.05];

/// A law that was found, or why there is none.
pub struct Found {
    /// The law; [`Controller::Recorded`] where none holds.
    pub controller: Controller,
    /// The best law tried, whether it holds or not: its kind and how far it misses u, rms, as part of u's deviation,
    /// on the whole and on the last 30 %.
    pub best: Option<(&'static str, f64, f64)>,
    /// Numbers of the law with the half width of their 95 % intervals.
    pub intervals: Vec<(&'static str, f64, f64)>,
    /// Samples that were left out at the start.
    pub skipped: usize,
}

struct Candidate {
    controller: Controller,
    intervals: Vec<(&'static str, f64, f64)>,
    misses: f64,
    misses_last: f64,
}

/// Finds the law.
pub fn find(model: &Loop, signals: &Signals) -> Found {
    let first = best(model, signals);
    let holds = |found: &Option<Candidate>| {
        found.as_ref().is_some_and(|c| c.misses <= TOLERANCE && c.misses_last <= TOLERANCE)
    };
    if holds(&first) {
        return found(first, true, 0);
    }
    for part in SETTLING {
        let skipped = (part * signals.len() as f64) as usize;
        let later = best(model, &signals.part(skipped, signals.len()));
        if holds(&later) {
            return found(later, true, skipped);
        }
    }
    found(first, false, 0)
}

fn found(best: Option<Candidate>, holds: bool, skipped: usize) -> Found {
    let summary = best.as_ref().map(|c| (c.controller.kind(), c.misses, c.misses_last));
    match best.filter(|_| holds) {
        Some(law) => Found { controller: law.controller, best: summary, intervals: law.intervals, skipped },
        None => Found { controller: Controller::Recorded, best: summary, intervals: Vec::new(), skipped },
    }
}

/// The simplest of the laws that miss least.
fn best(model: &Loop, signals: &Signals) -> Option<Candidate> {
    let limits = seen(&signals.u);
    let mut laws: Vec<Candidate> = [proportional, with_integral, with_velocity, with_derivative]
        .into_iter()
        .filter_map(|fit| fit(signals, limits))
        .filter_map(|(controller, intervals)| replayed(model, signals, controller, intervals))
        .collect();
    let least = laws.iter().map(|c| c.misses).fold(f64::INFINITY, f64::min);
    let at = laws.iter().position(|c| c.misses * WORTH.0 <= least + WORTH.1)?;
    Some(laws.swap_remove(at))
}

type Fitted = (Controller, Vec<(&'static str, f64, f64)>);

/// How far a law's replay misses u; of a law with limits, the variant that misses least.
fn replayed(
    model: &Loop,
    signals: &Signals,
    controller: Controller,
    intervals: Vec<(&'static str, f64, f64)>,
) -> Option<Candidate> {
    let with = |limits: Limits, anti_windup: bool| {
        let mut controller = controller.clone().with_limits(limits);
        match &mut controller {
            Controller::Pi(law) => law.anti_windup = anti_windup,
            Controller::Pid(law) => law.anti_windup = anti_windup,
            Controller::PVelocity(_) | Controller::Recorded => {}
        }
        controller
    };
    let limits = controller.limits();
    // Without limits first: one that makes no difference is none.
    let variants = [with(Limits::NONE, true), with(limits, true), with(limits, false)];
    let judged: Vec<Candidate> = variants
        .into_iter()
        .filter_map(|controller| {
            let replay = replay(&Loop { controller: controller.clone(), ..model.clone() }, signals)?;
            let from = replay.error.len() - (LAST * replay.error.len() as f64) as usize;
            let last = |x: &[f64]| x.get(from..).unwrap_or_default().to_vec();
            let misses_last = rms(&last(&replay.error)) / deviation(&last(&signals.u)).max(1e-300);
            let (misses, intervals) = (replay.relative, intervals.clone());
            misses.is_finite().then_some(Candidate { controller, intervals, misses, misses_last })
        })
        .collect();
    let least = judged.iter().map(|c| c.misses).fold(f64::INFINITY, f64::min);
    judged.into_iter().find(|c| c.misses <= 1.001 * least + 1e-9)
}

fn proportional(signals: &Signals, limits: Limits) -> Option<Fitted> {
    let e = error(signals);
    let solution = between_limits(signals, limits, &[&e])?;
    Some(pi(&solution, limits))
}

fn with_integral(signals: &Signals, limits: Limits) -> Option<Fitted> {
    let e = error(signals);
    let solution = between_limits(signals, limits, &[&e, &integral(&e, signals.sample_time_s)])?;
    Some(pi(&solution, limits))
}

fn pi(solution: &Solution, limits: Limits) -> Fitted {
    let number = |i: usize| solution.coefficients.get(i).copied().map_or(0.0, round);
    let (kp, ki) = (number(0), number(1));
    (Controller::Pi(Pi { kp, ki, limits, anti_windup: true }), intervals(&["kp", "ki"], solution))
}

fn with_derivative(signals: &Signals, limits: Limits) -> Option<Fitted> {
    let e = error(signals);
    let sum = integral(&e, signals.sample_time_s);
    let fit = |filter_s: f64| {
        let d = derivative(&signals.y, filter_s, signals.sample_time_s);
        between_limits(signals, limits, &[&e, &sum, &d])
    };
    let (from, to, count) = FILTERS;
    let ratio = libm::pow(to / from, 1.0 / (count - 1) as f64);
    let filters = (0..count).map(|i| signals.sample_time_s * from * libm::pow(ratio, i as f64));
    let mut best = std::iter::once(0.0)
        .chain(filters)
        .filter_map(|filter_s| Some((filter_s, fit(filter_s)?)))
        .min_by(|a, b| a.1.left_over.total_cmp(&b.1.left_over))?;
    let mut step = ratio;
    while best.0 > 0.0 && step > 1.000_01 {
        step = libm::sqrt(step);
        for filter_s in [best.0 * step, best.0 / step] {
            if let Some(solution) = fit(filter_s).filter(|s| s.left_over < best.1.left_over) {
                best = (filter_s, solution);
            }
        }
    }
    let (filter_s, solution) = best;
    let &[kp, ki, kd] = solution.coefficients.as_slice() else { return None };
    let (kp, ki, kd, derivative_filter_s) = (round(kp), round(ki), round(kd), round(filter_s));
    let law = Pid { kp, ki, kd, derivative_filter_s, limits, anti_windup: true };
    Some((Controller::Pid(law), intervals(&["kp", "ki", "kd"], &solution)))
}

/// `u = kv*(kp*e - v)`: a regression on e and v without a constant.
fn with_velocity(signals: &Signals, limits: Limits) -> Option<Fitted> {
    let e = error(signals);
    VelocityRule::ALL
        .iter()
        .filter_map(|(_, velocity)| {
            let back = if *velocity == VelocityRule::Backward { 1 } else { 2 };
            let mut regression = LeastSquares::new(2);
            for (n, u) in signals.u.iter().enumerate().skip(back) {
                let v =
                    (signals.y.get(n)? - signals.y.get(n - back)?) / (back as f64 * signals.sample_time_s);
                if inside(limits, *u) && v.is_finite() {
                    regression.add(*u, &[*e.get(n)?, -v, 0.0, 0.0]);
                }
            }
            let solution = regression.solve()?;
            let &[kv_kp, kv] = solution.coefficients.as_slice() else { return None };
            let law = PVelocity { kp: round(kv_kp / kv), kv: round(kv), velocity: *velocity, limits };
            let half_width = |i: usize| 1.96 * solution.errors.get(i).copied().unwrap_or(f64::NAN);
            let kp_half_width = half_width(0) / kv.abs() + (kv_kp / kv / kv).abs() * half_width(1);
            let intervals = vec![("kp", law.kp, kp_half_width), ("kv", law.kv, half_width(1))];
            let sound = law.kp.is_finite() && law.kv != 0.0;
            sound.then_some((solution.left_over, (Controller::PVelocity(law), intervals)))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, fitted)| fitted)
}

fn intervals(names: &[&'static str], solution: &Solution) -> Vec<(&'static str, f64, f64)> {
    let numbers = solution.coefficients.iter().zip(&solution.errors);
    names.iter().zip(numbers).map(|(name, (value, error))| (*name, round(*value), 1.96 * error)).collect()
}

/// u on the columns where it is between its limits; every stretch has a constant of its own, which stands for what the
/// integrator holds when it begins.
fn between_limits(signals: &Signals, limits: Limits, columns: &[&[f64]]) -> Option<Solution> {
    let mut regression = LeastSquares::new(columns.len());
    let usable = |n: &usize| {
        signals.u.get(*n).is_some_and(|u| inside(limits, *u))
            && columns.iter().all(|c| c.get(*n).is_some_and(|x| x.is_finite()))
    };
    let mut from = 0;
    while from < signals.len() {
        let length = (from..signals.len()).take_while(usable).count();
        if length >= STRETCH {
            let part = |column: &[f64]| centred(column.get(from..from + length).unwrap_or_default().to_vec());
            let centred: Vec<Vec<f64>> = columns.iter().map(|column| part(column)).collect();
            for (n, target) in part(&signals.u).iter().enumerate() {
                let mut row = [0.0; COLUMNS_MAX];
                row.iter_mut().zip(&centred).for_each(|(x, c)| *x = c.get(n).copied().unwrap_or(0.0));
                regression.add(*target, &row);
            }
        }
        from += length + 1;
    }
    regression.solve()
}

/// r - y, with the last y where one is missing, as the replay does it.
fn error(signals: &Signals) -> Vec<f64> {
    let mut last = signals.y.iter().copied().find(|y| y.is_finite()).unwrap_or(0.0);
    let step = |(r, y): (&f64, &f64)| {
        if y.is_finite() {
            last = *y;
        }
        r - last
    };
    signals.r.iter().zip(&signals.y).map(step).collect()
}

fn integral(e: &[f64], sample_time_s: f64) -> Vec<f64> {
    let mut sum = 0.0;
    e.iter()
        .map(|e| {
            sum += sample_time_s * e;
            sum
        })
        .collect()
}

/// What a derivative gain of one adds to u.
fn derivative(y: &[f64], filter_s: f64, sample_time_s: f64) -> Vec<f64> {
    let law = Pid {
        kp: 0.0,
        ki: 0.0,
        kd: 1.0,
        derivative_filter_s: filter_s,
        limits: Limits::NONE,
        anti_windup: true,
    };
    let (mut before, mut d) = (y.iter().copied().find(|y| y.is_finite()).unwrap_or(0.0), 0.0);
    y.iter()
        .map(|y| {
            let now = if y.is_finite() { *y } else { before };
            d = law.derivative(now - before, sample_time_s, 1.0, d);
            before = now;
            d
        })
        .collect()
}
