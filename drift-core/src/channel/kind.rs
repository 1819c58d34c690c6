//! The kinds of channels. A kind is one file, with its coordinates and its [`ChannelMeaning`], and one row of the table at the end of
//! this one.
//!
//! To add one touches three files by hand: here its own and this one; in the C interface, whose header can't be generated from a
//! table, its number in `codes.rs` (a wrong or a missing one does not compile). Baseline files, commands, exports,
//! axes and sentences follow from the rows.

mod activity;
mod effort;
mod energy_error;
mod motion_effort;

use crate::index::{Index, Indices};
use crate::report::Location;

/// What a kind of channel looks at and what its deviation may mean, in words; for programs that show it. A controller links none of
/// the words.
#[derive(Debug, Clone, Copy)]
pub struct ChannelMeaning {
    /// Where the fault is when this kind alone is away from its baseline.
    pub location: Location,
    /// Its place among the three channels of a baseline file, from 0. Kinds of one place exclude each other.
    pub place: usize,
    /// The word that chooses it among the kinds of its place (`drift calibrate --effort WORD`), where there is a choice.
    pub chosen_by: Option<&'static str>,
    /// Its relation may reach back over earlier windows and depend on a measured operating point.
    pub remembers: bool,
    /// Its x is y: a sensor's bias moves it along the relation.
    pub x_is_y: bool,
    /// The name of its x axis; `u` and `y` stand for the units of u and y.
    pub x_axis: &'static str,
    /// The name of its value axis; the index is that of the kind, if it has one.
    pub value_axis: fn(Index) -> &'static str,
    /// What it looks at.
    pub looks_at: &'static str,
    /// What it is that the value is above the baseline: the beginning of a sentence.
    pub above: &'static str,
    /// The same below it.
    pub below: &'static str,
    /// What may be the matter where it is above: a sentence.
    pub cause_above: &'static str,
    /// The same below.
    pub cause_below: &'static str,
    /// What a change of the value is, where that is a change of u.
    pub change_of_u: Option<&'static str>,
    /// Why there is no line where x is the same in all windows.
    pub x_is_constant: &'static str,
}

/// A row of the table, for programs that write, read or show every kind there is.
#[derive(Debug, Clone, Copy)]
pub struct ChannelRow {
    /// The name in files, commands and reports.
    pub name: &'static str,
    /// The name of the variant.
    pub variant: &'static str,
    /// The kind; where it has an index, with IAE.
    pub kind: ChannelKind,
    /// What it is about.
    pub meaning: ChannelMeaning,
}

const fn first(of: &[Index]) -> Option<Index> {
    match of {
        [index, ..] => Some(*index),
        [] => None,
    }
}

/// Rows: the variant, which has an index or not; the file, whose name is the kind's name everywhere; its number in C and in
/// saved states.
macro_rules! channels {
    ($($(#[$doc:meta])* $Variant:ident $(($index:ident: $Index:ty))? = $file:ident: $number:literal;)*) => {
        /// What is compared with what.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(
            feature = "serde",
            derive(serde::Serialize, serde::Deserialize),
            serde(rename_all = "snake_case")
        )]
        pub enum ChannelKind {
            $($(#[$doc])* $Variant $(($Index))?,)*
        }

        impl ChannelKind {
            /// The table.
            pub const ROWS: &'static [ChannelRow] = &[$(ChannelRow {
                name: stringify!($file),
                variant: stringify!($Variant),
                kind: channels!(@iae $Variant $($index)?),
                meaning: $file::MEANING,
            }),*];

            /// (x, value): where on the baseline's axis the window lies, and the index that is judged there.
            pub const fn coordinates(self, of: &Indices) -> (f32, f32) {
                match self {
                    $(Self::$Variant $(($index))? => $file::coordinates(of $(, $index)?),)*
                }
            }

            /// The channel's name in files, commands and reports.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$Variant { .. } => stringify!($file),)*
                }
            }

            /// What it is about.
            pub const fn meaning(self) -> &'static ChannelMeaning {
                match self {
                    $(Self::$Variant { .. } => &$file::MEANING,)*
                }
            }

            /// [`ChannelMeaning::location`], without its words.
            pub const fn location(self) -> Location {
                match self {
                    $(Self::$Variant { .. } => const { $file::MEANING.location },)*
                }
            }

            /// [`ChannelMeaning::remembers`], without the words.
            pub const fn remembers(self) -> bool {
                match self {
                    $(Self::$Variant { .. } => const { $file::MEANING.remembers },)*
                }
            }

            /// The error index that it compares, if it does.
            pub const fn index(self) -> Option<Index> {
                match self {
                    $(Self::$Variant $(($index))? => first(&[$($index)?]),)*
                }
            }

            /// The same kind of another index, where it has one.
            #[must_use]
            pub const fn with_index(self, other: Index) -> Self {
                match self {
                    $(Self::$Variant { .. } => channels!(@with other $Variant $($index)?),)*
                }
            }

            /// Its number in the C interface.
            pub const fn number(self) -> u32 {
                match self {
                    $(Self::$Variant { .. } => $number,)*
                }
            }

            /// The kind with this number, of IAE where it has an index.
            pub const fn numbered(number: u32) -> Option<Self> {
                match number {
                    $($number => Some(channels!(@iae $Variant $($index)?)),)*
                    _ => None,
                }
            }
        }
    };
    (@iae $Variant:ident) => { ChannelKind::$Variant };
    (@iae $Variant:ident $index:ident) => { ChannelKind::$Variant(Index::Iae) };
    (@with $other:ident $Variant:ident) => { ChannelKind::$Variant };
    (@with $other:ident $Variant:ident $index:ident) => { ChannelKind::$Variant($other) };
}

channels! {
    /// J_e against E_u: the paper's pair.
    EnergyError(index: Index) = energy_error: 0;
    /// Mean u against mean y: how much effort it takes to hold y. Loads, leaks, biases and lost gain show here.
    Effort = effort: 1;
    /// Mean of u sign(dy) against the speed: the effort channel of a plant that integrates, which needs no effort
    /// to stand still. Dry friction is its intercept, viscous friction its slope.
    MotionEffort = motion_effort: 2;
    /// E_u against the reference's own activity: changed dynamics, gain and noise show here.
    Activity = activity: 3;
}

impl ChannelKind {
    /// The kind of this name, of IAE where it has an index.
    pub fn named(name: &str) -> Option<Self> {
        Self::ROWS.iter().find(|row| row.name == name).map(|row| row.kind)
    }

    /// The kind that this word chooses ([`ChannelMeaning::chosen_by`]).
    pub fn chosen(word: &str) -> Option<Self> {
        Self::ROWS.iter().find(|row| row.meaning.chosen_by == Some(word)).map(|row| row.kind)
    }

    /// In fingerprints of configurations.
    pub(super) const fn tag(self) -> u32 {
        match self.index() {
            Some(index) => 16 + index as u32,
            None => self.number(),
        }
    }
}
