//! A tank, by the classical Runge-Kutta rule (fourth order while the level stays off zero, where the root is singular: filling from empty is good to about 1e-3 of the level
//! reached in a sample). In sub-steps where a sample is long beside the tank's own time constant, else in one step.

use crate::physics::Motion;
use crate::plant::Tank;

/// Part of the tank's own time constant, `2 area sqrt(level)/outflow`, that a sample taken in one step lasts at most. The rule itself is then good to 1e-11; a drive that changes within the
/// sample is taken at its mean, which is off by half the product of this part's square and the two parts of the sample: 5e-5 of what the change comes to.
const ONE_STEP: f64 = 0.02;

#[derive(Debug, Clone)]
pub(super) struct TankBody {
    pub tank: Tank,
    pub level: [f64; 1],
}

impl TankBody {
    /// dy/dt under the drive held until now.
    #[inline]
    pub fn rate(&self, held: f64) -> f64 {
        self.tank.rate(self.level[0], held)
    }

    /// Whether a sample is short beside the tank's time constant.
    #[inline]
    pub fn is_slow(&self, sample_time_s: f64) -> bool {
        let (drained, kept) = (self.tank.outflow * sample_time_s, 2.0 * ONE_STEP * self.tank.area);
        drained * drained < kept * kept * self.level[0]
    }

    pub fn substep(&mut self, drive: f64, h: f64, force: impl Fn(Motion) -> f64) {
        let rate =
            |level: f64| self.tank.rate(level, drive + force(Motion { position: level, velocity: 0.0 }));
        let [level] = self.level;
        let k1 = rate(level);
        let k2 = rate(level + 0.5 * h * k1);
        let k3 = rate(level + 0.5 * h * k2);
        let k4 = rate(level + h * k3);
        let after = level + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        // Not `max`: it would turn a diverged level into zero.
        self.level = [if after < 0.0 { 0.0 } else { after }];
    }
}
