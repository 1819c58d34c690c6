//! A hypothesis: a loop, which of its numbers are free, and the noise in it. A point gives the free numbers values; what comes of it is
//! a loop that the simulator runs and the noise that the filter reckons with.

use crate::control_loop::Loop;
use crate::physics::{Family, Hook, Over, Range, Scales, Searched, Start, Starts, Term};
use crate::plant::{Number, Plant, Role};

use super::level::Level;
use super::noise::Noise;

/// Numbers that decide how far a fit may go, with their sources in `docs/limits.md`.
#[derive(Debug, Clone, PartialEq)]
pub struct Priors {
    /// Prior deviation of the logarithm of a stated plant number.
    pub plant_log: f64,
    /// Prior deviation of the constant load, as part of the drive's deviation.
    pub constant_load: f64,
    /// Whether the constant load is counted from the one under which the plant rests at the recordings' level: it is, where the plant is unknown.
    pub about_level: bool,
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
            about_level: false,
            late_samples: 0.3,
            longest_tau: 0.1,
            most_rho_atanh: 1.85,
        }
    }
}

/// What a free number stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// The plant's number of this place.
    Plant(usize),
    /// A load that stays.
    ConstantLoad,
    /// How late the recording shows y.
    Late,
    /// Parameter `parameter` of the term `term` of the loop.
    Term {
        /// Index into the loop's physics.
        term: usize,
        /// Index into its parameters.
        parameter: usize,
    },
    /// When a term that grows begins.
    Onset(usize),
    /// Logarithm of the random load's deviation over the drive's.
    LoadSize,
    /// Logarithm of its time constant, in seconds.
    LoadTau,
    /// atanh of what stays of the sensor's noise.
    SensorRho,
}

/// A free number: its value is `from + scale*x`, or `from*exp(x)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// What it stands for.
    pub target: Target,
    /// Its name in reports.
    pub name: String,
    /// Its value at x = 0.
    pub from: f64,
    /// Its typical change; 0: it is moved by its logarithm.
    pub scale: f64,
    /// Least x.
    pub low: f64,
    /// Greatest x.
    pub high: f64,
    /// The step of x that shows how the innovations change.
    pub step: f64,
    /// Prior deviation of x about 0, where there is one.
    pub prior: Option<f64>,
    /// Whether the innovations change smoothly with it.
    pub smooth: bool,
}

impl Free {
    /// The value at x.
    pub fn value(&self, x: f64) -> f64 {
        if self.scale == 0.0 { self.from * libm::exp(x) } else { self.from + self.scale * x }
    }

    /// The x of a value, within the bounds.
    pub fn x_of(&self, value: f64) -> f64 {
        let x =
            if self.scale == 0.0 { libm::log(value / self.from) } else { (value - self.from) / self.scale };
        x.clamp(self.low, self.high)
    }

    /// How far the value moves with x, at x.
    pub fn slope(&self, x: f64) -> f64 {
        if self.scale == 0.0 { self.value(x) } else { self.scale }
    }
}

/// Values of the free numbers, and when the terms begin that begin at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// One for each free number.
    pub x: Vec<f64>,
    /// One for each candidate term, in seconds; 0 for those that act from the start.
    pub onsets: Vec<f64>,
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
    /// The plant's stated numbers.
    pub numbers: Vec<Number>,
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

/// How far the logarithm of a plant's number moves, at least, and in its prior deviations.
const LOG_REACH: f64 = 2.0;
const DEVIATIONS: f64 = 5.0;
const STEP: f64 = 1e-3;
const ROUGH_STEP: f64 = 5e-3;
const LOG_STEP: f64 = 1e-4;
const NOISE_STEP: f64 = 0.02;
const FAR: f64 = 1e3;
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
            free.extend(plant_number(i, number, scales, priors, model.sample_time_s));
        }
        let own_delay = numbers.iter().any(|number| number.role == Role::Delay && number.value > 0.0);
        free.push(Free {
            target: Target::ConstantLoad,
            name: "load".into(),
            from: 0.0,
            scale: scales.drive,
            low: -FAR,
            high: FAR,
            step: LOG_STEP,
            prior: Some(priors.constant_load),
            smooth: true,
        });
        if !own_delay {
            free.push(Free {
                target: Target::Late,
                name: "late".into(),
                from: 0.0,
                scale: model.sample_time_s,
                low: -1.0,
                high: 1.0,
                step: STEP,
                prior: Some(priors.late_samples),
                smooth: true,
            });
        }
        let shortest = libm::log(3.0 * scales.sample_time_s);
        let longest = libm::log(priors.longest_tau * scales.duration_s).max(shortest + 0.1);
        for (target, name, low, high) in [
            (Target::LoadSize, "load_size", -9.0, 3.0),
            (Target::LoadTau, "load_tau", shortest, longest),
            (Target::SensorRho, "sensor_rho", -1.0, priors.most_rho_atanh),
        ] {
            let (name, step) = (name.to_owned(), NOISE_STEP);
            free.push(Free {
                target,
                name,
                from: 0.0,
                scale: 1.0,
                low,
                high,
                step,
                prior: None,
                smooth: true,
            });
        }
        let model = Loop { sensor: crate::control_loop::Sensor { noise: 0.0 }, ..model.clone() };
        let stated = model.physics.len();
        let means = (scales.u_mean, scales.y_mean);
        let level = if priors.about_level { Level::of(&model.plant, means) } else { None };
        Self { model, stated, free, numbers, level, scales: scales.clone() }
    }

    /// The same with one more candidate term; its numbers come before the noise's.
    #[must_use]
    pub fn with(&self, term: Term) -> Self {
        let mut wider = self.clone();
        let index = wider.model.physics.len();
        let at =
            wider.free.iter().position(|free| free.target == Target::LoadSize).unwrap_or(wider.free.len());
        wider.free.splice(at..at, term_numbers(index, &term, &self.scales));
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

    /// Whether a candidate's number lies at an end of where it is looked for: the kind stands in for something else.
    pub fn is_at_an_end(&self, candidate: usize, point: &Point) -> bool {
        let index = self.stated + candidate;
        self.free.iter().zip(&point.x).any(|(free, x)| {
            let Target::Term { term, parameter } = free.target else { return false };
            let parameter = self.model.physics.get(term).and_then(|of| of.kind.parameters.get(parameter));
            let Some(parameter) = parameter.filter(|_| term == index) else { return false };
            let at = |end: f64| (x - end).abs() <= AT_AN_END * end.abs();
            parameter.searched != Searched::Everywhere
                && (at(free.high) || (at(free.low) && free.value(free.low) != 0.0))
        })
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
        Point { x, onsets }
    }

    /// The point at which all numbers are as the hypothesis' own loop has them.
    pub fn own_point(&self) -> Point {
        Point {
            x: self.free.iter().map(|free| self.own_x(free)).collect(),
            onsets: self.candidates().iter().map(|term| term.onset_s).collect(),
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

    /// The loop and the noise at a point; `None` where a term's numbers contradict each other.
    pub fn realise(&self, point: &Point) -> Option<Realised> {
        let mut model = self.model.clone();
        let mut numbers: Vec<f64> = self.numbers.iter().map(|number| number.value).collect();
        for (term, onset_s) in model.physics.iter_mut().skip(self.stated).zip(&point.onsets) {
            term.onset_s = *onset_s;
        }
        let (mut constant_load, mut late_s) = (0.0, 0.0);
        let (mut size, mut tau, mut rho) = (0.0, 1.0, 0.0);
        for (free, x) in self.free.iter().zip(&point.x) {
            let value = free.value(*x);
            match free.target {
                Target::Plant(i) => *numbers.get_mut(i)? = value,
                Target::ConstantLoad => constant_load = value,
                Target::Late => late_s = value,
                Target::Term { term, parameter } => {
                    *model.physics.get_mut(term)?.parameters.get_mut(parameter)? = value;
                }
                Target::Onset(term) => model.physics.get_mut(term)?.onset_s = value,
                Target::LoadSize => size = libm::exp(value),
                Target::LoadTau => tau = libm::exp(value),
                Target::SensorRho => rho = libm::tanh(value),
            }
        }
        model.plant = model.plant.with_numbers(&numbers);
        constant_load += self.level_load(&model.plant)?;
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
            growth,
            growth_from_s,
        };
        Some(Realised { model, noise, constant_load, late_s })
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

/// A plant's number as a free one; an offset is what the constant load moves.
fn plant_number(i: usize, number: &Number, scales: &Scales, priors: &Priors, ts: f64) -> Option<Free> {
    let name = format!("plant.{}", number.name);
    let target = Target::Plant(i);
    let reach = LOG_REACH.max(DEVIATIONS * priors.plant_log);
    let moved = |scale: f64, low: f64| Free {
        target,
        name: name.clone(),
        from: number.value,
        scale,
        low,
        high: FAR,
        step: STEP,
        prior: Some(1.0),
        smooth: true,
    };
    match number.role {
        Role::Offset => None,
        _ if number.value != 0.0 => Some(Free {
            target,
            name: name.clone(),
            from: number.value,
            scale: 0.0,
            low: -reach,
            high: reach,
            step: if number.role == Role::Delay {
                (0.01 * ts / number.value).clamp(LOG_STEP, 0.02)
            } else {
                LOG_STEP
            },
            prior: Some(priors.plant_log),
            smooth: true,
        }),
        Role::Delay => Some(moved(ts, 0.0)),
        Role::Viscous => Some(moved(scales.drive / scales.speed, 0.0)),
        _ => None,
    }
}

/// A term's parameters, and its onset where it grows from there.
fn term_numbers(index: usize, term: &Term, scales: &Scales) -> Vec<Free> {
    let mut free: Vec<Free> = Vec::new();
    for (i, (parameter, value)) in term.kind.parameters.iter().zip(&term.parameters).enumerate() {
        // Noise that grows is no part of a prediction.
        if parameter.name == "noise_growth_per_s" {
            continue;
        }
        let scale = (parameter.scale)(scales, *value).abs().max(1e-300);
        let x_of = |value: f64| (value - parameter.neutral) / scale;
        let (low, high) = match parameter.range {
            Range::Any => (-1e9, 1e9),
            Range::Positive => (x_of(0.0) + 1e-4, 1e9),
            Range::NotNegative => (x_of(0.0), 1e9),
            Range::Between(low, high) => (x_of(low), x_of(high)),
        };
        let (low, high) = match parameter.searched {
            Searched::Everywhere => (low, high),
            Searched::Scales(most) => (low.max(-most), high.min(most)),
            Searched::Between(lowest, highest) => (low.max(x_of(lowest)), high.min(x_of(highest))),
        };
        // A part of a wave is no wave: it stands for a ramp, or for a spring.
        let (low, high) = match (term.kind.search, i) {
            (Starts::Wave(Over::Time), 1) => (x_of(1.0 / scales.duration_s), high),
            // A stated wave may be longer than the way.
            (Starts::Wave(Over::Position), 1) => (low, x_of(scales.position).max(low)),
            _ => (low, high),
        };
        free.push(Free {
            target: Target::Term { term: index, parameter: i },
            name: format!("{}.{}", term.kind.name, parameter.name),
            from: parameter.neutral,
            scale,
            low,
            high,
            step: if parameter.smooth { STEP } else { ROUGH_STEP },
            prior: None,
            smooth: parameter.smooth,
        });
    }
    if matches!(term.kind.search, Starts::Ramp(_)) {
        free.push(Free {
            target: Target::Onset(index),
            name: format!("{}.onset_s", term.kind.name),
            from: 0.0,
            scale: scales.duration_s,
            low: 0.01,
            high: 0.97,
            step: 2e-3,
            prior: None,
            smooth: true,
        });
    }
    free
}

/// Whether a number is the noise's.
pub fn is_noise(target: Target) -> bool {
    matches!(target, Target::LoadSize | Target::LoadTau | Target::SensorRho)
}
