//! Runs the very monitor of [`drift_core`] over a recording: sample by sample, in constant memory, and tells what it
//! said as lines of JSON, as events, as one screen of text and as a chart.
//!
//! * [`Runner`]: time and the monitor's inputs; [`Watcher`] counts what it says, [`watch`] feeds it a whole [`crate::recording::RecordingStream`].
//! * [`Events`]: decisions merged to disturbances and drifts, channels that are away together in one.
//! * [`Summary`]: what a person wants to know; [`screen`] is that in words.
//! * [`write_hop`], [`write_summary`]: the schema `drift.monitor/1`.
//! * [`Chart`]: r, y, u, e and what each channel said, thinned while it is read; [`page`] is the report of it.

mod chart;
mod detectable;
mod drawing;
mod events;
mod json_lines;
mod page;
mod pinned;
mod run;
mod screen;
mod summary;
mod thinned;

pub use chart::Chart;
pub use detectable::{Detectable, PROBABILITY};
pub use events::{Course, Event, EventKind, Events, Raised};
pub use json_lines::{SCHEMA, write_hop, write_summary};
pub use page::page;
pub use pinned::Pinned;
pub use run::{Hop, Outputs, Runner, Stopped, Watcher, watch};
pub use screen::screen;
pub use summary::{ChannelSummary, ExcludedTotal, FailOn, Summary};
