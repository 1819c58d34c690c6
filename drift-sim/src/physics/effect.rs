//! What a term does to a running simulation: a few hooks, each named up front so that the loop calls no other.

use rand_chacha::ChaCha8Rng;

use crate::plant::Plant;

/// What a hook of an effect is called for. Within a place, effects act in the order of the loop's terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hook {
    /// [`Effect::numbers`], once when the term begins.
    Numbers,
    /// [`Effect::command`], every sample.
    Command,
    /// [`Effect::actuator`], every sample.
    Actuator,
    /// [`Effect::filter`], every sub-step.
    Filter,
    /// [`Effect::load`], every sub-step.
    Load,
    /// [`Effect::force`], twice every sub-step.
    Force,
    /// [`Effect::friction`], every sub-step.
    Friction,
    /// [`Effect::friction`] that depends on the speed or on the load: evaluated twice every sub-step.
    VaryingFriction,
    /// [`Effect::sensor`], every sample, on what the sensor takes in: before its own noise is added.
    Sense,
    /// [`Effect::sensor`], every sample, on what the sensor shows: after its own noise is added.
    Sensor,
}

/// What an effect is built with.
pub struct Context<'a> {
    /// The loop's sample time, in seconds.
    pub sample_time_s: f64,
    /// The sub-step over which [`Effect::filter`] is called, in seconds.
    pub substep_s: f64,
    /// The nominal plant.
    pub plant: &'a Plant,
    /// When the term begins, in seconds.
    pub onset_s: f64,
    /// When it acts, where the term says so.
    pub spans: &'a [(f64, f64)],
    /// Where its own noise comes from.
    pub noise: ChaCha8Rng,
}

/// Where the plant is, for forces that depend on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Servo: position. Others: y.
    pub position: f64,
    /// Servo: speed. Others: 0.
    pub velocity: f64,
}

/// Numbers of the loop that a term may change for good.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers {
    /// The servo's inertia, in its own unit; 1 for other plants.
    pub inertia: f64,
    /// The servo's viscous friction, force per speed; 0 for other plants.
    pub viscous: f64,
    /// All gains of the control law are the stated ones times this.
    pub law_ratio: f64,
    /// Dead time between actuator and plant, in seconds.
    pub delay_s: f64,
    /// Standard deviation of the sensor's own noise, in the unit of y.
    pub sensor_noise: f64,
}

/// A term at work. Only the hooks listed by [`Effect::hooks`] are called, and only once the term has begun; times
/// are in seconds from the start of the run.
pub trait Effect: Send + Sync {
    /// Which of the methods below it uses.
    fn hooks(&self) -> &'static [Hook];

    /// Changes numbers of the loop.
    fn numbers(&self, _numbers: &mut Numbers) {}

    /// The controller's output, from what the law gives.
    fn command(&mut self, u: f64) -> f64 {
        u
    }

    /// What leaves the actuator while the controller's `u` is held.
    fn actuator(&mut self, _t: f64, u: f64) -> f64 {
        u
    }

    /// [`Effect::actuator`] of all samples from one on, each in its place: what is asked of a term once is asked of it directly.
    fn actuator_over(&mut self, from: usize, sample_time_s: f64, values: &mut [f64]) {
        for (n, value) in (from..).zip(values) {
            *value = self.actuator(n as f64 * sample_time_s, *value);
        }
    }

    /// What reaches the plant over a sub-step, as its mean, from what leaves the actuator.
    fn filter(&mut self, w: f64) -> f64 {
        w
    }

    /// A disturbance, subtracted from the drive: its mean over `[t, t + h]`.
    fn load(&self, _t: f64, _h: f64) -> f64 {
        0.0
    }

    /// [`Effect::load`] over all samples from one on, added to what is there.
    fn load_over(&self, from: usize, sample_time_s: f64, sums: &mut [f64]) {
        for (n, sum) in (from..).zip(sums) {
            *sum += self.load(n as f64 * sample_time_s, sample_time_s);
        }
    }

    /// A force (in the drive's unit) that depends on where the plant is, added to the drive.
    fn force(&self, _motion: Motion) -> f64 {
        0.0
    }

    /// The dry friction available against motion in `direction` (1 or -1) at a speed >= 0 (0: at rest) under
    /// the transmitted force; >= 0.
    fn friction(&self, _direction: f64, _speed: f64, _transmitted: f64) -> f64 {
        0.0
    }

    /// The measured y, from the true one.
    fn sensor(&mut self, _t: f64, y: f64) -> f64 {
        y
    }

    /// What the sensor shows before the first sample.
    fn shows(&mut self, _y: f64) {}

    /// An observer has moved the plant's state beside a recording: y by this, and what the sensor shows by its own part, where the observer knows how it follows y.
    fn correct(&mut self, _y_by: f64, _shown_by: Option<f64>) {}

    /// How what the sensor shows follows y from sample to sample; `None` where that is no line.
    fn follows(&self) -> Option<Follows> {
        None
    }

    /// A copy in the same state.
    fn copy(&self) -> Box<dyn Effect>;
}

/// What a sensor shows a sample later: of the new y, of the one before, and of what it showed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follows {
    /// Of the new y.
    pub new: f64,
    /// Of the one before.
    pub before: f64,
    /// Of what it showed.
    pub stays: f64,
}

impl Clone for Box<dyn Effect> {
    fn clone(&self) -> Self {
        self.copy()
    }
}
