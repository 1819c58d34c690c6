//! A hypothesis: a loop, which of its numbers are free, and the noise in it. A point gives the free numbers values; what comes of it is
//! a loop that the simulator runs and the noise that the filter reckons with.

use crate::control_loop::Loop;
use crate::measured_input::Gain;
use crate::physics::{Family, Hook, Parameter, Scales, Searched, Start, Starts, Term};
use crate::plant::{Number, Plant, Role};

use super::free;
pub use super::free::{Free, Target, is_noise, is_of_loop};
use super::level::Level;
use super::noise::{Noise, WHITE};

/// Numbers that decide how far a fit may go, with their sources in `docs/limits.md`.
#[derive(Debug, Clone, PartialEq)]
pub struct Priors {
    /// Prior deviation of the logarithm of a stated plant number.
    pub plant_log: f64,
    /// Prior deviation of the constant load, as part of the drive's deviation.
    pub constant_load: f64,
    /// Whether the plant is guessed, from nothing but the recordings: the constant load is then counted from the one under which it rests at their level.
    pub is_guessed: bool,
    /// Prior deviation of a measured input's gain that is to be found, in those under which the input moves the drive as much as u does: it keeps one from running away of
    /// which a recording says nothing.
    pub input_gain: f64,
    /// Prior deviation of the time by which y is late, in samples.
    pub late_samples: f64,
    /// Longest time constant of the random load, as part of the recording: longer ones swallow slow physics.
    pub longest_tau: f64,
    /// Greatest atanh of what stays of the sensor's noise from sample to sample: more becomes a drift.
    pub most_rho_atanh: f64,
}

impl Default for Priors {
    fn default() -> Self {
        Self {
            plant_log: 0.25,
            constant_load: 0.3,
            is_guessed: false,
            input_gain: 10.0,
            late_samples: 0.3,
            longest_tau: 0.1,
            most_rho_atanh: 1.85,
        }
    }
}

/// Values of the free numbers, and when the terms begin that begin at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// One for each free number.
    pub x: Vec<f64>,
    /// One for each candidate term, in seconds; 0 for those that act from the start.
    pub onsets: Vec<f64>,
    /// States in which recordings begin, where that is another one than the term's own.
    pub begun: Vec<Begun>,
}

/// A state of a term in which a recording begins: where a valve's stem was, or what it drives in its play.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Begun {
    /// Index into the loop's physics.
    pub term: usize,
    /// Index into its parameters.
    pub parameter: usize,
    /// Index into the recordings.
    pub recording: usize,
    /// Its value there.
    pub value: f64,
}

/// A loop with free numbers.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// The stated loop, then the candidate terms at their starting values.
    pub model: Loop,
    /// How many terms the loop file states.
    pub stated: usize,
    /// What is free.
    pub free: Vec<Free>,
    /// The plant's stated numbers, or those that were guessed.
    pub numbers: Vec<Number>,
    /// Whether they were guessed.
    pub is_guessed: bool,
    /// Where the plant rests, whatever its numbers; none where its own numbers say it.
    pub level: Option<Level>,
    /// The recording's scales.
    pub scales: Scales,
}

/// What a point makes of a hypothesis.
#[derive(Debug, Clone)]
pub struct Realised {
    /// The loop, its terms at their values, without sensor noise of its own.
    pub model: Loop,
    /// The noise.
    pub noise: Noise,
    /// A load that stays.
    pub constant_load: f64,
    /// How late the recording shows y, in seconds.
    pub late_s: f64,
}

/// Part of the recording at either end in which nothing is taken to begin; noise takes more samples to be told than a shift.
pub const ENDS: f64 = 0.02;
/// The same of noise.
pub const ENDS_OF_NOISE: f64 = 0.05;
/// Part of the way to an end of where a number is looked for that counts as there.
const AT_AN_END: f64 = 0.02;

impl Hypothesis {
    /// The loop as stated, its plant's numbers, a constant load and the noise free.
    pub fn nominal(model: &Loop, scales: &Scales, priors: &Priors) -> Self {
        let numbers = model.plant.numbers();
        let mut free: Vec<Free> = Vec::new();
        for (i, number) in numbers.iter().enumerate() {
            free.extend(free::of_plant(i, number, scales, priors, model.sample_time_s));
        }
        let own_delay = numbers.iter().any(|number| number.role == Role::Delay && number.value > 0.0);
        free.push(free::constant_load(scales, priors));
        let inputs = model.inputs.iter().enumerate();
        free.extend(inputs.filter_map(|(i, input)| free::of_input(i, input, &model.plant, scales, priors)));
        if !own_delay {
            free.push(free::late(model.sample_time_s, priors));
        }
        free.extend(free::of_noise(scales, priors));
        let mut model = Loop { sensor: crate::control_loop::Sensor { noise: 0.0 }, ..model.clone() };
        for input in model.inputs.iter_mut().filter(|input| input.gain.is_open()) {
            input.gain = Gain::Found(0.0);
        }
        let stated = model.physics.len();
        let inputs = model.inputs.iter().zip(&scales.inputs);
        let measured_load = inputs
            .map(|(input, (mean, _))| input.load(model.plant.drive_gain(), input.gain.value() * mean))
            .sum();
        let means = (scales.u_mean, scales.y_mean, measured_load);
        let level = if priors.is_guessed { Level::of(&model.plant, means) } else { None };
        Self { model, stated, free, numbers, is_guessed: priors.is_guessed, level, scales: scales.clone() }
    }

    /// The same with one more candidate term; its numbers come before the noise's.
    #[must_use]
    pub fn with(&self, term: Term) -> Self {
        let mut wider = self.clone();
        let index = wider.model.physics.len();
        let at =
            wider.free.iter().position(|free| free.target == Target::LoadSize).unwrap_or(wider.free.len());
        wider.free.splice(at..at, free::of_term(index, &term, &self.scales));
        wider.model.physics.push(term);
        wider
    }

    /// The candidate terms.
    pub fn candidates(&self) -> &[Term] {
        self.model.physics.get(self.stated..).unwrap_or(&[])
    }

    /// Where the numbers of a candidate term are among the free ones.
    pub fn places_of(&self, candidate: usize) -> Vec<usize> {
        let index = self.stated + candidate;
        let is_of = |target: Target| matches!(target, Target::Term { term, .. } | Target::Onset(term) if term == index);
        (0..self.free.len()).filter(|i| self.free.get(*i).is_some_and(|free| is_of(free.target))).collect()
    }

    /// Whether a candidate may begin then: not where too little is left on one side of it to tell both apart.
    pub fn may_begin(&self, candidate: usize, onset_s: f64) -> bool {
        let is_noise = |term: &Term| matches!(term.kind.search, Starts::NoiseChange);
        let ends = if self.candidates().get(candidate).is_some_and(is_noise) { ENDS_OF_NOISE } else { ENDS };
        (ends..1.0 - ends).contains(&(onset_s / self.scales.duration_s))
    }

    /// Whether a candidate's number lies at an end of where it is looked for, or its limits meet: the kind stands in for something else.
    pub fn is_at_an_end(&self, candidate: usize, point: &Point) -> bool {
        let index = self.stated + candidate;
        let of_term = self.free.iter().zip(&point.x).filter_map(|(free, x)| {
            let Target::Term { term, parameter } = free.target else { return None };
            let parameter = self.model.physics.get(term).and_then(|of| of.kind.parameters.get(parameter));
            Some((parameter.filter(|_| term == index)?, free, *x))
        });
        let numbers: Vec<(&Parameter, &Free, f64)> = of_term.collect();
        let limits: Vec<f64> =
            numbers.iter().filter(|(parameter, ..)| parameter.limits).map(|(.., x)| *x).collect();
        // Between two limits that meet nothing passes.
        let meet = matches!(limits[..], [lower, upper] if (upper - lower).abs() < AT_AN_END);
        let is_at_an_end = |(parameter, free, x): &(&Parameter, &Free, f64)| {
            let at = |end: f64| (x - end).abs() <= AT_AN_END * end.abs();
            parameter.searched != Searched::Everywhere
                && (at(free.high) || (at(free.low) && free.value(free.low) != 0.0))
        };
        meet || numbers.iter().any(is_at_an_end)
    }

    /// The place of a number among the free ones.
    pub fn place(&self, target: Target) -> Option<usize> {
        self.free.iter().position(|free| free.target == target)
    }

    /// This point of a narrower hypothesis in this one; candidate terms beyond it at the values that they came with.
    pub fn widen(&self, narrower: &Hypothesis, point: &Point) -> Point {
        let x = self.free.iter().map(|free| match narrower.place(free.target) {
            Some(place) => point.x.get(place).copied().unwrap_or(0.0),
            None => self.own_x(free),
        });
        let x = x.collect();
        let own = self.candidates().iter().map(|term| term.onset_s);
        let onsets =
            own.enumerate().map(|(i, onset)| point.onsets.get(i).copied().unwrap_or(onset)).collect();
        let is_same = |begun: &&Begun| {
            let kind_of = |of: &Hypothesis| of.model.physics.get(begun.term).map(|term| term.kind);
            kind_of(self).is_some_and(|kind| kind_of(narrower) == Some(kind))
        };
        let begun = point.begun.iter().filter(is_same).copied().collect();
        Point { x, onsets, begun }
    }

    /// The point at which all numbers are as the hypothesis' own loop has them.
    pub fn own_point(&self) -> Point {
        Point {
            x: self.free.iter().map(|free| self.own_x(free)).collect(),
            onsets: self.candidates().iter().map(|term| term.onset_s).collect(),
            begun: Vec::new(),
        }
    }

    /// The x at which a term's number stands in the hypothesis' own loop.
    fn own_x(&self, free: &Free) -> f64 {
        match free.target {
            Target::Term { term, parameter } => {
                let term = self.model.physics.get(term);
                term.and_then(|term| term.parameters.get(parameter)).map_or(0.0, |value| free.x_of(*value))
            }
            Target::Onset(term) => self.model.physics.get(term).map_or(0.0, |term| free.x_of(term.onset_s)),
            _ => 0.0,
        }
    }

    /// A point with the last candidate's numbers, and the plant's gain and time constant, moved to a start.
    pub fn started(&self, point: &Point, start: &Start, onset_s: f64) -> Point {
        let mut point = point.clone();
        let last = self.model.physics.len() - 1;
        let is_late = self.model.physics.last().is_some_and(|term| term.kind.family == Some(Family::Lag));
        for (free, x) in self.free.iter().zip(&mut point.x) {
            match free.target {
                Target::Term { term, parameter } if term == last => {
                    *x = start.parameters.get(parameter).map_or(*x, |value| free.x_of(*value));
                }
                Target::Onset(term) if term == last => *x = free.x_of(onset_s),
                // The time by which y is late has taken up what part of a delay it can.
                Target::Late if is_late => *x = 0.0,
                Target::Plant(i) => {
                    let shift = self.numbers.get(i).map_or(0.0, |number| shift_of(number.role, start));
                    *x = (*x + shift).clamp(free.low, free.high);
                }
                _ => {}
            }
        }
        if let Some(onset) = point.onsets.last_mut() {
            *onset = onset_s;
        }
        point
    }

    /// The same without dry friction, and a point of it.
    pub fn without_dry_friction(&self, mut point: Point) -> (Self, Point) {
        let mut sliding = self.clone();
        for (index, term) in sliding.model.physics.iter_mut().enumerate() {
            if !term.is_dry_friction() {
                continue;
            }
            for (parameter, about) in term.kind.parameters.iter().enumerate() {
                if let Some(value) = term.parameters.get_mut(parameter) {
                    *value = about.neutral;
                }
                let place = self.place(Target::Term { term: index, parameter });
                let free = place.and_then(|place| Some((self.free.get(place)?, point.x.get_mut(place)?)));
                if let Some((free, x)) = free {
                    *x = free.x_of(about.neutral);
                }
            }
        }
        (sliding, point)
    }

    /// The loop and the noise at a point; `None` where a term's numbers contradict each other.
    pub fn realise(&self, point: &Point) -> Option<Realised> {
        let mut model = self.model.clone();
        let mut numbers: Vec<f64> = self.numbers.iter().map(|number| number.value).collect();
        for (term, onset_s) in model.physics.iter_mut().skip(self.stated).zip(&point.onsets) {
            term.onset_s = *onset_s;
        }
        let (mut constant_load, mut measured_load, mut late_s) = (0.0, 0.0, 0.0);
        let (mut size, mut tau, mut rho, mut white) = (0.0, 1.0, 0.0, WHITE);
        for (free, x) in self.free.iter().zip(&point.x) {
            let value = free.value(*x);
            match free.target {
                Target::Plant(i) => *numbers.get_mut(i)? = value,
                Target::ConstantLoad => constant_load = value,
                Target::InputGain(i) => {
                    let input = model.inputs.get_mut(i)?;
                    let moved = value - input.gain.value();
                    input.gain = Gain::Found(value);
                    // The load that stays is counted beside the input's mean, which another gain leaves where it was.
                    let (mean, _) = self.scales.inputs.get(i).copied().unwrap_or_default();
                    measured_load += input.load(self.model.plant.drive_gain(), moved * mean);
                }
                Target::Late => late_s = value,
                Target::Term { term, parameter } => {
                    *model.physics.get_mut(term)?.parameters.get_mut(parameter)? = value;
                }
                Target::Onset(term) => model.physics.get_mut(term)?.onset_s = value,
                Target::LoadSize => size = libm::exp(value),
                Target::LoadTau => tau = libm::exp(value),
                Target::SensorRho => rho = libm::tanh(value),
                Target::SensorWhite => white = libm::exp(value).max(WHITE),
            }
        }
        model.plant = model.plant.with_numbers(&numbers);
        constant_load += self.level_load(&model.plant)? - measured_load;
        let own = model.physics.iter().skip(self.stated);
        if own.clone().any(|term| term.check().is_err()) {
            return None;
        }
        let change = own.clone().find(|term| matches!(term.kind.search, Starts::NoiseChange));
        let (growth, growth_from_s) =
            change.map_or((1.0, 0.0), |term| (term.parameters.first().copied().unwrap_or(1.0), term.onset_s));
        let noise = Noise {
            load_ratio: size * self.scales.drive / self.scales.noise,
            load_tau_s: tau,
            sensor_rho: rho,
            sensor_white: white,
            growth,
            growth_from_s,
        };
        Some(Realised { model, noise, constant_load, late_s })
    }

    /// The loop and the noise of a recording that begins in another state; none where it begins as the terms have it.
    pub fn in_recording(realised: &Realised, point: &Point, recording: usize) -> Option<Realised> {
        let mut own = None;
        for begun in point.begun.iter().filter(|begun| begun.recording == recording) {
            let own = own.get_or_insert_with(|| realised.clone());
            let term = own.model.physics.get_mut(begun.term);
            if let Some(value) = term.and_then(|term| term.parameters.get_mut(begun.parameter)) {
                *value = begun.value;
            }
        }
        own
    }

    /// The load that the constant load is counted from.
    fn level_load(&self, plant: &Plant) -> Option<f64> {
        self.level.as_ref().map_or(Some(0.0), |level| level.load(plant))
    }

    /// A point under this constant load.
    pub fn with_load(&self, mut point: Point, load: f64) -> Option<Point> {
        let from = self.realise(&point)?.constant_load;
        let place = self.place(Target::ConstantLoad)?;
        let (free, x) = (self.free.get(place)?, point.x.get_mut(place)?);
        *x = free.x_of(free.value(*x) + load - from);
        Some(point)
    }

    /// The same loop and noise without the candidate terms: as a healthy recording shows it.
    pub fn healthy(&self, realised: &Realised) -> Realised {
        let mut healthy = realised.clone();
        healthy.model.physics.truncate(self.stated);
        healthy.noise.growth = 1.0;
        healthy.noise.growth_from_s = 0.0;
        healthy
    }

    /// Twice the negative logarithm of the prior, up to a constant, as the squares of these.
    pub fn prior_rows<'a>(&'a self, point: &'a Point) -> impl Iterator<Item = f64> + 'a {
        self.free.iter().zip(&point.x).map(|(free, x)| free.prior.map_or(0.0, |deviation| x / deviation))
    }
}

impl Realised {
    /// The times at which the linear part changes, in seconds, with 0 first.
    pub fn changes(&self) -> Vec<f64> {
        let mut times = vec![0.0];
        times.extend(
            self.model
                .physics
                .iter()
                .filter(|term| term.onset_s > 0.0 && self.bends(term))
                .map(|t| t.onset_s),
        );
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// Whether a term changes the linear part.
    fn bends(&self, term: &Term) -> bool {
        let hooks = super::linear_part::effect(&self.model, term).hooks();
        hooks.iter().any(|hook| matches!(hook, Hook::Numbers | Hook::Force))
    }
}

/// The logarithm by which a start moves a plant's number.
fn shift_of(role: Role, start: &Start) -> f64 {
    match role {
        Role::Gain => start.gain,
        Role::Time => start.time,
        Role::Viscous => -start.gain,
        Role::Inertia => start.time - start.gain,
        Role::Delay | Role::Offset | Role::Shape => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::measure;
    use super::super::signals::Signals;
    use super::*;
    use crate::likelihood_search::options::Options;

    /// Limits that a u of one volt comes to, and two between which nothing passes.
    #[test]
    fn limits_that_meet_are_at_an_end() {
        let text = "[loop]\nsample_time_s = 1.0\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"first-order\"\ngain = 2.0\ntime_constant_s = 9.0\n";
        let model = Loop::parse(text, "a flow").unwrap();
        let u: Vec<f64> = (0..1000).map(|n| libm::sin(0.05 * f64::from(n))).collect();
        let signals = Signals { sample_time_s: 1.0, r: u.clone(), y: u.clone(), u, ..Signals::default() };
        let plain =
            Hypothesis::nominal(&model, &measure::scales(&model, &[signals]), &Options::default().priors);
        let is_at_an_end = |lower: f64, upper: f64| {
            let limits = Term::new("saturation", &[("lower", lower), ("upper", upper)]).unwrap();
            let with = plain.with(limits);
            with.is_at_an_end(0, &with.own_point())
        };
        assert!(!is_at_an_end(-0.5, 0.5) && !is_at_an_end(0.1, 0.4));
        assert!(is_at_an_end(0.1, 0.101));
    }
}
