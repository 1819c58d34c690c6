//! Run lengths of the CUSUM: `S+ = max(0, S+ + z - k)` and `S- = max(0, S- - z - k)`, an alarm when either exceeds `h`.
//!
//! z is a standardised residual, one a decision; `k` (the allowance, half the shift to be found) and `h` are in sigmas of z.
//! One side's average run length solves the integral equation (Page 1954; Vance 1986)
//!
//! `L(s) = 1 + L(0) Phi(k - s - mu) + integral from 0 to h of L(t) phi(t + k - s - mu) dt`.
//!
//! Two sides combine by the renewal argument of Kemp (1961) and, with head start, of Lucas & Crosier (1982, appendix):
//! when one side alarms the other stands at zero. That is exact if `|h_up - h_down| <= k_up + k_down`, so always for equal sides.

use super::run_length::RunLength;
use super::walk::{Chain, Walk};
use super::{check, root};
use crate::sentences::typed;
use crate::{Error, Result};

/// The largest allowance `k` that is computed, in sigmas.
pub const LARGEST_K: f64 = 10.0;
/// The largest threshold `h` that is computed, in sigmas.
pub const LARGEST_H: f64 = 100.0;
/// The largest run length that a threshold is searched for, in decisions.
pub const LARGEST_ARL0: f64 = 1e15;

/// One side of a CUSUM, which looks for a rise of the mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneSided {
    k: f64,
    h: f64,
    start: f64,
}

/// A two-sided CUSUM; the sides may differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cusum {
    up: OneSided,
    down: OneSided,
}

impl OneSided {
    /// Allowance `k` and threshold `h` in sigmas; `head_start` is the starting value as a fraction of `h`, 0 without one.
    ///
    /// # Errors
    /// `k` is not within 0..=[`LARGEST_K`], `h` not above 0 and up to [`LARGEST_H`], or `head_start` not within 0 and (exclusive) 1.
    pub fn new(k: f64, h: f64, head_start: f64) -> Result<Self> {
        check::k(k)?;
        check::h(h)?;
        check::head_start(head_start)?;
        Ok(Self { k, h, start: head_start * h })
    }

    /// The allowance, in sigmas.
    pub fn k(&self) -> f64 {
        self.k
    }

    /// The threshold, in sigmas.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// Average run length in decisions when z is N(`mean`, 1). Infinite where it is beyond what an `f64` holds.
    pub fn arl(&self, mean: f64) -> f64 {
        self.arl_of(mean, 1.0)
    }

    /// Average run length in decisions when z is N(`mean`, `deviation`^2).
    pub fn arl_of(&self, mean: f64, deviation: f64) -> f64 {
        self.arl_from(mean, deviation, self.start)
    }

    /// The same, from any value of the statistic (0..=h).
    pub fn arl_from(&self, mean: f64, deviation: f64, start: f64) -> f64 {
        let chain = self.chain(mean, deviation);
        let steps = chain.steps();
        if start > 0.0 { steps.from(start / deviation, 1.0) } else { steps.at_origin() }
    }

    /// The whole distribution of the run length when z is N(`mean`, 1).
    pub fn run_length(&self, mean: f64) -> RunLength {
        RunLength::of_chain(&self.chain(mean, 1.0), self.start)
    }

    /// Whether an alarm within so many decisions has at least this probability when z is N(`mean`, 1): quicker to tell than the whole
    /// distribution.
    pub fn alarms_within(&self, mean: f64, decisions: u64, probability: f64) -> bool {
        RunLength::alarms_within(self.walk(mean, 1.0), self.start, decisions, probability)
    }

    /// Average run length in decisions when z's mean grows by `slope` sigmas a decision (`mean = (n - 1)*slope` at
    /// decision n): Gan 1992.
    ///
    /// # Errors
    /// `slope` is not within [`super::SMALLEST_SLOPE`]..=[`super::LARGEST_SLOPE`].
    pub fn drift_arl(&self, slope: f64) -> Result<f64> {
        check::slope(slope)?;
        Ok(super::linear_drift::average(&self.chain(0.0, 1.0), self.start, slope))
    }

    pub(crate) fn chain(&self, mean: f64, deviation: f64) -> Chain {
        self.walk(mean, deviation).discretise()
    }

    fn walk(&self, mean: f64, deviation: f64) -> Walk {
        Walk { lower: 0.0, upper: self.h / deviation, mean: (mean - self.k) / deviation, restarts: true }
    }

    /// The distribution with the head start, and without.
    fn both_run_lengths(&self, mean: f64) -> (RunLength, RunLength) {
        let with = self.run_length(mean);
        let without =
            if self.start > 0.0 { Self { start: 0.0, ..*self }.run_length(mean) } else { with.clone() };
        (with, without)
    }

    /// The threshold that gives a one-sided CUSUM the wanted in-control run length, with the head start included.
    ///
    /// # Errors
    /// As [`OneSided::new`]; `arl0` is not within 1..=[`LARGEST_ARL0`] or can't be had with this `k`.
    pub fn with_arl0(k: f64, arl0: f64, head_start: f64) -> Result<Self> {
        let of = move |h: f64| Self { k, h, start: head_start * h };
        threshold(k, arl0, head_start, |h| of(h).arl(0.0)).map(of)
    }
}

impl Cusum {
    /// Equal sides; `head_start` as a fraction of `h`.
    ///
    /// # Errors
    /// As [`OneSided::new`].
    pub fn new(k: f64, h: f64, head_start: f64) -> Result<Self> {
        OneSided::new(k, h, head_start).map(Self::symmetric)
    }

    /// Sides of their own allowance and threshold: `up` looks for a rise, `down` for a fall.
    ///
    /// # Errors
    /// The sides differ so much, `|h_up - h_down| > k_up + k_down`, that the renewal argument fails.
    pub fn asymmetric(up: OneSided, down: OneSided) -> Result<Self> {
        if (up.h - down.h).abs() > up.k + down.k {
            return Err(Error::new(format!(
                "the sides' thresholds {} and {} are too far apart",
                up.h, down.h
            ))
            .allowed(format!("a difference of up to k_up + k_down = {}", up.k + down.k)));
        }
        Ok(Self { up, down })
    }

    /// The threshold that gives equal sides the wanted two-sided in-control run length.
    ///
    /// # Errors
    /// As [`OneSided::with_arl0`].
    pub fn with_arl0(k: f64, arl0: f64, head_start: f64) -> Result<Self> {
        let of = move |h: f64| Self::symmetric(OneSided { k, h, start: head_start * h });
        threshold(k, arl0, head_start, |h| of(h).arl(0.0)).map(of)
    }

    pub(crate) fn symmetric(side: OneSided) -> Self {
        Self { up: side, down: side }
    }

    /// The side that looks for a rise.
    pub fn up(&self) -> OneSided {
        self.up
    }

    /// The side that looks for a fall.
    pub fn down(&self) -> OneSided {
        self.down
    }

    /// Average run length in decisions when z is N(`mean`, 1). Infinite where it is beyond what an `f64` holds.
    pub fn arl(&self, mean: f64) -> f64 {
        self.arl_of(mean, 1.0)
    }

    /// Average run length in decisions when z is N(`mean`, `deviation`^2).
    pub fn arl_of(&self, mean: f64, deviation: f64) -> f64 {
        let (up_0, up) = side(self.up, mean, deviation);
        let (down_0, down) = side(self.down, -mean, deviation);
        // Of Lucas & Crosier's (up down_0 + down up_0 - up_0 down_0)/(up_0 + down_0), divided through so that
        // a side that never alarms (an infinite run length) doesn't spoil it.
        let share_down = 1.0 / (1.0 + down_0 / up_0);
        let combined = share_down * (up / up_0 * down_0 + down - down_0);
        if combined.is_finite() { combined } else { up.min(down) }
    }

    /// The whole distribution of the run length when z is N(`mean`, 1).
    pub fn run_length(&self, mean: f64) -> RunLength {
        let up = self.up.both_run_lengths(mean);
        // The mirror image of the same chart on the same law needs no second run.
        let mirrored = mean == 0.0 && self.up == self.down;
        let down = if mirrored { up.clone() } else { self.down.both_run_lengths(-mean) };
        RunLength::of_two_sides(&up, &down)
    }
}

/// One side's run lengths: from zero, and from its head start.
fn side(side: OneSided, mean: f64, deviation: f64) -> (f64, f64) {
    let chain = side.chain(mean, deviation);
    let steps = chain.steps();
    let zero = steps.at_origin();
    (zero, if side.start > 0.0 { steps.from(side.start / deviation, 1.0) } else { zero })
}

/// The h with `arl(h) = arl0`: its logarithm grows almost straight in h, so a bracket is found by doubling.
pub(crate) fn threshold(k: f64, arl0: f64, head_start: f64, arl: impl Fn(f64) -> f64) -> Result<f64> {
    check::k(k)?;
    check::head_start(head_start)?;
    check::arl0(arl0)?;
    const SMALLEST_H: f64 = 1e-9;
    let least = arl(SMALLEST_H);
    if least >= arl0 {
        return Err(Error::new(format!(
            "arl0 {} is less than k = {} gives without any threshold",
            typed(arl0),
            typed(k)
        ))
        .allowed(format!("above {least:.6}, or a smaller k")));
    }
    let mut enough = 1.0;
    while arl(enough) < arl0 {
        if enough >= LARGEST_H {
            return Err(Error::new(format!("arl0 {arl0} needs a threshold above {LARGEST_H} with k = {k}"))
                .allowed("a larger k or a smaller arl0"));
        }
        enough = f64::min(2.0 * enough, LARGEST_H);
    }
    // At the far end the run length may overflow: its logarithm is held finite.
    Ok(root::bracketed(|h| arl(h).min(f64::MAX).ln() - arl0.ln(), SMALLEST_H, enough))
}
