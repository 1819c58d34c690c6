//! PI: `I[n] = I[n-1] + ki*Ts*e[n]`, `u[n] = kp*e[n] + I[n]`, clipped; while clipped, `I` does not move further out.

use super::{Limits, integrate};

/// Parameters of the PI law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pi {
    /// Proportional gain, unit of u per unit of y; negative for a reverse-acting loop.
    pub kp: f64,
    /// Integral gain, unit of u per unit of y and second.
    pub ki: f64,
    /// Range of u; the integrator stops at it, unless `anti_windup` is off.
    pub limits: Limits,
    /// Whether the integrator waits while u is clipped.
    pub anti_windup: bool,
}

impl Pi {
    #[inline]
    pub(crate) fn step(&self, e: f64, sample_time_s: f64, ratio: f64, integrator: &mut f64) -> f64 {
        let change = ratio * self.ki * sample_time_s * e;
        integrate(self.limits, self.anti_windup, change, ratio * self.kp * e, integrator)
    }
}
