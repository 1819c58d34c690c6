//! The terms at work, sorted by what they do: the loop calls a hook of those terms only that use it and have begun.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::control_loop::Loop;
use crate::physics::{Context, Effect, Hook, Motion, Numbers};

/// (the first tick, index of the effect).
type Users = Vec<(u64, usize)>;

/// All effects of a loop.
#[derive(Clone, Default)]
pub(super) struct Terms {
    effects: Vec<Box<dyn Effect>>,
    numbers: Users,
    command: Users,
    actuator: Users,
    filter: Users,
    load: Users,
    force: Users,
    friction: Users,
    sense: Users,
    sensor: Users,
    /// Whether friction depends on more than the direction.
    pub varying_friction: bool,
}

/// The first tick at or after a time; a billionth of a tick is rounding of the quotient.
fn first_tick(onset_s: f64, sample_time_s: f64) -> u64 {
    libm::ceil(onset_s / sample_time_s - 1e-9).max(0.0) as u64
}

/// Noise of its own for each term: a stream named after the term's kind and its number among those of that kind,
/// so that another term changes nothing in it.
fn noise_of(seed: u64, kind: &str, occurrence: u64) -> ChaCha8Rng {
    // FNV-1a.
    let hash = kind
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    let mut noise = ChaCha8Rng::seed_from_u64(seed);
    noise.set_stream(hash.wrapping_add(occurrence));
    noise
}

/// The place of a tick in columns that begin with the recording.
pub(super) fn place(tick: u64) -> usize {
    usize::try_from(tick).unwrap_or(usize::MAX)
}

impl Terms {
    /// Builds the effects of a loop whose terms have been checked.
    pub fn new(model: &Loop, seed: u64, substep_s: f64) -> Self {
        let mut terms = Self::default();
        for (index, term) in model.physics.iter().enumerate() {
            let same = model.physics.iter().take(index).filter(|other| other.kind == term.kind).count();
            let context = Context {
                sample_time_s: model.sample_time_s,
                substep_s,
                plant: &model.plant,
                onset_s: term.onset_s,
                spans: &term.spans,
                noise: noise_of(seed, term.kind.name, same as u64),
            };
            let effect = (term.kind.effect)(&term.parameters, &context);
            let user = (first_tick(term.onset_s, model.sample_time_s), index);
            for hook in effect.hooks() {
                match hook {
                    Hook::Numbers => terms.numbers.push(user),
                    Hook::Command => terms.command.push(user),
                    Hook::Actuator => terms.actuator.push(user),
                    Hook::Filter => terms.filter.push(user),
                    Hook::Load => terms.load.push(user),
                    Hook::Force => terms.force.push(user),
                    Hook::Friction => terms.friction.push(user),
                    Hook::VaryingFriction => {
                        terms.varying_friction = true;
                        terms.friction.push(user);
                    }
                    Hook::Sense => terms.sense.push(user),
                    Hook::Sensor => terms.sensor.push(user),
                }
            }
            terms.effects.push(effect);
        }
        terms
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.effects.is_empty()
    }

    /// Whether something must be evaluated along the way through a sample.
    pub fn need_substeps(&self) -> bool {
        self.varying_friction || !self.force.is_empty() || !self.filter.is_empty()
    }

    /// Whether something has begun that acts on the drive along the way through this sample.
    pub fn vary_the_drive(&self, tick: u64) -> bool {
        self.begun(&self.force, tick).next().is_some() || self.begun(&self.filter, tick).next().is_some()
    }

    pub fn has_friction(&self) -> bool {
        !self.friction.is_empty()
    }

    pub fn has_force(&self) -> bool {
        !self.force.is_empty()
    }

    /// Which terms act before the plant, in the order of the loop's list.
    pub fn before_the_plant(&self) -> Vec<usize> {
        let users = self.actuator.iter().chain(&self.load).chain(&self.filter);
        let mut terms: Vec<usize> = users.map(|(_, index)| *index).collect();
        terms.sort_unstable();
        terms.dedup();
        terms
    }

    /// The first ticks of forces and friction.
    pub fn forces_begin_at(&self) -> impl Iterator<Item = u64> {
        self.force.iter().chain(&self.friction).map(|(tick, _)| *tick)
    }

    pub fn has_load(&self) -> bool {
        !self.load.is_empty()
    }

    pub fn has_actuator(&self) -> bool {
        !self.actuator.is_empty()
    }

    pub fn has_sensor(&self) -> bool {
        !self.sensor.is_empty()
    }

    /// The ticks at which numbers change, in order, each once; always with 0.
    pub fn changes(&self) -> Vec<u64> {
        let mut ticks: Vec<u64> = self.numbers.iter().map(|(tick, _)| *tick).chain([0]).collect();
        ticks.sort_unstable();
        ticks.dedup();
        ticks
    }

    /// The nominal numbers as the terms that have begun change them.
    pub fn numbers(&self, tick: u64, mut numbers: Numbers) -> Numbers {
        for effect in self.begun(&self.numbers, tick) {
            effect.numbers(&mut numbers);
        }
        numbers
    }

    fn begun<'a>(&'a self, users: &'a Users, tick: u64) -> impl Iterator<Item = &'a dyn Effect> {
        let at_work = users.iter().filter(move |(first, _)| tick >= *first);
        at_work.filter_map(|(_, index)| self.effects.get(*index)).map(AsRef::as_ref)
    }

    #[inline]
    pub fn command(&mut self, tick: u64, u: f64) -> f64 {
        through(&self.command, &mut self.effects, tick, u, |effect, u| effect.command(u))
    }

    #[inline]
    pub fn actuator(&mut self, tick: u64, t: f64, u: f64) -> f64 {
        through(&self.actuator, &mut self.effects, tick, u, |effect, u| effect.actuator(t, u))
    }

    /// What leaves the actuator over all samples, each in the place of what enters it.
    pub fn actuator_over(&mut self, sample_time_s: f64, values: &mut [f64]) {
        for (first, index) in &self.actuator {
            let from = place(*first);
            if let Some(effect) = self.effects.get_mut(*index)
                && let Some(values) = values.get_mut(from..)
            {
                effect.actuator_over(from, sample_time_s, values);
            }
        }
    }

    #[inline]
    pub fn filter(&mut self, tick: u64, w: f64) -> f64 {
        through(&self.filter, &mut self.effects, tick, w, |effect, w| effect.filter(w))
    }

    #[inline]
    pub fn sense(&mut self, tick: u64, t: f64, y: f64) -> f64 {
        through(&self.sense, &mut self.effects, tick, y, |effect, y| effect.sensor(t, y))
    }

    /// What the sensor shows before the first sample.
    pub fn shows(&mut self, y: f64) {
        self.sensing(|effect| effect.shows(y));
    }

    /// Whether a correction of the state has to be told to a term.
    pub fn heeds_corrections(&self) -> bool {
        !self.sense.is_empty()
    }

    /// What the sensor shows has been corrected.
    pub fn correct(&mut self, y_by: f64, shown_by: Option<f64>) {
        self.sensing(|effect| effect.correct(y_by, shown_by));
    }

    fn sensing(&mut self, change: impl Fn(&mut dyn Effect)) {
        for (_, index) in &self.sense {
            if let Some(effect) = self.effects.get_mut(*index) {
                change(effect.as_mut());
            }
        }
    }

    #[inline]
    pub fn sensor(&mut self, tick: u64, t: f64, y: f64) -> f64 {
        through(&self.sensor, &mut self.effects, tick, y, |effect, y| effect.sensor(t, y))
    }

    #[inline]
    pub fn load(&self, tick: u64, t: f64, h: f64) -> f64 {
        self.begun(&self.load, tick).map(|effect| effect.load(t, h)).sum()
    }

    /// The load over each of so many samples.
    pub fn load_over(&self, sample_time_s: f64, samples: usize) -> Vec<f64> {
        let mut sums = vec![0.0; samples];
        for (first, index) in &self.load {
            let from = place(*first);
            if let Some(effect) = self.effects.get(*index)
                && let Some(sums) = sums.get_mut(from..)
            {
                effect.load_over(from, sample_time_s, sums);
            }
        }
        sums
    }

    #[inline]
    pub fn force(&self, tick: u64, motion: Motion) -> f64 {
        self.begun(&self.force, tick).map(|effect| effect.force(motion)).sum()
    }

    #[inline]
    pub fn friction(&self, tick: u64, direction: f64, speed: f64, transmitted: f64) -> f64 {
        self.begun(&self.friction, tick).map(|effect| effect.friction(direction, speed, transmitted)).sum()
    }
}

/// A value on its way through the effects that change it, in order.
#[inline]
fn through(
    users: &Users,
    effects: &mut [Box<dyn Effect>],
    tick: u64,
    mut value: f64,
    change: impl Fn(&mut dyn Effect, f64) -> f64,
) -> f64 {
    for (first, index) in users {
        if tick >= *first
            && let Some(effect) = effects.get_mut(*index)
        {
            value = change(effect.as_mut(), value);
        }
    }
    value
}
