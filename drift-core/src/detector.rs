//! The detectors of a standardised residual. Their thresholds are numbers computed on the host; an update is
//! adds and compares.
//!
//! A detector is one file, with its [`Detector`] implementation, and one row of the table at the end of this one. To add one, with all
//! that can be done with it, touches seven files (it was 24): here its own, this one and the re-export in `lib.rs`; in drift-sim its
//! threshold in `calibrate/detector/` and the row beside it; in the C interface, which can't be generated, `config.rs` and
//! `report.rs`. Files, exports, commands and thresholds follow from the rows. What the statistic itself looks like in a report (JSON
//! lines, charts, the beginning of an event) is still written by hand in `drift-sim/src/monitor`.
//!
//! A repeated SPRT that restarts at its lower boundary is itself a CUSUM with another reset: running both at
//! equal cost adds their false alarms. Shewhart beside CUSUM is the sensible duo: the first finds a disturbance
//! at once, the second a small drift.

mod cusum;
mod ewma;
mod shewhart;
mod sprt;

pub use cusum::{Cusum, CusumState};
pub use ewma::{Ewma, EwmaState};
pub use shewhart::Shewhart;
pub use sprt::{Sprt, SprtState};

use core::fmt::Debug;

use crate::store::{Fingerprint, Reader, Writer};

/// To which side a residual moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Side {
    /// The residual lies above the baseline.
    // From 1: no side is then a byte of zero, and no alarms are cleared, not filled.
    High = 1,
    /// The residual lies below the baseline.
    Low,
}

/// What a detector remembers between decisions.
pub trait DetectorState: Copy + Debug + PartialEq {
    /// No evidence.
    const ZERO: Self;
    /// Saved bytes.
    const BYTES: usize;
    /// Saves.
    fn write(&self, to: &mut Writer<'_>);
    /// Restores; `None` past the end, or if a number is not finite.
    fn read(from: &mut Reader<'_>) -> Option<Self>;
}

/// A detector that remembers nothing.
impl DetectorState for () {
    const ZERO: Self = ();
    const BYTES: usize = 0;
    fn write(&self, _: &mut Writer<'_>) {}
    fn read(_: &mut Reader<'_>) -> Option<Self> {
        Some(())
    }
}

/// One detector: its thresholds. Sealed: those of [`Detectors`].
pub trait Detector: Copy + Debug + PartialEq + table::Row + 'static {
    /// What it remembers between decisions.
    type State: DetectorState;
    /// The state before the first decision, and after an alarm.
    fn start(&self) -> Self::State;
    /// One decision: the side that it alarms on, if it does.
    fn update(&self, state: &mut Self::State, z: f32) -> Option<Side>;
    /// Whether such a state can be.
    fn possible(&self, state: &Self::State) -> bool;
    /// The names of its numbers, in the order of [`Detector::each_number`].
    const FIELDS: &'static [&'static str];
    /// Its numbers, one by one.
    fn each_number(&self, each: impl FnMut(f32));
}

/// The detectors that are linked, as a type: a [`Detector`], a pair of such sets, or [`AllDetectors`].
pub trait DetectorSet: Copy + Debug + PartialEq + 'static {
    /// What they remember.
    type State: DetectorState;
    /// What of it is reported.
    type Shown: Copy + Debug + PartialEq;
    /// Before the first decision.
    const NOT_SHOWN: Self::Shown;
    /// Bit by bit, the rows of the table that are linked.
    const LINKED: u8;
    /// The state before the first decision.
    fn start(detectors: &Detectors) -> Self::State;
    /// One decision: feeds `z` to every detector that is configured.
    fn update(detectors: &Detectors, state: &mut Self::State, z: f32, alarms: &mut Alarms);
    /// What of the state is reported.
    fn shown(state: &Self::State) -> Self::Shown;
    /// Whether these detectors can hold such states; one that is absent never moves.
    fn possible(detectors: &Detectors, state: &Self::State) -> bool;
}

impl<D: Detector> DetectorSet for D {
    type State = D::State;
    type Shown = ();
    const NOT_SHOWN: () = ();
    const LINKED: u8 = D::BIT;
    fn start(detectors: &Detectors) -> D::State {
        D::configured(detectors).as_ref().map_or(D::State::ZERO, D::start)
    }
    #[inline(always)]
    fn update(detectors: &Detectors, state: &mut D::State, z: f32, alarms: &mut Alarms) {
        if let Some(detector) = D::configured(detectors) {
            *D::alarm(alarms) = detector.update(state, z);
        }
    }
    #[inline(always)]
    fn shown(_: &D::State) {}
    fn possible(detectors: &Detectors, state: &D::State) -> bool {
        D::configured(detectors).as_ref().map_or(*state == D::State::ZERO, |d| d.possible(state))
    }
}

impl<A: DetectorState, B: DetectorState> DetectorState for (A, B) {
    const ZERO: Self = (A::ZERO, B::ZERO);
    const BYTES: usize = A::BYTES + B::BYTES;
    fn write(&self, to: &mut Writer<'_>) {
        self.0.write(to);
        self.1.write(to);
    }
    fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some((A::read(from)?, B::read(from)?))
    }
}

impl<A: DetectorSet, B: DetectorSet> DetectorSet for (A, B) {
    type State = (A::State, B::State);
    type Shown = ();
    const NOT_SHOWN: () = ();
    const LINKED: u8 = A::LINKED | B::LINKED;
    fn start(detectors: &Detectors) -> Self::State {
        (A::start(detectors), B::start(detectors))
    }
    #[inline(always)]
    fn update(detectors: &Detectors, state: &mut Self::State, z: f32, alarms: &mut Alarms) {
        A::update(detectors, &mut state.0, z, alarms);
        B::update(detectors, &mut state.1, z, alarms);
    }
    #[inline(always)]
    fn shown(_: &Self::State) {}
    fn possible(detectors: &Detectors, state: &Self::State) -> bool {
        A::possible(detectors, &state.0) && B::possible(detectors, &state.1)
    }
}

/// Every detector of the table; what they hold is reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AllDetectors;

impl DetectorSet for AllDetectors {
    type State = DetectorStates;
    type Shown = DetectorStates;
    const NOT_SHOWN: DetectorStates = DetectorStates::ZERO;
    const LINKED: u8 = u8::MAX;
    fn start(detectors: &Detectors) -> DetectorStates {
        detectors.start()
    }
    fn update(detectors: &Detectors, state: &mut DetectorStates, z: f32, alarms: &mut Alarms) {
        *alarms = detectors.update(state, z);
    }
    fn shown(state: &DetectorStates) -> DetectorStates {
        *state
    }
    fn possible(detectors: &Detectors, state: &DetectorStates) -> bool {
        detectors.possible(state)
    }
}

/// A row of the table, for programs that write, read or show every detector there is.
#[derive(Debug, Clone, Copy)]
pub struct DetectorRow {
    /// The name in files, commands and reports.
    pub name: &'static str,
    /// The name of the type.
    pub type_name: &'static str,
    /// The names of its numbers.
    pub fields: &'static [&'static str],
    /// Hands over its numbers, in the order of the fields; false where it is not configured.
    pub numbers: fn(&Detectors, &mut dyn FnMut(f32)) -> bool,
}

/// Rows: the field's name, which is the detector's name everywhere, its type, its bit. The order is that in which
/// their sides are believed, so that the instant one comes last.
macro_rules! detectors {
    ($($(#[$doc:meta])* $field:ident: $Type:ident = $bit:literal;)*) => {
        mod table {
            use super::{Alarms, Detectors, Side};
            /// A row of the table.
            pub trait Row: Sized {
                /// The row's own bit.
                const BIT: u8;
                /// The name in files, commands and reports.
                const NAME: &'static str;
                /// The place in a configuration.
                fn configured(detectors: &Detectors) -> &Option<Self>;
                /// The place in a report.
                fn alarm(alarms: &mut Alarms) -> &mut Option<Side>;
            }
            $(impl Row for super::$Type {
                const BIT: u8 = $bit;
                const NAME: &'static str = stringify!($field);
                #[inline(always)]
                fn configured(detectors: &Detectors) -> &Option<Self> {
                    &detectors.$field
                }
                #[inline(always)]
                fn alarm(alarms: &mut Alarms) -> &mut Option<Side> {
                    &mut alarms.$field
                }
            })*
        }

        /// The detectors that watch one channel; each is optional.
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
        pub struct Detectors {
            $($(#[$doc])*
            #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
            pub $field: Option<$Type>,)*
        }

        /// What the detectors of one channel remember between decisions.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub struct DetectorStates {
            $(#[doc = concat!("Of [`", stringify!($Type), "`].")]
            pub $field: <$Type as Detector>::State,)*
        }

        /// Which detectors alarmed at this decision, and to which side.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub struct Alarms {
            $(#[doc = concat!("The side that [`", stringify!($Type), "`] alarmed on, if it did.")]
            pub $field: Option<Side>,)*
        }

        impl Detectors {
            /// None: the channel is only reported.
            pub const NONE: Self = Self { $($field: None),* };
            /// The detectors' names in files, commands and reports.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($field)),*];

            /// The table.
            pub const ROWS: &'static [DetectorRow] = &[$(DetectorRow {
                name: stringify!($field),
                type_name: stringify!($Type),
                fields: <$Type as Detector>::FIELDS,
                numbers: |of, each| {
                    of.$field.as_ref().map(|detector| detector.each_number(each)).is_some()
                },
            }),*];

            /// The states before the first decision.
            pub fn start(&self) -> DetectorStates {
                DetectorStates { $($field: <$Type as DetectorSet>::start(self)),* }
            }

            /// One decision: feeds `z` to every detector.
            pub fn update(&self, states: &mut DetectorStates, z: f32) -> Alarms {
                let mut alarms = Alarms::NONE;
                $(<$Type as DetectorSet>::update(self, &mut states.$field, z, &mut alarms);)*
                alarms
            }

            pub(crate) fn possible(&self, states: &DetectorStates) -> bool {
                $(<$Type as DetectorSet>::possible(self, &states.$field))&&*
            }

            pub(crate) const fn valid(&self) -> bool {
                $(if let Some(detector) = &self.$field && !detector.valid() {
                    return false;
                })*
                true
            }

            /// The name of one that is configured and not among the rows `linked`.
            pub(crate) const fn not_linked(&self, linked: u8) -> Option<&'static str> {
                $(if self.$field.is_some() && linked & $bit == 0 {
                    return Some(stringify!($field));
                })*
                None
            }

            pub(crate) fn fingerprint(&self, to: &mut Fingerprint<'_>) {
                $(if let Some(detector) = &self.$field {
                    to.u32($bit);
                    detector.each_number(|x| to.f32(x));
                })*
            }
        }

        impl DetectorState for DetectorStates {
            const ZERO: Self = Self { $($field: <$Type as Detector>::State::ZERO),* };
            const BYTES: usize = 0 $(+ <<$Type as Detector>::State as DetectorState>::BYTES)*;
            fn write(&self, to: &mut Writer<'_>) {
                $(self.$field.write(to);)*
            }
            fn read(from: &mut Reader<'_>) -> Option<Self> {
                Some(Self { $($field: DetectorState::read(from)?),* })
            }
        }

        impl Alarms {
            /// No detector alarmed.
            pub const NONE: Self = Self { $($field: None),* };

            /// The side that the slow detectors name, else the instant one's.
            pub fn side(&self) -> Option<Side> {
                None $(.or(self.$field))*
            }

            /// Each detector's name and the side that it alarmed on.
            pub fn each(&self) -> impl DoubleEndedIterator<Item = (&'static str, Option<Side>)> {
                [$((stringify!($field), self.$field)),*].into_iter()
            }
        }
    };
}

detectors! {
    /// Cumulative: small persistent shifts.
    cusum: Cusum = 1;
    /// Exponentially weighted: small persistent shifts, and slow ones.
    ewma: Ewma = 2;
    /// Sequential: a stated alternative in mean, or mean and variance.
    sprt: Sprt = 4;
    /// Instant: one residual beyond a limit.
    shewhart: Shewhart = 8;
}
