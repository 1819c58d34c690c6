//! What a monitor can do, as a type: what is not chosen is not linked and needs no memory.
//!
//! ```
//! use drift_core::{Cusum, Forgetful, Never, Options, Shewhart, Tumbling, TotalExcluded};
//!
//! /// Windows that follow one another, two detectors, gaps made up; no blanking, no refitted curve.
//! #[derive(Debug, Clone, Copy)]
//! struct Mine;
//! impl Options for Mine {
//!     type Window = Tumbling;
//!     type Detectors = (Shewhart, Cusum);
//!     type Curve = Never;
//!     type Blanking = Never;
//!     type Excluded = TotalExcluded;
//!     type Memory = Forgetful;
//!     const GAPS: bool = true;
//! }
//! ```

use core::fmt::Debug;

use crate::blanking::BlankingKind;
use crate::course::Curve;
use crate::detector::{AllDetectors, Cusum, DetectorSet};
use crate::memory::{Forgetful, MemoryKind, Remembering};
use crate::sample::{Excluded, Exclusions, TotalExcluded};
use crate::window::{Sliding, Tumbling, WindowKind};

/// What a monitor can do. A configuration that asks for more is refused.
pub trait Options: Copy + Debug + 'static {
    /// [`Tumbling`] (the hop is the window) or [`Sliding`].
    type Window: WindowKind;
    /// One [`crate::Detector`], a pair of them (which nests), or [`AllDetectors`].
    type Detectors: DetectorSet;
    /// Whether a confirmed drift is reported with its refitted curve: [`crate::Refitted`] or [`Never`].
    type Curve: Curve;
    /// Whether ticks after a step of the reference can be left out: [`crate::Blanks`] or [`Never`].
    type Blanking: BlankingKind;
    /// Ticks left out are counted by reason ([`Excluded`]) or in all ([`TotalExcluded`]).
    type Excluded: Exclusions;
    /// Whether a channel's relation can reach back over earlier windows: [`Remembering`] or [`Forgetful`].
    type Memory: MemoryKind;
    /// u can have limits, at which a sample is left out.
    const LIMITS: bool = false;
    /// Gaps are made up in proportion; else a window in which a tick is left out is not judged.
    const GAPS: bool = false;
    /// A residual is standardised with the baseline's own uncertainty at the window's x (one square root); else by
    /// sigma alone, as for a baseline that is known exactly.
    const PREDICTION: bool = false;
}

/// Not linked: no state, no code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Never;

/// The smallest that is useful: one CUSUM on an exactly known relation.
#[derive(Debug, Clone, Copy)]
pub struct Smallest;

impl Options for Smallest {
    type Window = Tumbling;
    type Detectors = Cusum;
    type Curve = Never;
    type Blanking = Never;
    type Excluded = TotalExcluded;
    type Memory = Forgetful;
}

/// What the paper does, on windows that follow one another: one CUSUM on a learnt relation, a confirmed drift with
/// its curve, and gaps made up.
#[derive(Debug, Clone, Copy)]
pub struct Paper;

impl Options for Paper {
    type Window = Tumbling;
    type Detectors = Cusum;
    type Curve = crate::course::Refitted;
    type Blanking = Never;
    type Excluded = TotalExcluded;
    type Memory = Forgetful;
    const GAPS: bool = true;
    const PREDICTION: bool = true;
}

/// All that there is, chosen by the configuration at run time; windows of up to `B` blocks.
#[derive(Debug, Clone, Copy)]
pub struct Everything<const B: usize>;

impl<const B: usize> Options for Everything<B> {
    type Window = Sliding<B>;
    type Detectors = AllDetectors;
    type Curve = crate::course::Refitted;
    type Blanking = crate::blanking::Blanks;
    type Excluded = Excluded;
    type Memory = Remembering;
    const LIMITS: bool = true;
    const GAPS: bool = true;
    const PREDICTION: bool = true;
}
