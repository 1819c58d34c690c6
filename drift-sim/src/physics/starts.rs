//! Where the search for a kind of physics begins.

use super::{Scales, Term};

/// How a kind finds its starting values.
#[derive(Debug, Clone, Copy)]
pub enum Starts {
    /// These points are tried, one simulation each.
    Grid(fn(&Scales) -> Vec<Start>),
    /// The same, and what a fit of another kind leads to that does nearly the same.
    GridLike {
        /// The points that are tried.
        points: fn(&Scales) -> Vec<Start>,
        /// Parameters with which it does what a term of another kind does, where there are any.
        like: fn(&Term) -> Option<Vec<f64>>,
    },
    /// The same where the likelihood is a peak too narrow for a grid, along which it is not smooth: random steps climb it from the best points, and no slope
    /// is asked for. Thousands of points near a fit of it that is good but may lie beside the peak are judged by a linear forecast.
    Peak {
        /// The points that are tried at first.
        coarse: fn(&Scales) -> Vec<Start>,
        /// The points that are tried where one costs no simulation.
        dense: fn(&Scales) -> Vec<Vec<f64>>,
        /// Those of every jump about parameters that may lie beside the peak, for a stretch of few samples.
        every_jump: fn(&[f64]) -> Vec<Vec<f64>>,
        /// Those about the parameters of a fit.
        fine: fn(&[f64]) -> Vec<Vec<f64>>,
        /// Many more of them, for a peak that lies between those.
        finest: fn(&[f64]) -> Vec<Vec<f64>>,
        /// Those at which other tops lie that do nearly what this one does, given the parameters at a top.
        in_step: fn(&[f64]) -> Vec<Vec<f64>>,
        /// About the same in the kind's other forms, given the parameters of a fit.
        forms: fn(&[f64]) -> Vec<Vec<f64>>,
        /// Parameters with which it does what a term of another kind does, where there are any: a fit of that leads to its peak as well.
        like: fn(&Term) -> Option<Vec<f64>>,
    },
    /// It begins at an unknown time, and from then on acts in proportion to a signal: a matched filter finds when.
    Onset(Weight),
    /// It grows from an unknown time on.
    Ramp(Weight),
    /// It repeats: a spectrum finds how often. Its parameters are amplitude, frequency or period, and phase.
    Wave(Over),
    /// Noise changes at an unknown time.
    NoiseChange,
    /// The likelihood of y is not where it is found: the grid of y, spans of an injected signal, the control law.
    Apart,
}

impl Starts {
    /// Whether the likelihood is a peak as narrow as a needle.
    pub fn is_peak(&self) -> bool {
        matches!(self, Self::Peak { .. })
    }

    /// The points that are tried, where there are any.
    pub fn points(&self, scales: &Scales) -> Option<Vec<Start>> {
        match self {
            Self::Peak { coarse, .. } => Some(coarse(scales)),
            _ => self.grid(scales),
        }
    }

    /// The same but for those of a peak.
    pub fn grid(&self, scales: &Scales) -> Option<Vec<Start>> {
        match self {
            Self::Grid(points) | Self::GridLike { points, .. } => Some(points(scales)),
            _ => None,
        }
    }

    /// Parameters with which the kind does what a term of another one does, where there are any.
    pub fn like(&self, term: &Term) -> Option<Vec<f64>> {
        match self {
            Self::GridLike { like, .. } | Self::Peak { like, .. } => like(term),
            _ => None,
        }
    }
}

/// What acts in proportion to a term's parameter after its onset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// A constant, on the drive.
    Load,
    /// A constant, on y.
    Sensor,
    /// The actuator's drive.
    Drive,
    /// Viscous friction.
    Viscous,
    /// The force that accelerates.
    Acceleration,
    /// y, on the drive.
    Output,
}

/// What a wave repeats over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// Time.
    Time,
    /// Position.
    Position,
}

/// A point to begin at.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// The term's parameters.
    pub parameters: Vec<f64>,
    /// Logarithm of what the plant's gain is multiplied by beside it.
    pub gain: f64,
    /// The same of its time constant.
    pub time: f64,
}

impl Start {
    /// These parameters, the plant as it is.
    pub fn of(parameters: Vec<f64>) -> Self {
        Self { parameters, gain: 0.0, time: 0.0 }
    }
}

/// One start for each point.
pub fn grid<P>(points: impl IntoIterator<Item = P>, parameters: impl Fn(P) -> Vec<f64>) -> Vec<Start> {
    points.into_iter().map(|point| Start::of(parameters(point))).collect()
}
