//! The shortest path, of the paper's loop and its like: a PI law, a plant that shows its first state and is driven by u itself, no dead
//! time. From the straight path's operations those are left out that add a zero or multiply by one, which changes no number but
//! a zero's sign. A sample in which such a sign, a limit or an infinity could matter is handed to the straight path, so the numbers
//! are the same to the last bit.

use super::exact::Exact;
use crate::controller::{Controller, Law};

/// A PI law within its limits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Direct {
    /// u per unit of the error.
    kp: f64,
    /// What the integrator moves by per unit of the error.
    ki: f64,
    /// Between these u is neither clipped nor infinite.
    lowest: f64,
    highest: f64,
}

/// What a sample leaves behind.
pub(super) struct Sampled<const N: usize> {
    pub y: f64,
    pub u: f64,
    pub integrator: f64,
    pub x: [f64; N],
}

impl Direct {
    /// `None` of a law that is no PI.
    pub fn of(law: &Law, sample_time_s: f64) -> Option<Self> {
        let (Controller::Pi(pi), ratio) = law.stated() else { return None };
        let (lowest, highest) = (pi.limits.u_min.max(f64::MIN), pi.limits.u_max.min(f64::MAX));
        Some(Self { kp: ratio * pi.kp, ki: ratio * pi.ki * sample_time_s, lowest, highest })
    }

    /// One sample from a state and an integrator on; `None` where the straight path has to take it.
    #[inline(always)]
    pub fn sample<const N: usize>(
        &self,
        plant: &Exact<N>,
        x: &[f64; N],
        integrator: f64,
        r: f64,
    ) -> Option<Sampled<N>> {
        let y = *x.first()?;
        let e = r - y;
        let integrator = integrator + self.ki * e;
        let u = self.kp * e + integrator;
        let x = plant.after(x, u)?;
        let is_usual = y != 0.0 && u != 0.0 && u >= self.lowest && u <= self.highest;
        is_usual.then_some(Sampled { y, u, integrator, x })
    }
}
