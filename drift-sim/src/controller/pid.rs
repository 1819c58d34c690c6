//! PID: the PI law plus a derivative on `y` (not on `e`: a set-point step gives no kick) behind a first-order
//! filter, `derivative_filter_s*dD/dt + D = -kd*dy/dt`, by backward differences.

use super::{Limits, integrate};

/// Parameters of the PID law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pid {
    /// Proportional gain, unit of u per unit of y.
    pub kp: f64,
    /// Integral gain, unit of u per unit of y and second.
    pub ki: f64,
    /// Derivative gain, unit of u times second per unit of y.
    pub kd: f64,
    /// Time constant of the derivative's filter in seconds; 0 for none.
    pub derivative_filter_s: f64,
    /// Range of u; the integrator stops at it, unless `anti_windup` is off.
    pub limits: Limits,
    /// Whether the integrator waits while u is clipped.
    pub anti_windup: bool,
}

impl Pid {
    #[inline]
    pub(crate) fn derivative(&self, dy: f64, sample_time_s: f64, ratio: f64, before: f64) -> f64 {
        (self.derivative_filter_s * before - ratio * self.kd * dy)
            / (self.derivative_filter_s + sample_time_s)
    }

    #[inline]
    pub(super) fn step(&self, e: f64, sample_time_s: f64, ratio: f64, d: f64, integrator: &mut f64) -> f64 {
        let change = ratio * self.ki * sample_time_s * e;
        integrate(self.limits, self.anti_windup, change, ratio * self.kp * e + d, integrator)
    }
}
