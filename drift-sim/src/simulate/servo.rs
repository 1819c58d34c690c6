//! A mass with dry friction, held to the exact solution: under a constant drive, viscous friction and Coulomb
//! friction the motion is piecewise exponential; the moment of stopping follows in closed form, and a mass at rest stays
//! exactly there while the drive is within the friction (no regularised sign, no creep). Forces and friction that vary
//! along the way are taken at the middle of the sub-step (second order in the sub-step).

use crate::physics::{Motion, Numbers};
use crate::plant::Output;

#[derive(Debug, Clone)]
pub(super) struct ServoBody {
    pub(super) inertia: f64,
    pub(super) viscous: f64,
    pub(super) output: Output,
    h: f64,
    /// Of a whole sub-step.
    pub(super) whole: Decay,
    /// dv/dt over the last sub-step.
    acceleration: f64,
    /// Dry friction less the force against it over the last sub-step, in the direction of the motion where that ended.
    spare: f64,
    /// Position and speed.
    pub x: [f64; 2],
}

/// What acts on the mass over a sub-step.
pub(super) struct Acting<F, D> {
    /// The actuator's force.
    pub actuator: f64,
    /// All other forces that are constant over the sub-step.
    pub outside: f64,
    /// Forces that depend on the motion.
    pub force: F,
    /// Dry friction available: (direction, speed, transmitted force).
    pub friction: D,
    /// Whether force or friction vary along the way.
    pub varying: bool,
}

/// The exponential over a time tau, z = viscous*tau/inertia: exp(-z), (1 - exp(-z))/z and (1 - the latter)/z.
#[derive(Debug, Clone, Copy)]
pub(super) struct Decay {
    pub(super) left: f64,
    pub(super) first: f64,
    pub(super) second: f64,
}

impl Decay {
    fn new(z: f64) -> Self {
        if z < 1e-3 {
            // The quotients cancel near zero; five terms are exact to rounding here.
            let first = 1.0 - z / 2.0 * (1.0 - z / 3.0 * (1.0 - z / 4.0 * (1.0 - z / 5.0)));
            let second = 0.5 * (1.0 - z / 3.0 * (1.0 - z / 4.0 * (1.0 - z / 5.0 * (1.0 - z / 6.0))));
            return Self { left: libm::exp(-z), first, second };
        }
        let first = -libm::expm1(-z) / z;
        Self { left: libm::exp(-z), first, second: (1.0 - first) / z }
    }
}

impl ServoBody {
    /// The force that lacks for it to be moved, where it is at rest: exactly at rest, as it is left where friction stops it.
    pub fn lacks(&self) -> Option<f64> {
        (self.x[1] == 0.0).then_some(self.spare)
    }

    pub fn new(numbers: &Numbers, output: Output, substep_s: f64) -> Self {
        let Numbers { inertia, viscous, .. } = *numbers;
        Self {
            inertia,
            viscous,
            output,
            h: substep_s,
            whole: Decay::new(viscous * substep_s / inertia),
            acceleration: 0.0,
            spare: 0.0,
            x: [0.0; 2],
        }
    }

    /// Its speed was changing as the other's was.
    pub fn keeps_on_from(&mut self, other: &Self) {
        self.acceleration = other.acceleration;
    }

    #[inline]
    pub fn output(&self) -> f64 {
        match self.output {
            Output::Position => self.x[0],
            Output::Speed => self.x[1],
        }
    }

    /// dy/dt, of a speed as it was over the last sub-step.
    #[inline]
    pub fn rate(&self) -> f64 {
        match self.output {
            Output::Position => self.x[1],
            Output::Speed => self.acceleration,
        }
    }

    /// One sub-step.
    #[inline]
    pub fn substep<F: Fn(Motion) -> f64, D: Fn(f64, f64, f64) -> f64>(&mut self, acting: &Acting<F, D>) {
        let before = self.x[1];
        self.move_on(acting);
        self.acceleration = (self.x[1] - before) / self.h;
    }

    #[inline]
    fn move_on<F: Fn(Motion) -> f64, D: Fn(f64, f64, f64) -> f64>(&mut self, acting: &Acting<F, D>) {
        let [x, v] = self.x;
        let outside = |position, velocity| acting.outside + (acting.force)(Motion { position, velocity });
        let mut f = outside(x, v);
        let mut speed = v.abs();
        if acting.varying {
            let (middle_x, middle_v) = self.middle(f, acting);
            f = outside(middle_x, middle_v);
            speed = middle_v.abs();
        }
        let transmitted = 0.5 * (acting.actuator - f);
        let q = acting.actuator + f;
        let mut remaining = self.h;
        // Three passes at most: to a stop, on from rest, and the end.
        for _ in 0..3 {
            let v = self.x[1];
            let direction = if v != 0.0 { v.signum() } else { q.signum() };
            if v == 0.0 {
                let spare = (acting.friction)(direction, 0.0, transmitted) - q.abs();
                if remaining == self.h {
                    self.spare = spare;
                }
                if spare >= 0.0 {
                    return;
                }
            }
            let net = q - direction * (acting.friction)(direction, speed, transmitted);
            let decay = if remaining == self.h { self.whole } else { self.decay(remaining) };
            let after = v * decay.left + net / self.inertia * remaining * decay.first;
            if v == 0.0 || after * direction >= 0.0 || after.is_nan() {
                self.travel(net, remaining, decay);
                self.x[1] = after;
                return;
            }
            let stop = self.time_to_stop(v, net).min(remaining);
            self.travel(net, stop, self.decay(stop));
            self.x[1] = 0.0;
            self.spare = (acting.friction)(direction, 0.0, transmitted) - q.abs();
            speed = 0.0;
            remaining -= stop;
        }
    }

    /// Position and speed at the middle of the sub-step under the forces at its beginning; the speed does not
    /// change its sign on the way.
    fn middle<F: Fn(Motion) -> f64, D: Fn(f64, f64, f64) -> f64>(
        &self,
        f: f64,
        acting: &Acting<F, D>,
    ) -> (f64, f64) {
        let [x, v] = self.x;
        let q = acting.actuator + f;
        let direction = if v != 0.0 { v.signum() } else { q.signum() };
        let budget = (acting.friction)(direction, v.abs(), 0.5 * (acting.actuator - f));
        if v == 0.0 && q.abs() <= budget {
            return (x, v);
        }
        let acceleration = (q - direction * budget - self.viscous * v) / self.inertia;
        let middle = v + 0.5 * self.h * acceleration;
        let middle = if middle * direction < 0.0 { 0.0 } else { middle };
        (x + 0.25 * self.h * (v + middle), middle)
    }

    fn decay(&self, tau: f64) -> Decay {
        Decay::new(self.viscous * tau / self.inertia)
    }

    /// Moves by `v tau first + net/inertia tau^2 second`.
    #[inline]
    fn travel(&mut self, net: f64, tau: f64, decay: Decay) {
        self.x[0] += self.x[1] * tau * decay.first + net / self.inertia * tau * tau * decay.second;
    }

    /// When a speed reaches zero under a net force against it: `log(1 - viscous v/net)*inertia/viscous`.
    fn time_to_stop(&self, v: f64, net: f64) -> f64 {
        let frictionless = -self.inertia * v / net;
        let z = self.viscous * frictionless / self.inertia;
        if z < 1e-9 { frictionless } else { frictionless * libm::log1p(z) / z }
    }
}
