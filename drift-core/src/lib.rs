//! Tells drift from disturbance inside a feedback loop: `no_std`, no alloc, one (r, y, u) sample in per tick, one
//! [`Report`] out per decision.
//!
//! A controller pays for friction, leaks, sticking valves and drifting sensors with effort, and the error stays
//! small. This crate watches that bill. From the tick upwards:
//!
//! * [`Number`], [`Input`], [`Exclusion`]: what may enter. Only valid samples of a closed, unsaturated loop do.
//! * [`IndexSet`] ([`Pair`], [`Full`]): what is summed. Blocks are added up, never subtracted from, so rounding
//!   does not grow with uptime.
//! * [`Indices`]: the window's control energy, error indices, means and peaks (equations 2 and 3 of the paper).
//! * [`Channel`], [`Baseline`]: the residual of an index against the healthy relation (equations 5 to 7).
//! * [`Detectors`]: Shewhart, two-sided CUSUM, SPRT, with thresholds computed on the host.
//! * [`Verdict`]: disturbance or drift, with the refitted curve (equations 8 and 9).
//! * [`Commissioning`]: learns the baseline in place. [`Monitor::save`], [`Monitor::restore`]: across a reset.
//!
//! ```
//! use drift_core::{Baseline, Channel, ChannelKind, Config, Cusum, Detectors, Iae, Index, PairMonitor, Verdict};
//!
//! const CONFIG: Config<f32, 1> = Config::new(
//!     0.001, // s per tick
//!     250,   // ticks per block
//!     12,    // blocks per window: 3 s
//!     [Channel {
//!         kind: ChannelKind::EnergyError(Index::Iae),
//!         baseline: Baseline::known(0.0, 1.0, 0.1),
//!         detectors: Detectors { cusum: Some(Cusum::new(0.5, 5.07)), ..Detectors::NONE },
//!     }],
//! );
//! let mut monitor = PairMonitor::<f32, Iae, 16>::new(&CONFIG)?;
//! let mut decisions = 0;
//! for _ in 0..9_000 {
//!     // e = 1 and u^2 = 1: the window lies on the line J = E_u.
//!     if let Some(report) = monitor.tick(1.0, 0.0, 1.0) {
//!         assert_eq!(report.verdict, Verdict::Healthy);
//!         decisions += 1;
//!     }
//! }
//! assert_eq!(decisions, 3);
//! # Ok::<(), drift_core::ConfigError>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod channel;
mod commissioning;
mod config;
mod course;
mod detector;
mod error_sums;
mod index;
mod index_set;
mod line_fit;
mod math;
mod monitor;
mod number;
mod report;
mod sample;
mod store;

pub use channel::{Baseline, Channel, ChannelKind, ChannelReport, FaultCurve, Moved};
pub use commissioning::{Commissioning, NotReady, honest_arl0};
pub use config::{Blanking, Config, ConfigError, Saturation};
pub use course::{Decision, Verdict};
pub use detector::{Alarms, Cusum, CusumState, DetectorStates, Detectors, Shewhart, Side, Sprt, SprtState};
pub use error_sums::{ErrorSums, Plain, Weighted};
pub use index::{Index, Indices};
pub use index_set::{
    ErrorIndex, Full, FullBlock, Iae, IndexSet, Ise, Itae, Itse, Pair, PairBlock, Scale, Step,
};
pub use line_fit::LineFit;
pub use monitor::{FullMonitor, Monitor, PairMonitor};
pub use number::Number;
pub use report::{Location, Report, WindowStatus};
pub use sample::{Excluded, Exclusion, Input};
pub use store::{Reader, STATE_VERSION, StateError, Writer};
