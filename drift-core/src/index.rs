//! The indices of one window: equations 2 and 3 of the paper, and what the other residual channels need.
//! Time in ITAE and ITSE is window-local: 0 at the window's first tick.

/// An error-performance index J_e (equation 3).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Index {
    /// Integral of |e| over the window, y-unit s.
    Iae,
    /// Integral of e^2, y-unit^2 s.
    Ise,
    /// Integral of t |e|, t from the start of the window, y-unit s^2.
    Itae,
    /// Integral of t e^2, t from the start of the window, y-unit^2 s^2.
    Itse,
}

/// The indices of one window, in the loop's units and seconds. What the set does not keep is NaN, and so are the
/// three that are made of differences from tick to tick where too few valid ticks follow one another.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Indices {
    /// Control energy, integral of u^2 (equation 2), u-unit^2 s.
    pub e_u: f32,
    /// Integral of |e|, y-unit s.
    pub iae: f32,
    /// Integral of e^2, y-unit^2 s.
    pub ise: f32,
    /// Integral of t |e|, y-unit s^2.
    pub itae: f32,
    /// Integral of t e^2, y-unit^2 s^2.
    pub itse: f32,
    /// Mean of u over the window's valid ticks, u-unit.
    pub mean_u: f32,
    /// Mean of y over the window's valid ticks, y-unit.
    pub mean_y: f32,
    /// Mean of e = r - y over the window's valid ticks, y-unit.
    pub mean_e: f32,
    /// Largest |u| at a valid tick, u-unit.
    pub peak_u: f32,
    /// Largest |e| at a valid tick, y-unit.
    pub peak_e: f32,
    /// The reference's own activity: sum of its squared steps from tick to tick, y-unit^2.
    pub reference_activity: f32,
    /// Effort along the motion: mean of u sign(dy), u-unit.
    pub motion_effort: f32,
    /// Mean of |dy|/dt, y-unit/s.
    pub speed: f32,
}

impl Indices {
    /// All NaN: what a set that keeps no sums reports.
    pub const NOT_KEPT: Self = Self {
        e_u: f32::NAN,
        iae: f32::NAN,
        ise: f32::NAN,
        itae: f32::NAN,
        itse: f32::NAN,
        mean_u: f32::NAN,
        mean_y: f32::NAN,
        mean_e: f32::NAN,
        peak_u: f32::NAN,
        peak_e: f32::NAN,
        reference_activity: f32::NAN,
        motion_effort: f32::NAN,
        speed: f32::NAN,
    };

    /// The error index asked for.
    pub const fn error_index(&self, index: Index) -> f32 {
        match index {
            Index::Iae => self.iae,
            Index::Ise => self.ise,
            Index::Itae => self.itae,
            Index::Itse => self.itse,
        }
    }
}

/// What a [`crate::Pair`] keeps of one window, in the loop's units and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PairIndices {
    /// Control energy, integral of u^2 (equation 2), u-unit^2 s.
    pub e_u: f32,
    /// The pair's error index.
    pub error: f32,
}

/// The indices of one window and the operating point at which they were had ([`crate::FullAt`]).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IndicesAt {
    /// As without an operating point.
    pub indices: Indices,
    /// Mean of the operating point over the window's valid ticks, in the unit it came in.
    pub operating_point: f32,
}

impl IndicesAt {
    /// All NaN: before the first window.
    pub const NOT_KEPT: Self = Self { indices: Indices::NOT_KEPT, operating_point: f32::NAN };
}
