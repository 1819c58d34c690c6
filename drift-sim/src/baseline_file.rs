//! `BASELINE.toml`: what a healthy loop looks like, and the thresholds made for it. `drift calibrate` writes it,
//! `drift monitor` and firmware (as a Rust or C constant) read it.
//!
//! The host's monitor has [`CAPACITY`] blocks and three channels, always in the order energy_error, effort or
//! motion_effort, activity. A channel without a baseline is reported, not judged. Numbers are `f32`, as on the target, in the
//! fewest digits that give the same bits back.

mod c_initialiser;
mod document;
mod point_columns;
mod rust_const;
mod toml_text;

use std::path::Path;

use drift_core::{
    Blanking, Channel, ChannelKind, Config, Decision, Everything, Full, FullAt, Monitor, Plan, Saturation,
};
use serde::{Deserialize, Serialize};

use crate::{Error, Result, text_file};
pub use point_columns::{MOST_COLUMNS, PointColumns};

/// The layout's name; another one is refused.
pub const SCHEMA: &str = "drift.baseline/1";
/// Most blocks per window of the host's monitor.
pub const CAPACITY: usize = 64;
/// The host's monitor: every index, [`CAPACITY`] blocks, three channels.
pub type HostMonitor = Monitor<f32, Full, Everything<CAPACITY>, 3>;
/// The same with a measured operating point, for a baseline that depends on one.
pub type HostMonitorAt = Monitor<f32, FullAt, Everything<CAPACITY>, 3>;
/// What the host's monitor is made of, for any number of channels.
type HostPlan<const C: usize> = Plan<f32, FullAt, Everything<CAPACITY>, C>;

/// A baseline file's content; checked, so that [`BaselineFile::config`] is accepted by a monitor.
#[derive(Debug, Clone, PartialEq)]
pub struct BaselineFile {
    /// Window and hop, in blocks and ticks.
    pub timing: Timing,
    /// Which samples and windows count.
    pub samples: Samples,
    /// What tells a drift from a disturbance.
    pub decision: Decision,
    /// What the thresholds promise, if they were computed for something.
    pub promise: Option<Promise>,
    /// The measured columns that the effort depends on, if it was learnt with any.
    pub operating_point: Option<PointColumns>,
    /// What it was learnt from.
    pub calibration: Provenance,
    /// energy_error, effort or motion_effort, activity.
    pub channels: [ChannelEntry; 3],
}

/// Window and hop in blocks and ticks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timing {
    /// Seconds per tick, > 0.
    pub sample_time_s: f32,
    /// Ticks per block, >= 1.
    pub block_ticks: u32,
    /// Blocks per window, 1 to 64.
    pub window_blocks: u16,
    /// Blocks from one decision to the next.
    pub hop_blocks: u16,
}

impl Timing {
    /// Seconds per tick, as the decimal number that was meant.
    pub fn sample_time_s(&self) -> f64 {
        shortest(self.sample_time_s)
    }

    /// Ticks per window: `window_blocks*block_ticks`.
    pub fn window_ticks(&self) -> u64 {
        u64::from(self.block_ticks) * u64::from(self.window_blocks)
    }

    /// Ticks from one decision to the next.
    pub fn hop_ticks(&self) -> u64 {
        u64::from(self.block_ticks) * u64::from(self.hop_blocks)
    }

    /// Length of a window, s.
    pub fn window_s(&self) -> f64 {
        self.window_ticks() as f64 * shortest(self.sample_time_s)
    }

    /// Time from one decision to the next, s.
    pub fn hop_s(&self) -> f64 {
        self.hop_ticks() as f64 * shortest(self.sample_time_s)
    }
}

/// Which samples and windows count.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Samples {
    /// A block and a window count from this fraction of valid ticks on.
    pub min_valid: f32,
    /// Limits of u: at or beyond them a sample is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturation: Option<Saturation<f32>>,
    /// Ticks that are left out after a step of r.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blanking: Option<Blanking<f32>>,
}

/// What the thresholds promise, of all channels and detectors together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Promise {
    /// Mean time between false alarms, hours.
    pub false_alarm_every_h: f64,
    /// The same in decisions.
    pub decisions: f64,
    /// Share of all calibrations like this one that keep it.
    pub confidence: f64,
}

/// What the baseline was learnt from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The names of the healthy recordings, as they were given.
    pub files: Vec<String>,
    /// Windows in all of them together.
    pub windows: u32,
    /// Independent windows that these are worth, in the channel where they are worth least.
    pub effective_windows: f64,
}

/// One channel in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelEntry {
    /// What is compared, its healthy relation, what watches it.
    pub channel: Channel,
    /// How well it was learnt; none where it was not.
    pub statistics: Option<Statistics>,
}

impl ChannelEntry {
    /// A channel that is reported and not judged.
    pub const fn unlearned(kind: ChannelKind) -> Self {
        Self { channel: Channel::unlearned(kind), statistics: None }
    }

    /// Whether it has a baseline to be judged by.
    pub fn learned(&self) -> bool {
        self.channel.baseline.sigma > 0.0
    }
}

/// How well a channel's line was learnt; of the calibration's windows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Statistics {
    /// Windows that the line was fitted to.
    pub n: u32,
    /// Independent windows that they are worth.
    pub n_effective: f64,
    /// 95 % confidence interval of b0, autocorrelation accounted for.
    pub b0_ci95: [f64; 2],
    /// 95 % confidence interval of b1, autocorrelation accounted for.
    pub b1_ci95: [f64; 2],
    /// Share of the value's variance that the line explains.
    pub r2: f64,
    /// The same, adjusted for its two coefficients.
    pub adj_r2: f64,
    /// Root of the mean squared residual (n - 2 degrees of freedom), value units.
    pub rmse: f64,
    /// Correlation of neighbouring windows' residuals.
    pub lag1: f64,
    /// Skewness of the residuals.
    pub skewness: f64,
}

impl BaselineFile {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// It can't be read, or as [`BaselineFile::parse`].
    pub fn read(path: &Path) -> Result<Self> {
        let text = text_file::read(path, "a baseline", LARGEST_MEGABYTES)?;
        Self::parse(&text, path)
    }

    /// Reads and checks text; `name` is the file that errors name.
    ///
    /// # Errors
    /// Not TOML, an unknown or missing key, another schema, an impossible value: with the line.
    pub fn parse(text: &str, name: impl AsRef<Path>) -> Result<Self> {
        document::parse(text).map_err(|e| e.in_file(name))
    }

    /// The file's text; [`BaselineFile::parse`] gives the same content back, bit for bit.
    pub fn to_toml(&self) -> String {
        toml_text::write(self)
    }

    /// The monitor's configuration.
    ///
    /// # Errors
    /// A value is impossible: only for content that was not read from a file.
    pub fn config(&self) -> Result<Config<f32, 3>> {
        let config = self.config_of(self.channels.map(|c| c.channel));
        HostPlan::new(config).map_err(|e| Error::new(e.to_string()))?;
        Ok(config)
    }

    /// `pub const CONFIG: drift_core::Config<f32, 3>` as Rust source.
    pub fn to_rust_const(&self) -> String {
        rust_const::write(self)
    }

    /// `static const drift_config_t drift_config` as C99 source, a whole header.
    pub fn to_c_initialiser(&self) -> String {
        c_initialiser::write(self)
    }

    fn config_of<const C: usize>(&self, channels: [Channel; C]) -> Config<f32, C> {
        let timing = &self.timing;
        let mut config =
            Config::new(timing.sample_time_s, timing.block_ticks, timing.window_blocks, channels)
                .with_hop(timing.hop_blocks)
                .with_decision(self.decision);
        config.min_valid = self.samples.min_valid;
        config.saturation = self.samples.saturation;
        config.blanking = self.samples.blanking;
        config
    }
}

/// More than any baseline; a recording given by mistake is refused before it is parsed.
const LARGEST_MEGABYTES: u64 = 1;

/// The number that the shortest digits of an `f32` name: 0.001 rather than 0.0010000000474974513.
pub(crate) fn shortest(x: f32) -> f64 {
    format!("{x:?}").parse().unwrap_or(f64::from(x))
}
