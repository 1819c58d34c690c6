//! `BASELINE.toml`: what a healthy loop looks like, and the thresholds made for it. `drift calibrate` writes it,
//! `drift monitor` and firmware (as a Rust or C constant) read it.
//!
//! The host's monitor has [`CAPACITY`] blocks and three channels, always in the order energy_error, effort or
//! motion_effort, activity. A channel without a baseline is reported, not judged. Numbers are `f32`, as on the target, in the
//! fewest digits that give the same bits back.

mod c_initialiser;
mod point_columns;
mod rust_const;
mod toml_text;

use std::fs;
use std::io::Read;
use std::path::Path;

use drift_core::{
    Baseline, Blanking, Channel, ChannelKind, Config, Decision, Detectors, Everything, Full, FullAt, Index,
    Memory, Monitor, OperatingPoint, Plan, Saturation,
};
use serde::{Deserialize, Serialize};

use crate::{Error, Result};
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    schema: toml::Spanned<String>,
    timing: Timing,
    samples: Samples,
    decision: Decision,
    promise: Option<toml::Spanned<Promise>>,
    operating_point: Option<toml::Spanned<PointColumns>>,
    calibration: toml::Spanned<Provenance>,
    #[serde(rename = "channel")]
    channels: toml::Spanned<Vec<toml::Spanned<ChannelTable>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelTable {
    kind: Kind,
    index: Option<Index>,
    baseline: Option<Baseline>,
    #[serde(default)]
    memory: Memory,
    #[serde(default)]
    operating_point: OperatingPoint,
    #[serde(default)]
    detectors: Detectors,
    statistics: Option<Statistics>,
}

#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    EnergyError,
    Effort,
    MotionEffort,
    Activity,
}

impl BaselineFile {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// It can't be read, or as [`BaselineFile::parse`].
    pub fn read(path: &Path) -> Result<Self> {
        let refused = |e: std::io::Error| Error::new(format!("can't be read: {e}")).in_file(path);
        let file = fs::File::open(path).map_err(refused)?;
        let mut text = String::new();
        file.take(LARGEST_BYTES + 1).read_to_string(&mut text).map_err(refused)?;
        if text.len() as u64 > LARGEST_BYTES {
            return Err(Error::new("too large for a baseline").allowed("at most 1 MB").in_file(path));
        }
        Self::parse(&text, path)
    }

    /// Reads and checks text; `name` is the file that errors name.
    ///
    /// # Errors
    /// Not TOML, an unknown or missing key, another schema, an impossible value: with the line.
    pub fn parse(text: &str, name: impl AsRef<Path>) -> Result<Self> {
        parse(text).map_err(|e| e.in_file(name))
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

fn parse(text: &str) -> Result<BaselineFile> {
    check_schema(text)?;
    let document: Document = toml::from_str(text).map_err(|e| {
        let error = Error::new(e.message().trim());
        match e.span() {
            Some(span) => error.at_line(line_at(text, span.start)),
            None => error,
        }
    })?;
    if document.schema.get_ref() != SCHEMA {
        return Err(
            other_schema(document.schema.get_ref()).at_line(line_at(text, document.schema.span().start))
        );
    }
    let in_table = |span: &std::ops::Range<usize>, problem: Problem| {
        Error::new(problem.what).allowed(problem.allowed).at_line(line_of_key(text, span.start, problem.key))
    };
    if let Some(promise) = &document.promise {
        check_promise(promise.get_ref()).map_err(|p| in_table(&promise.span(), p))?;
    }
    check_provenance(document.calibration.get_ref())
        .map_err(|p| in_table(&document.calibration.span(), p))?;
    let channels = read_channels(text, &document)?;
    check_point(text, &document, &channels)?;
    let file = BaselineFile {
        timing: document.timing,
        samples: document.samples,
        decision: document.decision,
        promise: document.promise.map(toml::Spanned::into_inner),
        operating_point: document.operating_point.map(toml::Spanned::into_inner),
        calibration: document.calibration.into_inner(),
        channels,
    };
    // What is wrong without any channel is wrong in the first tables.
    HostPlan::new(file.config_of([])).map_err(|e| {
        let message = e.to_string();
        let line = KEYS.iter().find(|k| message.contains(*k)).map(|k| line_of_key(text, 0, k));
        let error = Error::new(message);
        line.map_or(error.clone(), |line| error.at_line(line))
    })?;
    for (entry, table) in file.channels.iter().zip(document.channels.get_ref()) {
        HostPlan::new(file.config_of([entry.channel])).map_err(|e| {
            let message = e.to_string();
            let key = PARTS.into_iter().find(|key| message.contains(key)).unwrap_or("baseline");
            let line = line_of_key(text, table.span().start, key);
            Error::new(format!("channel {}: {message}", entry.channel.kind.name()))
                .allowed("finite numbers, sigma >= 0, x_min <= x_max, thresholds beyond 0 on their side")
                .at_line(line)
        })?;
    }
    Ok(file)
}

/// More than any baseline; a recording given by mistake is refused before it is parsed.
const LARGEST_BYTES: u64 = 1_000_000;

/// A channel's tables that its errors name.
const PARTS: [&str; 3] = ["detectors", "memory", "operating_point"];

/// The keys that the configuration's own errors name.
const KEYS: [&str; 8] = [
    "sample_time_s",
    "block_ticks",
    "window_blocks",
    "hop_blocks",
    "min_valid",
    "saturation",
    "blanking",
    "decision",
];

struct Problem {
    key: &'static str,
    what: String,
    allowed: &'static str,
}

/// A file of another version may have other keys: say so before anything else.
fn check_schema(text: &str) -> Result<()> {
    #[derive(Deserialize)]
    struct Head {
        schema: toml::Spanned<String>,
    }
    match toml::from_str::<Head>(text) {
        Ok(head) if head.schema.get_ref() != SCHEMA => {
            Err(other_schema(head.schema.get_ref()).at_line(line_at(text, head.schema.span().start)))
        }
        // Anything else that is wrong is named by the whole document's reader.
        _ => Ok(()),
    }
}

fn other_schema(found: &str) -> Error {
    Error::new(format!("schema is '{found}'")).allowed(format!("'{SCHEMA}'"))
}

fn check_promise(promise: &Promise) -> std::result::Result<(), Problem> {
    let positive = |x: f64| x > 0.0 && x.is_finite();
    for (key, value) in
        [("false_alarm_every_h", promise.false_alarm_every_h), ("decisions", promise.decisions)]
    {
        if !positive(value) {
            return Err(Problem {
                key,
                what: format!("{key} is {value}"),
                allowed: "a finite number above 0",
            });
        }
    }
    let confidence = promise.confidence;
    if !(confidence > 0.0 && confidence < 1.0) {
        let what = format!("confidence is {confidence}");
        return Err(Problem { key: "confidence", what, allowed: "between 0 and 1" });
    }
    Ok(())
}

/// A weight needs the columns that it is for.
fn check_point(text: &str, document: &Document, channels: &[ChannelEntry]) -> Result<()> {
    match &document.operating_point {
        Some(point) => point.get_ref().check().map_err(|e| e.at_line(line_at(text, point.span().start))),
        None if channels.iter().any(|entry| entry.channel.operating_point.counts()) => {
            Err(Error::new("a channel depends on an operating_point, but the file names no columns for it")
                .allowed("[operating_point] with columns and scales"))
        }
        None => Ok(()),
    }
}

fn check_provenance(of: &Provenance) -> std::result::Result<(), Problem> {
    if of.effective_windows >= 0.0 && of.effective_windows.is_finite() {
        return Ok(());
    }
    let what = format!("effective_windows is {}", of.effective_windows);
    Err(Problem { key: "effective_windows", what, allowed: "a finite number, 0 or more" })
}

fn read_channels(text: &str, document: &Document) -> Result<[ChannelEntry; 3]> {
    const ALLOWED: &str = "three [[channel]]: energy_error, then effort or motion_effort, then activity";
    let tables = document.channels.get_ref();
    let entries = tables.iter().map(|table| read_channel(text, table)).collect::<Result<Vec<_>>>()?;
    let entries: [ChannelEntry; 3] = entries.try_into().map_err(|_| {
        let line = line_at(text, document.channels.span().start);
        Error::new(format!("{} channels", tables.len())).allowed(ALLOWED).at_line(line)
    })?;
    for ((position, entry), table) in entries.iter().enumerate().zip(tables) {
        let fits = matches!(
            (position, entry.channel.kind),
            (0, ChannelKind::EnergyError(_))
                | (1, ChannelKind::Effort | ChannelKind::MotionEffort)
                | (2, ChannelKind::Activity)
        );
        if !fits {
            let what = format!("channel {} is {}", position + 1, entry.channel.kind.name());
            let line = line_of_key(text, table.span().start, "kind");
            return Err(Error::new(what).allowed(ALLOWED).at_line(line));
        }
    }
    Ok(entries)
}

fn read_channel(text: &str, table: &toml::Spanned<ChannelTable>) -> Result<ChannelEntry> {
    let start = table.span().start;
    let table = table.get_ref();
    let kind = match (table.kind, table.index) {
        (Kind::EnergyError, Some(index)) => ChannelKind::EnergyError(index),
        (Kind::EnergyError, None) => {
            return Err(Error::new("channel energy_error has no index")
                .allowed("index = \"iae\", \"ise\", \"itae\" or \"itse\"")
                .at_line(line_of_key(text, start, "kind")));
        }
        (_, Some(_)) => {
            return Err(Error::new("an index goes with kind = \"energy_error\" only")
                .at_line(line_of_key(text, start, "index")));
        }
        (Kind::Effort, None) => ChannelKind::Effort,
        (Kind::MotionEffort, None) => ChannelKind::MotionEffort,
        (Kind::Activity, None) => ChannelKind::Activity,
    };
    if let Some(s) = &table.statistics {
        let numbers = [s.n_effective, s.r2, s.adj_r2, s.rmse, s.lag1, s.skewness];
        if !numbers.iter().chain(&s.b0_ci95).chain(&s.b1_ci95).all(|x| x.is_finite()) {
            return Err(Error::new("statistics hold a number that is not finite")
                .at_line(line_of_key(text, start, "n")));
        }
    }
    let baseline = table.baseline.unwrap_or(Baseline::UNLEARNED);
    let channel = Channel {
        memory: table.memory,
        operating_point: table.operating_point,
        ..Channel::new(kind, baseline, table.detectors)
    };
    Ok(ChannelEntry { channel, statistics: table.statistics })
}

/// Line (from 1) of a byte.
fn line_at(text: &str, byte: usize) -> u64 {
    1 + text.bytes().take(byte).filter(|&b| b == b'\n').count() as u64
}

/// Line of the first `key` (or of its table) from a byte on; that byte's own line if there is none.
fn line_of_key(text: &str, from: usize, key: &str) -> u64 {
    let first = line_at(text, from);
    let names_it = |line: &str| {
        let name = line.trim_start().trim_start_matches(['[']);
        let name = name.strip_prefix("channel.").unwrap_or(name);
        name.strip_prefix(key).is_some_and(|rest| rest.trim_start().starts_with(['=', ']']))
    };
    let offset = text.lines().skip(first.saturating_sub(1) as usize).position(names_it);
    first + offset.unwrap_or(0) as u64
}

/// The number that the shortest digits of an `f32` name: 0.001 rather than 0.0010000000474974513.
pub(crate) fn shortest(x: f32) -> f64 {
    format!("{x:?}").parse().unwrap_or(f64::from(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_found_in_its_own_table() {
        let text = "a = 1\n[x]\nn = 2\n[[channel]]\nkind = 1\n  [channel.baseline]\n";
        assert_eq!(line_of_key(text, 0, "n"), 3);
        assert_eq!(line_of_key(text, 12, "baseline"), 6);
        assert_eq!(line_of_key(text, 12, "absent"), 3);
    }
}
