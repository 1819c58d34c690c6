//! The cascade of a position servo: `u = kv*(kp*(r - y) - v)`, clipped, with `v` differenced from `y`.

use super::Limits;

/// How the velocity follows from the samples of `y`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VelocityRule {
    /// `v = (y[n] - y[n-1])/Ts`.
    Backward,
    /// `v = (y[n] - y[n-2])/(2 Ts)`.
    Mean2,
}

impl VelocityRule {
    /// Both, as the loop file names them.
    pub const ALL: [(&'static str, Self); 2] = [("backward", Self::Backward), ("mean2", Self::Mean2)];
}

/// Parameters of the cascade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PVelocity {
    /// Position gain, 1/s.
    pub kp: f64,
    /// Velocity gain, unit of u times second per unit of y.
    pub kv: f64,
    /// How v follows from y.
    pub velocity: VelocityRule,
    /// Range of u.
    pub limits: Limits,
}

impl PVelocity {
    #[inline]
    pub(super) fn step(&self, r: f64, y: f64, before: [f64; 2], sample_time_s: f64, ratio: f64) -> f64 {
        let v = match self.velocity {
            VelocityRule::Backward => (y - before[0]) / sample_time_s,
            VelocityRule::Mean2 => (y - before[1]) / (2.0 * sample_time_s),
        };
        self.limits.clip(ratio * self.kv * (self.kp * (r - y) - v))
    }
}
