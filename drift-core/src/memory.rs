//! A relation with memory: `value = b0 + b1*x + sum_j (x_j * x[t-j] + value_j * value[t-j])` over the last windows.
//!
//! A window's mean effort depends on where the loop came from: its lags carry over, and a line through this window's
//! pair alone leaves a residual that is correlated from window to window. With the last windows in the relation it
//! is white, so that thresholds made for independent windows hold, and smaller.
//!
//! A lasting shift is learnt by the relation's own memory within `order` windows, all but the part
//! `1 - sum_j value_j` of it ([`Memory::visible`]): that sum is bounded by [`Memory::MOST_OWN`], so that the memory
//! does not teach the channel to follow a drift.

use core::fmt::Debug;

use crate::store::{Fingerprint, Reader, Writer};

/// Coefficients of the last windows, the newest first.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Memory {
    /// Windows that are remembered: 0 (none) to 3.
    pub order: u8,
    /// Value units per x unit.
    pub x: [f32; Self::MOST],
    /// Value units per value unit.
    pub value: [f32; Self::MOST],
}

impl Memory {
    /// Most windows that can be remembered.
    pub const MOST: usize = 3;
    /// The sum of the value's own coefficients is at most this: a fifth of a lasting shift stays visible at least.
    pub const MOST_OWN: f32 = 0.8;
    /// Only this window's pair counts.
    pub const NONE: Self = Self { order: 0, x: [0.0; Self::MOST], value: [0.0; Self::MOST] };

    /// The part of a lasting shift of the value that stays visible in the residual.
    pub const fn visible(&self) -> f32 {
        let [a, b, c] = self.value;
        1.0 - (a + b + c)
    }

    pub(crate) const fn valid(&self) -> bool {
        let ([a, b, c], [d, e, f]) = (self.x, self.value);
        let finite = a.is_finite() && b.is_finite() && c.is_finite();
        // A sum that is not finite is not within the bound either.
        finite && d.abs() + e.abs() + f.abs() < 1e3 && d + e + f <= Self::MOST_OWN && self.order <= 3
    }

    pub(crate) fn fingerprint(&self, to: &mut Fingerprint<'_>) {
        if self.order > 0 {
            to.u32(u32::from(self.order));
            self.x.into_iter().chain(self.value).for_each(|w| to.f32(w));
        }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::NONE
    }
}

/// Whether memory is linked, as a type: [`Remembering`] or [`Forgetful`].
pub trait MemoryKind: Copy + Debug + 'static {
    /// What one channel remembers.
    type State: Copy + Debug + PartialEq;
    /// Nothing.
    const START: Self::State;
    /// Saved bytes.
    const BYTES: usize;
    /// It is linked.
    const LINKED: bool;
    /// What the windows before add to the relation; `None` while too few are remembered.
    fn carried(memory: &Memory, state: &Self::State) -> Option<f32>;
    /// A judged window.
    fn remember(state: &mut Self::State, x: f32, value: f32);
    /// A window that could not be judged.
    fn forget(state: &mut Self::State);
    /// Saves.
    fn write(state: &Self::State, to: &mut Writer<'_>);
    /// Restores.
    fn read(from: &mut Reader<'_>) -> Option<Self::State>;
}

/// Memory is not linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Forgetful;

impl MemoryKind for Forgetful {
    type State = ();
    const START: () = ();
    const BYTES: usize = 0;
    const LINKED: bool = false;
    #[inline(always)]
    fn carried(_: &Memory, (): &()) -> Option<f32> {
        Some(0.0)
    }
    #[inline(always)]
    fn remember((): &mut (), _: f32, _: f32) {}
    #[inline(always)]
    fn forget((): &mut ()) {}
    fn write((): &(), _: &mut Writer<'_>) {}
    fn read(_: &mut Reader<'_>) -> Option<()> {
        Some(())
    }
}

/// Memory is linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Remembering;

/// The last windows, the newest first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastWindows {
    x: [f32; Memory::MOST],
    value: [f32; Memory::MOST],
    windows: u8,
}

impl LastWindows {
    /// Adds a window in front of the others.
    pub(crate) fn push(&mut self, x: f32, value: f32) {
        let ([x1, x2, _], [v1, v2, _]) = (self.x, self.value);
        (self.x, self.value) = ([x, x1, x2], [value, v1, v2]);
        self.windows = self.windows.saturating_add(1);
    }

    /// Windows since the last hole, of which three at most are remembered.
    pub(crate) const fn windows(&self) -> u8 {
        self.windows
    }

    /// (x, value) of each, the newest first.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (f32, f32)> + '_ {
        self.x.iter().copied().zip(self.value.iter().copied())
    }
}

impl MemoryKind for Remembering {
    type State = LastWindows;
    const START: LastWindows = LastWindows { x: [0.0; Memory::MOST], value: [0.0; Memory::MOST], windows: 0 };
    const BYTES: usize = 8 * Memory::MOST + 1;
    const LINKED: bool = true;
    fn carried(memory: &Memory, state: &LastWindows) -> Option<f32> {
        if state.windows < memory.order {
            return None;
        }
        let mut sum = 0.0;
        let order = usize::from(memory.order);
        for (a, x) in memory.x.iter().zip(&state.x).take(order) {
            sum += a * x;
        }
        for (a, value) in memory.value.iter().zip(&state.value).take(order) {
            sum += a * value;
        }
        Some(sum)
    }
    fn remember(state: &mut LastWindows, x: f32, value: f32) {
        state.push(x, value);
    }
    fn forget(state: &mut LastWindows) {
        state.windows = 0;
    }
    fn write(state: &LastWindows, to: &mut Writer<'_>) {
        state.x.into_iter().chain(state.value).for_each(|w| to.f32(w));
        to.u8(state.windows);
    }
    fn read(from: &mut Reader<'_>) -> Option<LastWindows> {
        let mut read = Self::START;
        for w in read.x.iter_mut().chain(&mut read.value) {
            *w = from.f32()?;
        }
        read.windows = from.u8()?;
        Some(read)
    }
}
