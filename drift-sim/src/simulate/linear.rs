//! A linear plant with forces that depend on its output: sub-steps that are exact for the linear part and take the
//! force at the middle of the sub-step (second order in the sub-step).

use super::batch::LinearStep;
use crate::Result;
use crate::physics::Motion;
use crate::plant::StateSpace;
use crate::plant::zero_order_hold::discretise;

#[derive(Debug, Clone)]
pub(super) struct Linear {
    phi: Vec<f64>,
    gamma: Vec<f64>,
    /// Output after half a sub-step, from the state and from the drive.
    half_state: Vec<f64>,
    half_drive: f64,
    c: Vec<f64>,
    d: f64,
    /// dy/dt from the state and from the drive.
    rate_state: Vec<f64>,
    rate_drive: f64,
    pub x: Vec<f64>,
    next: Vec<f64>,
}

/// The sum of products.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Linear {
    pub fn new(plant: &StateSpace, substep_s: f64) -> Result<Self> {
        let n = plant.order();
        let whole = discretise(plant, substep_s)?;
        let half = discretise(plant, 0.5 * substep_s)?;
        let column = |i: usize| half.phi.iter().skip(i).step_by(n.max(1)).copied().collect::<Vec<_>>();
        Ok(Self {
            half_state: (0..n).map(|i| dot(&plant.c, &column(i))).collect(),
            half_drive: dot(&plant.c, &half.gamma) + plant.d,
            phi: whole.phi,
            gamma: whole.gamma,
            c: plant.c.clone(),
            d: plant.d,
            rate_state: plant.rate_of_output().0,
            rate_drive: plant.rate_of_output().1,
            x: vec![0.0; n],
            next: vec![0.0; n],
        })
    }

    /// Its step, where it has N states.
    pub fn step<const N: usize>(&self) -> Option<LinearStep<N>> {
        let of = |values: &[f64]| -> Option<[f64; N]> { values.try_into().ok() };
        let mut phi = [[0.0; N]; N];
        for (row, values) in phi.iter_mut().zip(self.phi.chunks_exact(N.max(1))) {
            *row = of(values)?;
        }
        Some(LinearStep {
            phi,
            older: [0.0; N],
            newer: of(&self.gamma)?,
            c: of(&self.c)?,
            d: self.d,
            rate_state: of(&self.rate_state)?,
            rate_drive: self.rate_drive,
            middle_state: of(&self.half_state)?,
            middle_drive: self.half_drive,
        })
    }

    #[inline]
    pub fn output(&self, held: f64) -> f64 {
        dot(&self.c, &self.x) + self.d * held
    }

    /// dy/dt under the drive held until now, without the forces.
    #[inline]
    pub fn rate(&self, held: f64) -> f64 {
        dot(&self.rate_state, &self.x) + self.rate_drive * held
    }

    /// One sub-step under `drive` and the force that depends on the output.
    pub fn substep(&mut self, drive: f64, force: impl Fn(Motion) -> f64) {
        let at = |position: f64| drive + force(Motion { position, velocity: 0.0 });
        let middle = dot(&self.half_state, &self.x) + self.half_drive * at(self.output(drive));
        let q = at(middle);
        let n = self.x.len();
        for ((next, row), gamma) in self.next.iter_mut().zip(self.phi.chunks_exact(n.max(1))).zip(&self.gamma)
        {
            *next = dot(row, &self.x) + gamma * q;
        }
        std::mem::swap(&mut self.x, &mut self.next);
    }
}
