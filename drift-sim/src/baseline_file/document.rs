//! A baseline's text as tables of TOML, checked table by table: each fault with its line.

use drift_core::{Baseline, Channel, ChannelKind, Decision, Detectors, Index, Memory, OperatingPoint};
use serde::Deserialize;

use super::{
    BaselineFile, ChannelEntry, HostPlan, PointColumns, Promise, Provenance, SCHEMA, Samples, Statistics,
    Timing,
};
use crate::{Error, Result};

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
    kind: String,
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

/// Reads and checks text.
///
/// # Errors
/// As [`BaselineFile::parse`], without the file.
pub(super) fn parse(text: &str) -> Result<BaselineFile> {
    check_is_baseline(text)?;
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

/// What makes a baseline, and how one is made.
const MADE_BY: &str = "a baseline, which `drift calibrate HEALTHY.csv -o BASELINE.toml` makes";

/// A recording or a loop file in a baseline's place: said as such, because no key of it would tell a reader anything.
fn check_is_baseline(text: &str) -> Result<()> {
    let table: Option<toml::Table> = toml::from_str(text).ok();
    let (what, has_schema) = match &table {
        Some(table) if table.contains_key("controller") && table.contains_key("plant") => {
            ("this is a loop file", false)
        }
        Some(table) => ("this is no baseline: it has no schema", table.contains_key("schema")),
        // Not TOML as a whole; one that was edited by hand still names its schema.
        None => ("this is no baseline", text.lines().any(|line| line.trim_start().starts_with("schema"))),
    };
    if has_schema { Ok(()) } else { Err(Error::new(what).allowed(MADE_BY)) }
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
    let allowed = format!("three [[channel]]: {}", kinds_by_place());
    let tables = document.channels.get_ref();
    let entries = tables.iter().map(|table| read_channel(text, table)).collect::<Result<Vec<_>>>()?;
    let entries: [ChannelEntry; 3] = entries.try_into().map_err(|_| {
        let line = line_at(text, document.channels.span().start);
        Error::new(format!("{} channels", tables.len())).allowed(&allowed).at_line(line)
    })?;
    for ((position, entry), table) in entries.iter().enumerate().zip(tables) {
        let fits = entry.channel.kind.meaning().place == position;
        if !fits {
            let what = format!("channel {} is {}", position + 1, entry.channel.kind.name());
            let line = line_of_key(text, table.span().start, "kind");
            return Err(Error::new(what).allowed(&allowed).at_line(line));
        }
    }
    Ok(entries)
}

/// The kinds of channels in the order of their places: "a, then b or c, then d".
fn kinds_by_place() -> String {
    let of_place = |place| {
        let rows = ChannelKind::ROWS.iter().filter(|row| row.meaning.place == place);
        rows.map(|row| row.name).collect::<Vec<_>>().join(" or ")
    };
    (0..3).map(of_place).collect::<Vec<_>>().join(", then ")
}

fn read_channel(text: &str, table: &toml::Spanned<ChannelTable>) -> Result<ChannelEntry> {
    let start = table.span().start;
    let table = table.get_ref();
    let Some(kind) = ChannelKind::named(&table.kind) else {
        let names: Vec<_> = ChannelKind::ROWS.iter().map(|row| row.name).collect();
        return Err(Error::new(format!("unknown kind of channel {}", table.kind))
            .allowed(names.join(", "))
            .at_line(line_of_key(text, start, "kind")));
    };
    let kind = match (kind.index(), table.index) {
        (Some(_), Some(index)) => kind.with_index(index),
        (Some(_), None) => {
            return Err(Error::new(format!("channel {} has no index", kind.name()))
                .allowed("index = \"iae\", \"ise\", \"itae\" or \"itse\"")
                .at_line(line_of_key(text, start, "kind")));
        }
        (None, Some(_)) => {
            return Err(Error::new("an index goes with kind = \"energy_error\" only")
                .at_line(line_of_key(text, start, "index")));
        }
        (None, None) => kind,
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
