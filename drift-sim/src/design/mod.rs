//! Run lengths of the detectors, and the thresholds that follow from them.
//!
//! All on a standardised residual z, one a decision (one a hop), independent and N(0, 1) in health. A run length counts decisions;
//! times the hop it is a time. In-control (ARL0): mean decisions to a false alarm. Out-of-control (ARL1): mean decisions to the alarm
//! after a shift, from the statistic's start.
//!
//! * [`Cusum`], [`OneSided`]: exact by the integral equation, with head start; [`siegmund`]: the closed form, and autocorrelated residuals.
//! * [`Ewma`]: exact by the same equation. [`Shewhart`], [`Sprt`]: the other two detectors. [`joint_arl`]: all of them at once.
//! * [`RunLength`]: quantiles, and the probability of an alarm within a mission.
//! * [`EstimatedBaseline`]: what is promised when mean and sigma came from few windows, and the threshold that promises it anyway.
//!
//! They hold for hop = window: overlapping windows make decisions dependent, and a CUSUM then alarms far sooner.

mod check;
mod cusum;
mod estimated;
mod ewma;
mod joint;
mod linear_drift;
pub(crate) mod normal;
mod quadratic_walk;
mod quadrature;
mod request;
mod root;
mod run_length;
mod shewhart;
pub mod siegmund;
mod sprt;
mod walk;

pub use check::{LARGEST_SHIFT, LARGEST_SLOPE, SMALLEST_SLOPE, shift as check_shift};
pub use cusum::{Cusum, LARGEST_ARL0, LARGEST_H, LARGEST_K, OneSided};
pub use estimated::EstimatedBaseline;
pub use ewma::Ewma;
pub use joint::{joint_arl, share_arl0};
pub use request::{Design, DetectorKind, QUANTILES, Request};
pub use run_length::RunLength;
pub use shewhart::{LARGEST_LIMIT, Shewhart};
pub use sprt::{Alternative, Outcome, Sprt};
