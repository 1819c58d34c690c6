//! The plant of a loop, made linear about a recording's motion: what the gains of the filter are computed from. Forces that depend on
//! position or speed enter by their mean slopes over the motion; friction, valves, clipping and dead time stay out.

use nalgebra::{DMatrix, DVector};

use crate::control_loop::Loop;
use crate::physics::{Context, Effect, Follows, Hook, Motion, Numbers, Term};
use crate::plant::zero_order_hold::discretise;
use crate::plant::{Output, Plant, Servo, StateSpace};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// One sample of the linear plant: `x+ = f x - g*load`, `y = c x`. Behind a slow sensor what that shows is the last state, and `c` shows it.
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
    /// How y is made of the plant's states behind a slow sensor; empty where the sensor shows y.
    behind: Vec<f64>,
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
        let part = Self { f: held.phi, g: held.gamma, c: plant.c, first_state, may_rest, behind: Vec::new() };
        let mut follow = effects.iter().filter(|effect| effect.hooks().contains(&Hook::Sense));
        // Of a mass that friction holds what a slow sensor shows is not followed.
        match (follow.next().and_then(|effect| effect.follows()), follow.next()) {
            (Some(follows), None) if !may_rest => Some(part.behind(follows)),
            _ => Some(part),
        }
    }

    /// The same behind a slow sensor.
    fn behind(self, Follows { new, before, stays }: Follows) -> Self {
        let n = self.order();
        let f = DMatrix::from_row_slice(n, n, &self.f);
        let row = DVector::from_column_slice(&self.c).transpose();
        let shown = new * &row * &f + before * &row;
        let mut wider = f.resize(n + 1, n + 1, 0.0);
        wider.view_mut((n, 0), (1, n)).copy_from(&shown);
        wider[(n, n)] = stays;
        let of_load = new * (row * DVector::from_column_slice(&self.g))[0];
        let g = self.g.into_iter().chain([of_load]).collect();
        let c = (0..=n).map(|i| if i == n { 1.0 } else { 0.0 }).collect();
        Self { f: wider.transpose().as_slice().to_vec(), g, c, behind: self.c, ..self }
    }

    /// The place of what a slow sensor shows among the states.
    pub fn shown_at(&self) -> Option<usize> {
        (!self.behind.is_empty()).then(|| self.order() - 1)
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.c.len()
    }

    /// The states' covariance at the start: that of y and of its first differences being known to these deviations. A slow sensor shows y there.
    pub fn start_covariance(&self, deviations: &[f64]) -> DMatrix<f64> {
        let all = self.order();
        let n = self.shown_at().unwrap_or(all);
        let f = DMatrix::from_row_slice(all, all, &self.f);
        let row = DVector::from_column_slice(if n < all { &self.behind } else { &self.c }).transpose();
        let of_plant = Self::start(&f.view((0, 0), (n, n)).into_owned(), row.clone(), deviations);
        if n == all {
            return of_plant;
        }
        let mut shows = DMatrix::identity(all, n);
        shows.set_row(n, &row);
        &shows * of_plant * shows.transpose()
    }

    fn start(f: &DMatrix<f64>, mut row: nalgebra::RowDVector<f64>, deviations: &[f64]) -> DMatrix<f64> {
        let n = f.nrows();
        let step = f - DMatrix::identity(n, n);
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

#[cfg(test)]
mod tests {
    use crate::control_loop::Loop;
    use crate::estimate::all_at_once::{LAG, answers, by_hand, placed};
    use crate::estimate::fit::Fit;
    use crate::physics::Term;
    use crate::simulate::{Start, replay};

    /// Behind a slow sensor: the covariance of all samples at once tells how much less likely they are there, what that sensor makes of a pulse being simulated; the filter tells the same.
    #[test]
    fn behind_a_slow_sensor_samples_are_as_likely_as_the_covariance_of_all_has_it() {
        let slow = Term::new("sensor_lag", &[("time_constant_s", 3.0)]).unwrap();
        let plain = placed(LAG, |_| 0.0);
        let text = format!("{LAG}[[physics]]\nkind = \"sensor_lag\"\ntime_constant_s = 3.0\n");
        let behind = placed(&text, |_| 0.0);
        let objective = |of: &crate::estimate::all_at_once::Placed| {
            Fit::at(&of.hypothesis, &of.point, &of.data).unwrap().objective()
        };
        // A plant that is nothing but a gain, and lets y through.
        let through = "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"recorded\"\n\
            [plant]\nkind = \"state-space\"\na = [[-1.0]]\nb = [0.0]\nc = [0.0]\nd = 1.0\n";
        let sensor = Loop { physics: vec![slow], ..Loop::parse(through, "a sensor").unwrap() };
        let seen = |y: &[f64]| {
            // What is held now is shown at the next sample.
            let held: Vec<f64> = y.iter().skip(1).copied().chain([0.0]).collect();
            replay(&sensor, &held, &[], 0, Some(&Start::default())).unwrap().y
        };
        let expected = by_hand(&plain, &answers(<[f64]>::to_vec), |_, _| 0.0)
            - by_hand(&behind, &answers(seen), |_, _| 0.0);
        let gained = objective(&plain) - objective(&behind);
        assert!(expected < -20.0 && (gained - expected).abs() < 0.01 * expected.abs(), "{gained} {expected}");
    }
}
