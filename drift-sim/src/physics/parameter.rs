//! One parameter of a kind: what it may be, where a diagnosis looks for it, and how far it has to move to matter.

use super::Scales;

/// What a parameter may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Any finite number.
    Any,
    /// Greater than zero.
    Positive,
    /// Zero or greater.
    NotNegative,
    /// From the first to the second, both included.
    Between(f64, f64),
}

impl Range {
    /// Whether a value is allowed; numbers that are not finite never are.
    pub fn allows(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Any => true,
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Between(lowest, highest) => (lowest..=highest).contains(&value),
            }
    }

    /// From its lower end to its upper one; infinite where it has none.
    pub fn length(self) -> f64 {
        match self {
            Self::Between(lowest, highest) => highest - lowest,
            Self::Any | Self::Positive | Self::NotNegative => f64::INFINITY,
        }
    }

    /// In words, for messages.
    pub fn says(self) -> String {
        match self {
            Self::Any => "a finite number".into(),
            Self::Positive => "a finite number > 0".into(),
            Self::NotNegative => "a finite number >= 0".into(),
            Self::Between(lowest, highest) => format!("a number from {lowest} to {highest}"),
        }
    }
}

/// Where a diagnosis looks for a parameter's value: no machine is found with a thousand times the mass that its model has, and a fit that wants one
/// stands in for something else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Searched {
    /// All over its range.
    Everywhere,
    /// Up to so many of its scales from where the term does nothing.
    Scales(f64),
    /// Up to this part of the recording's duration.
    Duration(f64),
    /// From the first to the second.
    Between(f64, f64),
}

/// Part of a recording that a lag takes at most: one as long as the recording integrates, and looks like a sensor that is not connected.
const LONGEST_LAG: f64 = 1.0 / 3.0;

/// Scales of a signal from which on nothing is of its size: a drive that rests nearly all the time may peak at some ten of its deviations.
const MOST_SCALES: f64 = 100.0;

/// A number of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shared {
    /// The load that stays.
    ConstantLoad,
    /// A servo's viscous friction.
    Viscous,
}

/// One parameter of a kind.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its key in files.
    pub name: &'static str,
    /// Its unit as a rule: text in which `{y}`, `{u}`, `{drive}`, `{position}` and `{speed}` stand for the loop's
    /// own units; see [`UnitNames::unit`](super::UnitNames::unit).
    pub unit: &'static str,
    /// What it may be.
    pub range: Range,
    /// Where a diagnosis looks for it.
    pub searched: Searched,
    /// How far it typically has to move for the loop to change, from the recording's scales and the value that a fit starts at.
    pub scale: fn(&Scales, f64) -> f64,
    /// Whether the loop changes smoothly with it: else a fit takes longer steps and tries its values one by one.
    pub smooth: bool,
    /// Its value at which the term does nothing; of a limit, at which nothing passes.
    pub neutral: f64,
    /// Whether it is a limit: the larger it is, the less it does, and no value of it does nothing.
    pub limits: bool,
    /// Its value where a file leaves it out; `None`: it may not be left out.
    pub default: Option<f64>,
    /// Whether a fit moves it: else it is the term's form, of which a search tries those that its points have, or nothing that a recording's samples show one by one.
    pub fitted: bool,
    /// How large it may be, as the term's parameters tell, where it is a state in which a recording begins: each recording has its own. `None` of a number that stays.
    pub state: Option<fn(&[f64]) -> f64>,
    /// The number of the loop that can do wholly what this one does, where there is one: only the two together are told.
    pub shared: Option<Shared>,
}

impl Parameter {
    /// A parameter that has to be stated and that the loop follows smoothly.
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        range: Range,
        scale: fn(&Scales, f64) -> f64,
    ) -> Self {
        Self {
            name,
            unit,
            range,
            searched: Searched::Everywhere,
            scale,
            smooth: true,
            neutral: 0.0,
            limits: false,
            default: None,
            fitted: true,
            state: None,
            shared: None,
        }
    }

    /// The same where the loop answers in jumps (gaps, bands, limits).
    pub(super) const fn rough(mut self) -> Self {
        self.smooth = false;
        self
    }

    /// The same where the term does nothing at this value.
    pub(super) const fn around(mut self, neutral: f64) -> Self {
        self.neutral = neutral;
        self
    }

    /// The same of a limit.
    pub(super) const fn limiting(mut self) -> Self {
        self.limits = true;
        self
    }

    /// The same, looked for where it has the size of the signals.
    pub(super) const fn of_signals(mut self) -> Self {
        self.searched = Searched::Scales(MOST_SCALES);
        self
    }

    /// The same, looked for where it is over within the recording.
    pub(super) const fn of_lags(mut self) -> Self {
        self.searched = Searched::Duration(LONGEST_LAG);
        self
    }

    /// The same, looked for between these values.
    pub(super) const fn searched(mut self, lowest: f64, highest: f64) -> Self {
        self.searched = Searched::Between(lowest, highest);
        self
    }

    /// The same with a value for where a file leaves it out.
    pub(super) const fn or(mut self, value: f64) -> Self {
        self.default = Some(value);
        self
    }

    /// The same of one that no fit moves.
    pub(super) const fn not_fitted(mut self) -> Self {
        self.fitted = false;
        self
    }

    /// The same of a state in which a recording begins, up to this size.
    pub(super) const fn state_up_to(mut self, most: fn(&[f64]) -> f64) -> Self {
        self.state = Some(most);
        self
    }

    /// The same where a number of the loop can do what this one does.
    pub(super) const fn shared_with(mut self, shared: Shared) -> Self {
        self.shared = Some(shared);
        self
    }

    /// Whether a value that is known within so much, in its own unit, may be the one at which the term does nothing.
    pub fn may_be_neutral(&self, value: f64, half_width: f64) -> bool {
        !self.limits && (value - self.neutral).abs() <= half_width
    }
}
