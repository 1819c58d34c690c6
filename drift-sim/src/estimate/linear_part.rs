//! The plant of a loop, made linear about a recording's motion: what the gains of the filter are computed from. Forces that depend on
//! position or speed enter by their mean slopes over the motion; friction, valves, clipping and dead time stay out.

use nalgebra::{DMatrix, DVector};

use crate::control_loop::Loop;
use crate::physics::{Context, Effect, Hook, Motion, Numbers, Term};
use crate::plant::zero_order_hold::discretise;
use crate::plant::{Output, Plant, Servo, StateSpace};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// One sample of the linear plant: `x+ = f x - g*load`, `y = c x`.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearPart {
    /// n rows of n numbers, row by row.
    pub f: Vec<f64>,
    /// What a load held over the sample takes from the states.
    pub g: Vec<f64>,
    /// How y is made of the states.
    pub c: Vec<f64>,
    /// Which of the simulation's states these are.
    pub first_state: usize,
    /// Whether dry friction may hold the plant: a mass, its speed being the last state.
    pub may_rest: bool,
}

impl LinearPart {
    /// The plant at time `t`, with the terms that have begun by then; `None` where its numbers can't be computed with.
    pub fn of(model: &Loop, t: f64, motions: &[Motion]) -> Option<Self> {
        let effects = at_work(model, t);
        let (mut plant, first_state) = plant(model, &effects, motions)?;
        let (along_position, along_speed) = slopes(&effects, motions);
        add_feedback(&mut plant, &model.plant, along_position, along_speed);
        let held = discretise(&plant, model.sample_time_s).ok()?;
        let is_dry = |hook: &Hook| matches!(hook, Hook::Friction | Hook::VaryingFriction);
        let rubs = effects.iter().any(|effect| effect.hooks().iter().any(is_dry));
        let may_rest = rubs && matches!(model.plant, Plant::Servo(_));
        Some(Self { f: held.phi, g: held.gamma, c: plant.c, first_state, may_rest })
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.c.len()
    }

    /// The states' covariance at the start: that of y and of its first differences being known to these deviations.
    pub fn start_covariance(&self, deviations: &[f64]) -> DMatrix<f64> {
        let n = self.order();
        let step = DMatrix::from_row_slice(n, n, &self.f) - DMatrix::identity(n, n);
        let mut row = DVector::from_column_slice(&self.c).transpose();
        let mut seen = DMatrix::zeros(n, n);
        for k in 0..n {
            let deviation = deviations.get(k).or(deviations.last()).copied().unwrap_or(1.0);
            seen.set_row(k, &(&row / deviation.max(1e-300)));
            row = &row * &step;
        }
        let size = seen.amax();
        match seen.pseudo_inverse(1e-12 * size) {
            Ok(inverse) => &inverse * inverse.transpose(),
            Err(_) => DMatrix::identity(n, n),
        }
    }
}

/// The effects of the terms that have begun.
fn at_work(model: &Loop, t: f64) -> Vec<Box<dyn Effect>> {
    let begun = model.physics.iter().filter(|term| term.onset_s <= t);
    begun.map(|term| effect(model, term)).collect()
}

/// A term at work in a loop.
pub(crate) fn effect(model: &Loop, term: &Term) -> Box<dyn Effect> {
    let context = Context {
        sample_time_s: model.sample_time_s,
        substep_s: model.sample_time_s,
        plant: &model.plant,
        onset_s: term.onset_s,
        spans: &term.spans,
        noise: ChaCha8Rng::seed_from_u64(0),
    };
    (term.kind.effect)(&term.parameters, &context)
}

/// The plant from drive to y with its numbers as the effects change them, and the first of the simulation's states in it.
fn plant(model: &Loop, effects: &[Box<dyn Effect>], motions: &[Motion]) -> Option<(StateSpace, usize)> {
    match &model.plant {
        Plant::Servo(servo) => {
            let mut numbers = Numbers {
                inertia: servo.inertia,
                viscous: servo.viscous,
                law_ratio: 1.0,
                delay_s: 0.0,
                sensor_noise: 0.0,
            };
            let changing = effects.iter().filter(|effect| effect.hooks().contains(&Hook::Numbers));
            changing.for_each(|effect| effect.numbers(&mut numbers));
            let servo = Servo { inertia: numbers.inertia, viscous: numbers.viscous, ..*servo };
            let rate = -servo.viscous / servo.inertia;
            if servo.output == Output::Speed {
                let (a, b) = (vec![vec![rate]], vec![1.0 / servo.inertia]);
                return Some((StateSpace { a, b, c: vec![1.0], d: 0.0 }, 1));
            }
            let a = vec![vec![0.0, 1.0], vec![0.0, rate]];
            Some((StateSpace { a, b: vec![0.0, 1.0 / servo.inertia], c: vec![1.0, 0.0], d: 0.0 }, 0))
        }
        Plant::Tank(tank) => {
            let level = motions.iter().map(|m| m.position).sum::<f64>() / motions.len().max(1) as f64;
            let slope = 0.5 * tank.outflow / libm::sqrt(level.max(1e-6));
            let (a, b) = (vec![vec![-slope / tank.area]], vec![1.0 / tank.area]);
            Some((StateSpace { a, b, c: vec![1.0], d: 0.0 }, 0))
        }
        plant => Some((plant.linear().ok()??, 0)),
    }
}

/// Mean slopes of the effects' forces over the motions: along position and along speed, by least squares.
fn slopes(effects: &[Box<dyn Effect>], motions: &[Motion]) -> (f64, f64) {
    let forces: Vec<&Box<dyn Effect>> =
        effects.iter().filter(|effect| effect.hooks().contains(&Hook::Force)).collect();
    if forces.is_empty() || motions.len() < 4 {
        return (0.0, 0.0);
    }
    let n = motions.len() as f64;
    let mean = |of: &dyn Fn(&Motion) -> f64| motions.iter().map(of).sum::<f64>() / n;
    let force = |m: &Motion| forces.iter().map(|effect| effect.force(*m)).sum::<f64>();
    let (mx, mv, mf) = (mean(&|m| m.position), mean(&|m| m.velocity), mean(&force));
    let product = |a: &dyn Fn(&Motion) -> f64, b: &dyn Fn(&Motion) -> f64| {
        motions.iter().map(|m| a(m) * b(m)).sum::<f64>()
    };
    let (x, v, f) = (|m: &Motion| m.position - mx, |m: &Motion| m.velocity - mv, |m: &Motion| force(m) - mf);
    let (xx, vv, xv) = (product(&x, &x), product(&v, &v), product(&x, &v));
    let (xf, vf) = (product(&x, &f), product(&v, &f));
    let determinant = xx * vv - xv * xv;
    if determinant > 1e-9 * xx * vv {
        ((xf * vv - vf * xv) / determinant, (vf * xx - xf * xv) / determinant)
    } else if xx > 0.0 {
        (xf / xx, 0.0)
    } else {
        (0.0, 0.0)
    }
}

/// Forces fed back to the drive: along y, and along the speed of a servo.
fn add_feedback(plant: &mut StateSpace, model: &Plant, along_position: f64, along_speed: f64) {
    let back: Vec<f64> = match model {
        Plant::Servo(servo) if servo.output == Output::Speed => vec![along_speed],
        Plant::Servo(_) => vec![along_position, along_speed],
        _ => plant.c.iter().map(|c| along_position * c).collect(),
    };
    for (row, b) in plant.a.iter_mut().zip(&plant.b) {
        for (entry, back) in row.iter_mut().zip(&back) {
            *entry += b * back;
        }
    }
}
