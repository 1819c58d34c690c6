//! The plant at work: which way of stepping it takes follows from what acts on it.

use super::exact::Exact;
use super::linear::Linear;
use super::servo::{Acting, ServoBody};
use super::tank::TankBody;
use super::terms::Terms;
use crate::control_loop::Loop;
use crate::physics::Numbers;
use crate::plant::{Plant, StateSpace};
use crate::{Error, Result};

/// The plant's state with its stepping rule.
#[derive(Debug, Clone)]
pub(super) enum Body {
    One(Exact<1>),
    Two(Exact<2>),
    Three(Exact<3>),
    Four(Exact<4>),
    Eight(Box<Exact<8>>),
    Sixteen(Box<Exact<16>>),
    Linear(Linear),
    Servo(ServoBody),
    Tank(TankBody),
}

/// What acts on the plant over one sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub tick: u64,
    /// Start of the sample, in seconds.
    pub t: f64,
    /// What leaves the dead time: older value, newer value, and the part of the sample that has the older one.
    pub older: f64,
    pub newer: f64,
    pub part: f64,
    /// Drive per unit of u.
    pub gain: f64,
    /// Drive besides: offset less measured loads.
    pub offset: f64,
}

impl Sample {
    /// One exact step of a linear plant; gives the drive at its end.
    #[inline]
    pub fn exact_step<const N: usize>(&self, plant: &mut Exact<N>, terms: &Terms, sample_time_s: f64) -> f64 {
        let rest = self.offset - terms.load(self.tick, self.t, sample_time_s);
        let (older, newer) = (self.gain * self.older + rest, self.gain * self.newer + rest);
        plant.advance(older, newer);
        newer
    }
}

impl Body {
    /// The plant with these numbers at rest at zero, as it is stepped under these terms.
    pub fn new(model: &Loop, terms: &Terms, numbers: &Numbers, part: f64, substeps: usize) -> Result<Self> {
        let h = model.sample_time_s / substeps as f64;
        let stepwise = terms.need_substeps();
        match &model.plant {
            Plant::Tank(tank) => return Ok(Self::Tank(TankBody { tank: *tank, level: [0.0] })),
            Plant::Servo(servo) if stepwise || terms.has_friction() => {
                return Ok(Self::Servo(ServoBody::new(numbers, servo.output, h)));
            }
            _ => {}
        }
        let plant = match &model.plant {
            Plant::Servo(servo) => {
                let (inertia, viscous) = (numbers.inertia, numbers.viscous);
                Plant::Servo(crate::plant::Servo { inertia, viscous, ..*servo }).linear()?
            }
            other => other.linear()?,
        };
        let Some(plant) = plant else { return Err(Error::new("the plant has no linear model")) };
        if stepwise {
            Ok(Self::Linear(Linear::new(&plant, h)?))
        } else {
            Self::exact(&plant, model.sample_time_s, part)
        }
    }

    fn exact(plant: &StateSpace, sample_time_s: f64, part: f64) -> Result<Self> {
        Ok(match plant.order() {
            0 | 1 => Self::One(Exact::new(plant, sample_time_s, part)?),
            2 => Self::Two(Exact::new(plant, sample_time_s, part)?),
            3 => Self::Three(Exact::new(plant, sample_time_s, part)?),
            4 => Self::Four(Exact::new(plant, sample_time_s, part)?),
            5..=8 => Self::Eight(Box::new(Exact::new(plant, sample_time_s, part)?)),
            9..=16 => Self::Sixteen(Box::new(Exact::new(plant, sample_time_s, part)?)),
            more => {
                return Err(Error::new(format!("a plant with {more} states")).allowed("at most 16 states"));
            }
        })
    }

    /// The state: a servo's position and speed, a tank's level, or the states of the linear model (for which there
    /// may be more room than it has).
    pub fn state(&self) -> &[f64] {
        match self {
            Self::One(p) => &p.x,
            Self::Two(p) => &p.x,
            Self::Three(p) => &p.x,
            Self::Four(p) => &p.x,
            Self::Eight(p) => &p.x,
            Self::Sixteen(p) => &p.x,
            Self::Linear(p) => &p.x,
            Self::Servo(p) => &p.x,
            Self::Tank(p) => &p.level,
        }
    }

    pub fn state_mut(&mut self) -> &mut [f64] {
        match self {
            Self::One(p) => &mut p.x,
            Self::Two(p) => &mut p.x,
            Self::Three(p) => &mut p.x,
            Self::Four(p) => &mut p.x,
            Self::Eight(p) => &mut p.x,
            Self::Sixteen(p) => &mut p.x,
            Self::Linear(p) => &mut p.x,
            Self::Servo(p) => &mut p.x,
            Self::Tank(p) => &mut p.level,
        }
    }

    /// Takes over where the same plant with other numbers stands.
    pub fn goes_on_from(&mut self, other: &Self) {
        self.state_mut().copy_from_slice(other.state());
        if let (Self::Servo(own), Self::Servo(other)) = (self, other) {
            own.keeps_on_from(other);
        }
    }

    /// y as it is, given the drive held until now.
    #[inline]
    pub fn output(&self, held: f64) -> f64 {
        match self {
            Self::One(p) => p.output(held),
            Self::Two(p) => p.output(held),
            Self::Three(p) => p.output(held),
            Self::Four(p) => p.output(held),
            Self::Eight(p) => p.output(held),
            Self::Sixteen(p) => p.output(held),
            Self::Linear(p) => p.output(held),
            Self::Servo(p) => p.output(),
            Self::Tank(p) => p.level[0],
        }
    }

    /// dy/dt at this moment, given the drive held until now.
    #[inline]
    pub fn rate(&self, held: f64) -> f64 {
        match self {
            Self::One(p) => p.rate(held),
            Self::Two(p) => p.rate(held),
            Self::Three(p) => p.rate(held),
            Self::Four(p) => p.rate(held),
            Self::Eight(p) => p.rate(held),
            Self::Sixteen(p) => p.rate(held),
            Self::Linear(p) => p.rate(held),
            Self::Servo(p) => p.rate(),
            Self::Tank(p) => p.rate(held),
        }
    }

    /// One exact step of a linear plant under a drive that is held; nothing of another.
    #[inline]
    pub fn advance_exact(&mut self, drive: f64) {
        match self {
            Self::One(p) => p.advance(drive, drive),
            Self::Two(p) => p.advance(drive, drive),
            Self::Three(p) => p.advance(drive, drive),
            Self::Four(p) => p.advance(drive, drive),
            Self::Eight(p) => p.advance(drive, drive),
            Self::Sixteen(p) => p.advance(drive, drive),
            Self::Linear(_) | Self::Servo(_) | Self::Tank(_) => {}
        }
    }

    /// Moves on by one sample; gives the drive at its end.
    #[inline]
    pub fn advance(
        &mut self,
        sample: &Sample,
        terms: &mut Terms,
        sample_time_s: f64,
        substeps: usize,
    ) -> f64 {
        match self {
            Self::One(p) => sample.exact_step(p, terms, sample_time_s),
            Self::Two(p) => sample.exact_step(p, terms, sample_time_s),
            Self::Three(p) => sample.exact_step(p, terms, sample_time_s),
            Self::Four(p) => sample.exact_step(p, terms, sample_time_s),
            Self::Eight(p) => sample.exact_step(p.as_mut(), terms, sample_time_s),
            Self::Sixteen(p) => sample.exact_step(p.as_mut(), terms, sample_time_s),
            Self::Linear(_) | Self::Servo(_) | Self::Tank(_) => {
                self.advance_stepwise(sample, terms, sample_time_s, substeps)
            }
        }
    }

    fn advance_stepwise(
        &mut self,
        sample: &Sample,
        terms: &mut Terms,
        sample_time_s: f64,
        substeps: usize,
    ) -> f64 {
        let (tick, mut drive) = (sample.tick, 0.0);
        let varying = terms.need_substeps();
        let is_slow = matches!(self, Self::Tank(tank) if tank.is_slow(sample_time_s));
        let substeps = if is_slow && !terms.vary_the_drive(tick) { 1 } else { substeps };
        let h = sample_time_s / substeps as f64;
        for step in 0..substeps {
            let t = sample.t + h * step as f64;
            // The mean over the sub-step in which the delayed value changes.
            let old = (sample.part * substeps as f64 - step as f64).clamp(0.0, 1.0);
            let w = terms.filter(tick, sample.newer + old * (sample.older - sample.newer));
            let outside = sample.offset - terms.load(tick, t, h);
            let actuator = sample.gain * w;
            drive = actuator + outside;
            let terms = &*terms;
            let force = |motion| terms.force(tick, motion);
            match self {
                Self::Servo(p) => {
                    let friction =
                        |direction, speed, transmitted| terms.friction(tick, direction, speed, transmitted);
                    p.substep(&Acting { actuator, outside, force, friction, varying });
                }
                Self::Linear(p) => p.substep(drive, force),
                Self::Tank(p) => p.substep(drive, h, force),
                _ => {}
            }
        }
        drive
    }
}
