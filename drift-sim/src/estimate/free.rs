//! The free numbers of a hypothesis: what each stands for, how a fit moves it, and how far.

use crate::measured_input::{Enters, Input};
use crate::physics::{Over, Range, Scales, Searched, Starts, Term};
use crate::plant::{Number, Plant, Role};

use super::hypothesis::Priors;

/// What a free number stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// The plant's number of this place.
    Plant(usize),
    /// A load that stays.
    ConstantLoad,
    /// The gain of the measured input of this place.
    InputGain(usize),
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
    /// Logarithm of the variance of the white noise that rounding adds, over the rest's.
    SensorWhite,
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

/// How far the logarithm of a plant's number moves, at least, and in its prior deviations.
const LOG_REACH: f64 = 2.0;
const DEVIATIONS: f64 = 5.0;
const STEP: f64 = 1e-3;
const ROUGH_STEP: f64 = 5e-3;
const LOG_STEP: f64 = 1e-4;
const NOISE_STEP: f64 = 0.02;
const FAR: f64 = 1e3;
/// A plant's number as a free one; an offset is what the constant load moves.
pub fn of_plant(i: usize, number: &Number, scales: &Scales, priors: &Priors, ts: f64) -> Option<Free> {
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
pub fn of_term(index: usize, term: &Term, scales: &Scales) -> Vec<Free> {
    let mut free: Vec<Free> = Vec::new();
    for (i, (parameter, value)) in term.kind.parameters.iter().zip(&term.parameters).enumerate() {
        if !parameter.fitted {
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
            Searched::Duration(part) => (low, high.min(x_of(part * scales.duration_s).max(low))),
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
            low: 0.0,
            high: 0.97,
            step: 2e-3,
            prior: None,
            smooth: true,
        });
    }
    free
}

/// A load that stays.
pub fn constant_load(scales: &Scales, priors: &Priors) -> Free {
    Free {
        target: Target::ConstantLoad,
        name: "load".into(),
        from: 0.0,
        scale: scales.drive,
        low: -FAR,
        high: FAR,
        step: LOG_STEP,
        prior: Some(priors.constant_load),
        smooth: true,
    }
}

/// The gain of a measured input, where it is free: none of one that never changes. One of x moves the drive by its own deviation.
pub fn of_input(i: usize, input: &Input, plant: &Plant, scales: &Scales, priors: &Priors) -> Option<Free> {
    let (_, deviation) = scales.inputs.get(i).copied().filter(|(_, deviation)| *deviation > 0.0)?;
    let size = match input.enters {
        Enters::Load => scales.drive,
        Enters::Actuator => scales.drive / plant.drive_gain().abs(),
        Enters::Sensor => return None,
    };
    input.gain.is_free().then(|| Free {
        target: Target::InputGain(i),
        name: format!("input.{}.gain", input.name()),
        from: input.gain.value(),
        scale: size / deviation,
        low: -FAR,
        high: FAR,
        step: STEP,
        prior: Some(priors.input_gain),
        smooth: true,
    })
}

/// How late the recording shows y.
pub fn late(sample_time_s: f64, priors: &Priors) -> Free {
    Free {
        target: Target::Late,
        name: "late".into(),
        from: 0.0,
        scale: sample_time_s,
        low: -1.0,
        high: 1.0,
        step: STEP,
        prior: Some(priors.late_samples),
        smooth: true,
    }
}

/// The numbers of the random load and of the sensor's noise.
pub fn of_noise(scales: &Scales, priors: &Priors) -> impl Iterator<Item = Free> {
    let shortest = libm::log(3.0 * scales.sample_time_s);
    let longest = libm::log(priors.longest_tau * scales.duration_s).max(shortest + 0.1);
    let numbers = [
        (Target::LoadSize, "load_size", -9.0, 3.0),
        (Target::LoadTau, "load_tau", shortest, longest),
        (Target::SensorRho, "sensor_rho", -1.0, priors.most_rho_atanh),
    ];
    let own = numbers.into_iter().map(|(target, name, low, high)| Free {
        target,
        name: name.into(),
        from: 0.0,
        scale: 1.0,
        low,
        high,
        step: NOISE_STEP,
        prior: None,
        smooth: true,
    });
    own.chain(scales.y_step.and_then(|step| of_rounding(step, scales.noise)))
}

/// Prior deviation of the logarithm of what rounding adds to the sensor's noise: of colored noise second differences show a part.
const ROUNDING_LOG: f64 = 1.5;
/// Greatest variance that rounding adds, over the rest's.
const MOST_ROUNDING: f64 = 16.0;

/// Part of the fast noise's variance below which what rounding adds is none that counts: that of a step of a quarter of its deviation.
const LEAST_ROUNDING: f64 = 0.005;

/// The white noise that rounding adds: a twelfth of the step's square, beside what second differences show of the rest.
fn of_rounding(step: f64, noise: f64) -> Option<Free> {
    let added = step * step / 12.0;
    if added < LEAST_ROUNDING * noise * noise {
        return None;
    }
    let rest = (noise * noise - added).max(added / MOST_ROUNDING);
    Some(Free {
        target: Target::SensorWhite,
        name: "sensor_white".into(),
        from: libm::log(added / rest),
        scale: 1.0,
        low: -FAR,
        high: FAR,
        step: NOISE_STEP,
        prior: Some(ROUNDING_LOG),
        smooth: true,
    })
}

/// Whether a number is the loop's own: neither a candidate term's nor the noise's.
pub fn is_of_loop(target: Target) -> bool {
    matches!(target, Target::Plant(_) | Target::InputGain(_) | Target::ConstantLoad | Target::Late)
}

/// Whether a number is the noise's.
pub fn is_noise(target: Target) -> bool {
    matches!(target, Target::LoadSize | Target::LoadTau | Target::SensorRho | Target::SensorWhite)
}
