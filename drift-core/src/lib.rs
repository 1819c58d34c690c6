//! Tells drift from disturbance inside a feedback loop: `no_std`, no alloc, one (r, y, u) sample in per tick, one
//! [`Report`] out per decision.
//!
//! A controller pays for friction, leaks, sticking valves and drifting sensors with effort, and the error stays
//! small. This crate watches that bill. From the tick upwards:
//!
//! * [`Number`], [`Input`], [`Exclusion`]: what may enter. Only valid samples of a closed, unsaturated loop do.
//! * [`IndexSet`] ([`Pair`], [`Full`], [`FullAt`]): what is summed. Blocks are added up, never subtracted from, so rounding
//!   does not grow with uptime.
//! * [`Indices`]: the window's control energy, error indices, means and peaks (equations 2 and 3 of the paper).
//! * [`Channel`], [`Baseline`], [`Memory`], [`OperatingPoint`]: the residual of an index against the healthy relation (equations 5 to 7).
//! * [`Detectors`]: Shewhart, two-sided CUSUM, EWMA, SPRT, with thresholds computed on the host.
//! * [`Verdict`]: disturbance or drift, with the refitted curve (equations 8 and 9).
//! * [`Options`]: what a monitor can do, as a type; what is not chosen is not linked.
//! * [`Plan`] (checked configuration, in flash) and [`State`], or both in one [`Monitor`].
//! * [`Commissioning`], [`CommissioningAt`], [`MemoryCommissioning`]: learn the baseline in place, with a measured operating point, with a memory. [`Plan::save`], [`Plan::restore`]: across a reset.
//!
//! ```
//! use drift_core::{
//!     Baseline, Channel, ChannelKind, Config, Cusum, Detectors, Iae, Index, Monitor, Pair, Paper, Verdict,
//! };
//!
//! const CONFIG: Config<f32, 1> = Config::new(
//!     0.001, // s per tick
//!     250,   // ticks per block
//!     12,    // blocks per window: 3 s
//!     [Channel::new(
//!         ChannelKind::EnergyError(Index::Iae),
//!         Baseline::known(0.0, 1.0, 0.1),
//!         Detectors { cusum: Some(Cusum::new(0.5, 5.07)), ..Detectors::NONE },
//!     )],
//! );
//! let mut monitor = Monitor::<f32, Pair<Iae>, Paper>::new(CONFIG)?;
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

mod blanking;
mod channel;
mod commissioning;
mod config;
mod course;
mod detector;
mod index;
mod index_set;
mod line_fit;
mod math;
mod memory;
mod monitor;
mod number;
mod operating_point;
mod options;
mod point_fit;
mod report;
mod sample;
mod store;
mod trace;
mod triangle;
mod window;

pub use blanking::{BlankTicks, Blanking, BlankingKind, BlankingState, Blanks};
pub use channel::{
    Baseline, Channel, ChannelKind, ChannelMeaning, ChannelReport, ChannelRow, FaultCurve, Moved,
};
pub use commissioning::{
    Commissioning, CommissioningAt, LearntOrder, MemoryCommissioning, NotReady, Order, OrderAt, honest_arl0,
};
pub use config::{Config, ConfigError, Saturation};
pub use course::{Curve, Decision, Refitted, Verdict};
pub use detector::{
    Alarms, AllDetectors, Cusum, CusumState, Detector, DetectorRow, DetectorSet, DetectorState,
    DetectorStates, Detectors, Ewma, EwmaState, Shewhart, Side, Sprt, SprtState,
};
pub use index::{Index, Indices, IndicesAt, PairIndices};
pub use index_set::{Full, FullAt, Iae, IndexSet, Ise, Itae, Itse, Pair, Row, Scale, Step};
pub use line_fit::{Line, LineFit};
pub use memory::{Forgetful, LastWindows, Memory, MemoryKind, Remembering};
pub use monitor::{FullMonitor, Monitor, PairMonitor, Plan, ReportOf, STRIP_TICKS, State};
pub use number::{Carried, Number};
pub use operating_point::OperatingPoint;
pub use options::{Everything, Never, Options, Paper, Smallest};
pub use report::{Location, Report, WindowStatus};
pub use sample::{Excluded, Exclusion, Exclusions, Input, TotalExcluded};
pub use store::{Reader, STATE_VERSION, StateError, Writer};
pub use trace::{NoTrace, TimeTrace, Trace, WholeTrace};
pub use window::{Block, Blocks, ClosedBlock, Layout, Ring, Sliding, Total, Tumbling, WindowKind};
