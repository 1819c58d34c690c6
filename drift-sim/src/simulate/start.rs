//! Where a run starts: the operating point that a recording begins at, or rest.

use nalgebra::{DMatrix, DVector};

use crate::Result;
use crate::control_loop::Loop;
use crate::controller::{Controller, Law};
use crate::plant::{Output, Plant, StateSpace};

/// An operating point to start a run from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Start {
    /// The true y, in its unit.
    pub y: f64,
    /// dy/dt, per second (a position servo's speed).
    pub velocity: f64,
    /// The u that has been held until now: what is in the dead time.
    pub u: f64,
    /// The controller's integrator, in the unit of u.
    pub integrator: f64,
    /// The plant's state in full, where it is known: a servo's position and speed, a tank's level, the states of
    /// a linear model. Without it, it is the state nearest to equilibrium that has this y under this u.
    pub state: Option<Vec<f64>>,
}

impl Start {
    /// At rest with u = 0: a first-order plant at its offset, all others at zero.
    pub fn rest(model: &Loop) -> Self {
        Self { y: model.plant.drive_offset(), ..Self::default() }
    }

    /// At equilibrium around a `y` that `u` holds, the integrator holding that u.
    pub fn held(y: f64, u: f64) -> Self {
        Self { y, u, integrator: u, ..Self::default() }
    }

    /// A first estimate from the beginning of a recording: y as measured, its rate from the first five samples, and
    /// the integrator with which the law gives the first u. What was held before is, for a law with an integrator,
    /// that integrator (the first u may be the kick of a reference's step), else the first u. Where that u lies at a limit, any
    /// integrator further out gives it, too: then it is the one with which u leaves the limits as recorded. An integrator that stands
    /// still is a bias, which all of the recording tells. Rest where the recording is empty.
    pub fn from_recording(model: &Loop, r: &[f64], y: &[f64], u: &[f64]) -> Self {
        let (Some(&r0), Some(&y0), Some(&u0)) = (r.first(), y.first(), u.first()) else {
            return Self::rest(model);
        };
        let span = y.len().clamp(1, 5) - 1;
        let far = y.get(span).copied().unwrap_or(y0);
        let velocity = if span == 0 { 0.0 } else { (far - y0) / (span as f64 * model.sample_time_s) };
        let mut law = Law::new(&model.controller, model.sample_time_s);
        law.start(0.0, y0, velocity, u0);
        let integrator = if stands_still(&model.controller) {
            let biases = r.iter().zip(y).zip(u).map(|((r, y), u)| law.integrator_for(*r, *y, *u));
            median(biases.filter(|bias| bias.is_finite()).collect())
        } else {
            at_a_limit(&law, r, y, u).unwrap_or_else(|| law.integrator_for(r0, y0, u0))
        };
        let u = match &model.controller {
            Controller::Pi(_) | Controller::Pid(_) => model.controller.limits().clip(integrator),
            Controller::PVelocity(_) | Controller::Recorded => u0,
        };
        Self { y: y0, velocity, u, integrator, state: None }
    }

    /// The plant's state: given, or the one nearest to equilibrium.
    ///
    /// # Errors
    /// The plant is still to be identified.
    pub fn state_for(&self, model: &Loop) -> Result<Vec<f64>> {
        if let Some(state) = &self.state {
            return Ok(state.clone());
        }
        Ok(match &model.plant {
            Plant::Servo(servo) if servo.output == Output::Position => vec![self.y, self.velocity],
            Plant::Servo(_) => vec![0.0, self.y],
            Plant::Tank(_) => vec![self.y],
            plant => {
                let drive = plant.drive_gain() * self.u + plant.drive_offset();
                plant.linear()?.map(|linear| near_equilibrium(&linear, self.y, drive)).unwrap_or_default()
            }
        })
    }
}

/// The integrator of a recording that begins with u at a limit, by the first u that lies at none: the law replayed from
/// here has it then. `None` where u begins between its limits, or never leaves them.
fn at_a_limit(law: &Law, r: &[f64], y: &[f64], u: &[f64]) -> Option<f64> {
    /// Replays; each brings an integrator that waits at the limit for a time nearer.
    const REPLAYS_MAX: usize = 8;
    let limits = law.stated().0.limits();
    let within = (limits.u_max - limits.u_min) * 1e-6;
    // The last digit of a recorded u may be rounded.
    let is_at_limit = |u: f64| u >= limits.u_max - within || u <= limits.u_min + within;
    let (&r0, &y0, &u0) = (r.first()?, y.first()?, u.first()?);
    if !within.is_finite() || !is_at_limit(u0) {
        return None;
    }
    let free = u.iter().position(|u| u.is_finite() && !is_at_limit(*u))?;
    let wanted = *u.get(free)?;
    let outermost = law.integrator_for(r0, y0, u0);
    let allowed = |integrator: f64| {
        if u0 <= limits.u_min + within { integrator.min(outermost) } else { integrator.max(outermost) }
    };
    let mut integrator = outermost;
    for _ in 0..REPLAYS_MAX {
        let mut replayed = law.clone();
        replayed.set_integrator(integrator);
        for (r, y) in r.iter().zip(y).take(free) {
            if r.is_finite() && y.is_finite() {
                replayed.step(*r, *y);
            }
        }
        let missed = replayed.integrator_for(*r.get(free)?, *y.get(free)?, wanted) - replayed.integrator();
        let moved = allowed(integrator + missed);
        if !moved.is_finite() || (moved - integrator).abs() <= within {
            break;
        }
        integrator = moved;
    }
    integrator.is_finite().then_some(integrator)
}

/// Whether the law's integrator never moves.
fn stands_still(controller: &Controller) -> bool {
    match controller {
        Controller::Pi(law) => law.ki == 0.0,
        Controller::Pid(law) => law.ki == 0.0 && law.kd == 0.0,
        Controller::PVelocity(_) | Controller::Recorded => false,
    }
}

/// The middle of values; 0 of none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The x with `c x + d q = y` that makes `|a x + b q|` smallest; of several, the smallest x.
fn near_equilibrium(plant: &StateSpace, y: f64, q: f64) -> Vec<f64> {
    let n = plant.order();
    let number = |row: &[f64], column: usize| row.get(column).copied().unwrap_or(0.0);
    let a = DMatrix::from_fn(n, n, |row, column| plant.a.get(row).map_or(0.0, |row| number(row, column)));
    let normal = a.transpose() * &a;
    let forced = a.transpose() * DVector::from_fn(n, |row, _| -number(&plant.b, row) * q);
    // Least squares under one equation: the stationary point of its Lagrangian. The second try holds states that
    // nothing else determines near zero.
    let weight = normal.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let attempt = |regular: f64| {
        let system = DMatrix::from_fn(n + 1, n + 1, |row, column| match (row < n, column < n) {
            (true, true) => normal[(row, column)] + if row == column { regular * weight } else { 0.0 },
            (true, false) => number(&plant.c, row),
            (false, true) => number(&plant.c, column),
            (false, false) => 0.0,
        });
        let right = DVector::from_fn(n + 1, |row, _| if row < n { forced[row] } else { y - plant.d * q });
        let x = system.clone().full_piv_lu().solve(&right)?;
        let left_over = (&system * &x - &right).amax();
        (left_over <= 1e-9 * (1.0 + right.amax())).then_some(x)
    };
    let solution = attempt(0.0).or_else(|| attempt(1e-12));
    solution.map_or_else(|| vec![0.0; n], |x| x.iter().take(n).copied().collect())
}
