//! Control laws, sample by sample: what `u` follows from `r` and the measured `y`.
//!
//! The laws are algebra on measured signals, so the same code closes the loop in a simulation and replays a
//! recorded controller.

mod p_velocity;
mod pi;
mod pid;

pub use p_velocity::{PVelocity, VelocityRule};
pub use pi::Pi;
pub use pid::Pid;

/// The range of `u`, in its own unit; infinite where there is no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lowest `u`, u-unit.
    pub u_min: f64,
    /// Highest `u`, u-unit.
    pub u_max: f64,
}

impl Limits {
    /// No limit.
    pub const NONE: Self = Self { u_min: f64::NEG_INFINITY, u_max: f64::INFINITY };

    /// `u` inside the limits; a value that is not a number stays one, so that a diverged loop is seen.
    #[inline]
    pub fn clip(self, u: f64) -> f64 {
        if u > self.u_max {
            self.u_max
        } else if u < self.u_min {
            self.u_min
        } else {
            u
        }
    }
}

/// A control law with its parameters, as the loop file states it.
#[derive(Debug, Clone, PartialEq)]
pub enum Controller {
    /// `kind = "pi"`.
    Pi(Pi),
    /// `kind = "pid"`.
    Pid(Pid),
    /// `kind = "p-velocity"`.
    PVelocity(PVelocity),
    /// `kind = "recorded"`: the law is unknown, `u` is taken as recorded.
    Recorded,
}

impl Controller {
    /// The names of all kinds, as in the loop file.
    pub const KINDS: [&'static str; 4] = ["pi", "pid", "p-velocity", "recorded"];

    /// The name of this kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Pi(_) => "pi",
            Self::Pid(_) => "pid",
            Self::PVelocity(_) => "p-velocity",
            Self::Recorded => "recorded",
        }
    }

    /// Its gains and time constants by their keys in the loop file.
    pub fn gains(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Pi(law) => vec![("kp", law.kp), ("ki", law.ki)],
            Self::Pid(law) => vec![
                ("kp", law.kp),
                ("ki", law.ki),
                ("kd", law.kd),
                ("derivative_filter_s", law.derivative_filter_s),
            ],
            Self::PVelocity(law) => vec![("kp", law.kp), ("kv", law.kv)],
            Self::Recorded => Vec::new(),
        }
    }

    /// The limits of `u`.
    pub fn limits(&self) -> Limits {
        match self {
            Self::Pi(law) => law.limits,
            Self::Pid(law) => law.limits,
            Self::PVelocity(law) => law.limits,
            Self::Recorded => Limits::NONE,
        }
    }

    /// The same law with these limits; an unknown one has none to set.
    #[must_use]
    pub fn with_limits(mut self, limits: Limits) -> Self {
        match &mut self {
            Self::Pi(law) => law.limits = limits,
            Self::Pid(law) => law.limits = limits,
            Self::PVelocity(law) => law.limits = limits,
            Self::Recorded => {}
        }
        self
    }
}

/// A controller at work: its law and its memory.
#[derive(Debug, Clone)]
pub struct Law {
    controller: Controller,
    sample_time_s: f64,
    /// All gains times this: 1, unless a `controller_gain` term says otherwise.
    ratio: f64,
    /// `I` of pi and pid, in the unit of `u`.
    integrator: f64,
    /// The filtered derivative action of pid, in the unit of `u`.
    derivative: f64,
    /// `y[n-1]` and `y[n-2]`.
    before: [f64; 2],
    /// What a recorded controller holds.
    held: f64,
}

impl Law {
    /// The law at rest: integrator at zero, `y` zero before the first sample.
    pub fn new(controller: &Controller, sample_time_s: f64) -> Self {
        let controller = controller.clone();
        Self {
            controller,
            sample_time_s,
            ratio: 1.0,
            integrator: 0.0,
            derivative: 0.0,
            before: [0.0; 2],
            held: 0.0,
        }
    }

    /// Starts from an operating point: the integrator (unit of `u`), and `y` with its rate (per second), from
    /// which the two samples before the first follow.
    pub fn start(&mut self, integrator: f64, y: f64, velocity: f64, u: f64) {
        self.integrator = integrator;
        self.derivative = match &self.controller {
            Controller::Pid(law) => -law.kd * velocity,
            _ => 0.0,
        };
        self.before = [y - velocity * self.sample_time_s, y - 2.0 * velocity * self.sample_time_s];
        self.held = u;
    }

    /// From now on all gains are the stated ones times `ratio`; the integrator stays where it is.
    pub fn set_ratio(&mut self, ratio: f64) {
        self.ratio = ratio;
    }

    /// Sets the integrator of pi and pid, in the unit of `u`.
    pub(crate) fn set_integrator(&mut self, integrator: f64) {
        self.integrator = integrator;
    }

    /// The law as stated, and the ratio that its gains are multiplied with.
    pub(crate) fn stated(&self) -> (Controller, f64) {
        (self.controller.clone(), self.ratio)
    }

    /// The integrator of pi and pid, in the unit of `u`; 0 for the others.
    #[inline]
    pub fn integrator(&self) -> f64 {
        self.integrator
    }

    /// Takes over a sample of a pi that was computed elsewhere: the measured `y`, and where the integrator went.
    #[inline]
    pub(crate) fn went_on(&mut self, y: f64, integrator: f64) {
        self.before = [y, self.before[0]];
        self.integrator = integrator;
    }

    /// The integrator with which the first sample's `u` would come out as given: how a recording starts it.
    /// Where that `u` is at a limit, it is the integrator that just reaches it.
    pub fn integrator_for(&self, r: f64, y: f64, u: f64) -> f64 {
        let e = r - y;
        match &self.controller {
            Controller::Pi(law) => u - self.ratio * (law.kp + law.ki * self.sample_time_s) * e,
            Controller::Pid(law) => {
                u - self.ratio * (law.kp + law.ki * self.sample_time_s) * e - self.derivative
            }
            Controller::PVelocity(_) | Controller::Recorded => 0.0,
        }
    }

    /// One sample: `u` from `r` and the measured `y`, all in their own units. A recorded controller holds the
    /// `u` that it was started with.
    #[inline]
    pub fn step(&mut self, r: f64, y: f64) -> f64 {
        let u = match &self.controller {
            Controller::Pi(law) => law.step(r - y, self.sample_time_s, self.ratio, &mut self.integrator),
            Controller::Pid(law) => {
                self.derivative =
                    law.derivative(y - self.before[0], self.sample_time_s, self.ratio, self.derivative);
                law.step(r - y, self.sample_time_s, self.ratio, self.derivative, &mut self.integrator)
            }
            Controller::PVelocity(law) => law.step(r, y, self.before, self.sample_time_s, self.ratio),
            Controller::Recorded => self.held,
        };
        self.before = [y, self.before[0]];
        u
    }
}

/// The integrator's rule that pi and pid share: it moves by `change`, except further out while the sum of it
/// and the `rest` of the law is beyond a limit. Gives the clipped sum.
#[inline]
fn integrate(limits: Limits, anti_windup: bool, change: f64, rest: f64, integrator: &mut f64) -> f64 {
    let moved = *integrator + change;
    let wanted = rest + moved;
    let outward = (wanted > limits.u_max && change > 0.0) || (wanted < limits.u_min && change < 0.0);
    if anti_windup && outward {
        return limits.clip(rest + *integrator);
    }
    *integrator = moved;
    limits.clip(wanted)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pi(kp: f64, ki: f64, limits: Limits, anti_windup: bool) -> Controller {
        Controller::Pi(Pi { kp, ki, limits, anti_windup })
    }

    #[test]
    fn pi_on_a_constant_error_is_the_straight_line_of_its_formula() {
        let mut law = Law::new(&pi(2.0, 3.0, Limits::NONE, true), 0.5);
        for n in 1..=10 {
            assert!((law.step(1.0, 0.5) - (2.0 * 0.5 + 3.0 * 0.5 * 0.5 * f64::from(n))).abs() < 1e-12);
        }
    }

    #[test]
    fn the_integrator_stops_at_the_limit_and_leaves_it_at_once() {
        let limits = Limits { u_min: -1.0, u_max: 1.0 };
        let mut held = Law::new(&pi(0.1, 1.0, limits, true), 0.1);
        let mut wound = Law::new(&pi(0.1, 1.0, limits, false), 0.1);
        for _ in 0..1000 {
            assert!(held.step(1.0, 0.0) <= 1.0 && wound.step(1.0, 0.0) <= 1.0);
        }
        assert!(held.integrator() <= 1.0, "{}", held.integrator());
        assert!((wound.integrator() - 100.0).abs() < 1e-9);
        assert!(held.step(-1.0, 0.0) < 1.0);
        assert_eq!(wound.step(-1.0, 0.0), 1.0);
    }

    #[test]
    fn a_reverse_acting_pi_winds_up_no_more_than_a_direct_one() {
        let limits = Limits { u_min: -1.0, u_max: 1.0 };
        let mut law = Law::new(&pi(-0.1, -1.0, limits, true), 0.1);
        for _ in 0..1000 {
            law.step(-1.0, 0.0);
        }
        assert!(law.integrator() <= 1.0);
    }

    #[test]
    fn the_derivative_acts_on_y_alone_and_settles_with_its_filter() {
        let limits = Limits::NONE;
        let pid = Pid { kp: 0.0, ki: 0.0, kd: 2.0, derivative_filter_s: 0.1, limits, anti_windup: true };
        let mut law = Law::new(&Controller::Pid(pid), 0.01);
        // y rises by 3 a second: the derivative action ends at -kd*3, whatever r does.
        let mut u = 0.0;
        for n in 1..400 {
            u = law.step(f64::from(n % 7), 0.03 * f64::from(n));
        }
        assert!((u + 6.0).abs() < 1e-9, "{u}");
    }

    #[test]
    fn both_velocity_rules_give_a_ramps_slope() {
        for (velocity, first) in [(VelocityRule::Backward, 1), (VelocityRule::Mean2, 2)] {
            let cascade = PVelocity { kp: 0.0, kv: 5.0, velocity, limits: Limits::NONE };
            let mut law = Law::new(&Controller::PVelocity(cascade), 0.1);
            let u: Vec<f64> = (0..5).map(|n| law.step(0.0, 0.2 * f64::from(n))).collect();
            for u in &u[first..] {
                assert!((u + 10.0).abs() < 1e-12, "{u}");
            }
        }
    }

    #[test]
    fn the_integrator_for_a_recorded_start_gives_back_its_u() {
        let mut law = Law::new(&pi(2.0, 3.0, Limits::NONE, true), 0.5);
        let integrator = law.integrator_for(1.0, 0.2, 7.0);
        law.start(integrator, 0.2, 0.0, 7.0);
        assert!((law.step(1.0, 0.2) - 7.0).abs() < 1e-12);
    }
}
