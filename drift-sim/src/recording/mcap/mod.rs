//! ROS 2 bags (`.mcap`, mcap.dev): every number in the messages of a topic is a column `/topic.field`, `/joint_states.position[0]`.
//!
//! Messages in CDR with a `ros2msg` schema and messages in JSON are read. Topics come at rates of their own: the rows are
//! those of y's topic, with the time at which they were logged; fields of other topics hold their last value before.

mod cdr;

use std::collections::{BTreeMap, HashMap};
use std::io::Read;

use ::mcap::records::{Record, op};
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde_json::Value;

use super::ReadOptions;
use super::budget::Budget;
use super::contained::contained;
use super::format::Source;
use super::json_lines::visit;
use super::row::excerpt;
use super::table::{Cells, TableRows};
use super::ulog::held;
use crate::{Error, Result};
use cdr::Layout;

const DAMAGED: &str = "the mcap file is cut off or damaged";
/// One record, at most: larger ones are pictures and point clouds.
const RECORD_BYTES_MAX: usize = 64 << 20;

/// The rows of a file that begins like one.
///
/// # Errors
/// The file is damaged; y is not named; a topic or field is not there; it takes more memory than is allowed.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<TableRows> {
    let budget = source.budget.clone();
    contained(DAMAGED, || {
        let map = &options.columns;
        let mut wanted: Vec<&str> = vec![&map.y, &map.u];
        wanted.extend(Some(map.r.as_str()).filter(|r| !r.is_empty() && map.is_named[1]));
        wanted.extend(
            options.when.iter().map(|when| when.column.as_str()).filter(|column| column.contains('.')),
        );
        wanted.extend(options.extra.iter().map(String::as_str));
        let mut bag = Bag::new(&wanted, &budget);
        bag.read(source.reader)?;
        bag.rows(options)
    })
}

/// Whether the texts of a record end within it: the decoder makes room for as many bytes as each says it has.
fn is_whole(opcode: u8, data: &[u8]) -> bool {
    let whole = || match opcode {
        // Name, encoding and text behind a number.
        op::SCHEMA => texts(data.get(2..)?, 3).map(|_| ()),
        // Topic and encoding behind two numbers, then pairs of texts.
        op::CHANNEL => {
            let (mut pairs, _) = split_text(texts(data.get(4..)?, 2)?)?;
            while !pairs.is_empty() {
                pairs = split_text(pairs)?.1;
            }
            Some(())
        }
        _ => Some(()),
    };
    whole().is_some()
}

/// What follows so many texts.
fn texts(mut rest: &[u8], count: usize) -> Option<&[u8]> {
    for _ in 0..count {
        rest = split_text(rest)?.1;
    }
    Some(rest)
}

/// A text behind its length, and what follows.
fn split_text(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)
}

/// One field that is read.
struct Series {
    topic: String,
    field: String,
    stamps_ns: Vec<u64>,
    values: Vec<f64>,
}

struct Bag<'a> {
    budget: &'a Budget,
    /// By the name of the column.
    series: Vec<(String, Series)>,
    schemas: HashMap<u16, Option<Layout>>,
    /// Topic, and how its messages are written.
    channels: HashMap<u16, Channel>,
    /// Every topic, with some of its fields.
    topics: BTreeMap<String, Vec<String>>,
}

struct Channel {
    topic: String,
    schema: u16,
    is_json: bool,
    /// The places in [`Bag::series`] that it fills.
    series: Vec<usize>,
}

impl<'a> Bag<'a> {
    fn new(wanted: &[&str], budget: &'a Budget) -> Self {
        let mut series: Vec<(String, Series)> = Vec::new();
        for name in wanted {
            let (topic, field) = name.split_once('.').unwrap_or((name, ""));
            if !series.iter().any(|(there, _)| there == name) {
                let (topic, field) = (topic.to_owned(), field.to_owned());
                series.push((
                    (*name).to_owned(),
                    Series { topic, field, stamps_ns: Vec::new(), values: Vec::new() },
                ));
            }
        }
        Self { budget, series, schemas: HashMap::new(), channels: HashMap::new(), topics: BTreeMap::new() }
    }

    fn read(&mut self, mut source: impl Read) -> Result<()> {
        let refused = |e: ::mcap::McapError| Error::new(format!("{DAMAGED}: {e}"));
        // A bag may end anywhere, where the robot lost its power.
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_record_length_limit(RECORD_BYTES_MAX);
        let mut reader = LinearReader::new_with_options(options);
        loop {
            let Some(event) = reader.next_event() else { return Ok(()) };
            match event {
                Ok(LinearReadEvent::ReadRequest(count)) => {
                    let count = count.min(RECORD_BYTES_MAX);
                    let into = reader.insert(count);
                    let read = source.read(into).map_err(|e| Error::new(format!("can't be read: {e}")))?;
                    reader.notify_read(read);
                    if read == 0
                        && !self.channels.is_empty()
                        && self.series.iter().any(|(_, s)| !s.values.is_empty())
                    {
                        return Ok(());
                    }
                }
                Ok(LinearReadEvent::Record { data, opcode }) => {
                    // Indices and attachments are not looked at.
                    if ![op::SCHEMA, op::CHANNEL, op::MESSAGE].contains(&opcode) {
                        continue;
                    }
                    if !is_whole(opcode, data) {
                        return Err(Error::new(DAMAGED));
                    }
                    let record = ::mcap::parse_record(opcode, data).map_err(refused)?;
                    self.take(record)?;
                }
                Err(e) => return Err(refused(e)),
            }
        }
    }

    fn take(&mut self, record: Record<'_>) -> Result<()> {
        match record {
            Record::Schema { header, data } => {
                self.budget.take(2 * data.len() as u64)?;
                let is_ros = header.encoding == "ros2msg";
                let layout =
                    if is_ros { Layout::parse(&String::from_utf8_lossy(&data), &header.name) } else { None };
                self.schemas.insert(header.id, layout);
            }
            Record::Channel(channel) => {
                let of_topic = |(place, (_, series)): (usize, &(String, Series))| {
                    (series.topic == channel.topic).then_some(place)
                };
                let series = self.series.iter().enumerate().filter_map(of_topic).collect();
                let fields = self.schemas.get(&channel.schema_id).and_then(Option::as_ref);
                let fields = fields.map_or_else(Vec::new, Layout::some_fields);
                self.budget.take(channel.topic.len() as u64 + 256)?;
                self.topics.entry(channel.topic.clone()).or_insert(fields);
                let is_json = channel.message_encoding == "json";
                let entry = Channel { topic: channel.topic, schema: channel.schema_id, is_json, series };
                self.channels.insert(channel.id, entry);
            }
            Record::Message { header, data } => self.message(header.channel_id, header.log_time, &data)?,
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, channel: u16, stamp_ns: u64, data: &[u8]) -> Result<()> {
        let Some(channel) = self.channels.get(&channel).filter(|channel| !channel.series.is_empty()) else {
            return Ok(());
        };
        let mut found: HashMap<String, f64> = HashMap::new();
        let wanted: Vec<&str> = channel
            .series
            .iter()
            .filter_map(|place| self.series.get(*place).map(|(_, series)| series.field.as_str()))
            .collect();
        if channel.is_json {
            let value: Value = serde_json::from_slice(data).map_err(|e| {
                Error::new(format!("a message of {} is no JSON: {e}", excerpt(&channel.topic)))
            })?;
            visit(&value, "", &mut |name, value| {
                let number = value.as_f64().or_else(|| value.as_bool().map(|flag| f64::from(u8::from(flag))));
                if let Some(number) = number.filter(|_| wanted.contains(&name)) {
                    found.insert(name.to_owned(), number);
                }
            });
        } else if let Some(Some(layout)) = self.schemas.get(&channel.schema) {
            layout.read(data, &mut |name, number| {
                if wanted.contains(&name) {
                    found.insert(name.to_owned(), number);
                }
            });
        } else {
            let what =
                format!("the messages of {} are neither CDR of ROS 2 nor JSON", excerpt(&channel.topic));
            return Err(Error::new(what));
        }
        for place in channel.series.clone() {
            let Some((_, series)) = self.series.get_mut(place) else { continue };
            if let Some(value) = found.get(&series.field) {
                self.budget.push(&mut series.stamps_ns, stamp_ns)?;
                self.budget.push(&mut series.values, *value)?;
            }
        }
        Ok(())
    }

    fn missing(&self, name: &str) -> Error {
        let topics = self.topics.iter().flat_map(|(topic, fields)| {
            let all = fields.iter().map(move |field| format!("{topic}.{field}"));
            all.chain(fields.is_empty().then(|| format!("{topic}.FIELD")))
        });
        let topics: Vec<String> = topics.collect();
        let example = topics.first().map_or("/topic.field", String::as_str);
        Error::new(format!("no topic and field '{name}' in the bag")).allowed(format!(
            "like --columns r={example},y={example},u={example}; there are {}",
            excerpt(&topics.join(", "))
        ))
    }

    fn rows(self, options: &ReadOptions) -> Result<TableRows> {
        if let Some((name, _)) = self.series.iter().find(|(_, series)| series.values.is_empty()) {
            return Err(self.missing(name));
        }
        let y = &options.columns.y;
        let Some((_, base)) = self.series.iter().find(|(name, _)| name == y) else {
            return Err(self.missing(y));
        };
        let first = base.stamps_ns.first().copied().unwrap_or(0);
        let (mut columns, mut notes): (Vec<(String, Cells)>, Vec<String>) = (Vec::new(), Vec::new());
        let mut options = options.clone();
        if options.columns.t.is_some() && !options.columns.is_named[0] {
            let seconds = base.stamps_ns.iter().map(|t| t.saturating_sub(first) as f64 / 1e9);
            self.budget.take(8 * base.stamps_ns.len() as u64)?;
            columns.push(("t".into(), Cells::Double(seconds.collect())));
            options.columns.t = Some("t".into());
        }
        for (name, series) in &self.series {
            self.budget.take(8 * base.stamps_ns.len() as u64)?;
            let values = if series.topic == base.topic && series.stamps_ns == base.stamps_ns {
                series.values.clone()
            } else {
                notes.push(format!("'{name}' holds its last value before each '{y}'"));
                held(&base.stamps_ns, &series.stamps_ns, &series.values)
            };
            columns.push((name.clone(), Cells::Double(values)));
        }
        TableRows::new(columns, notes, &options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texts behind their lengths, after so many zeros.
    fn record(zeros: usize, texts: &[&[u8]]) -> Vec<u8> {
        let mut bytes = vec![0; zeros];
        for text in texts {
            bytes.extend((text.len() as u32).to_le_bytes());
            bytes.extend(*text);
        }
        bytes
    }

    #[test]
    fn texts_that_are_longer_than_their_record_are_found() {
        let pairs = record(0, &[b"key", b"value"]);
        for (opcode, sound, lengths_at) in [
            (op::SCHEMA, record(2, &[b"name", b"ros2msg", b"float64 x"]), vec![2, 10, 21]),
            (op::CHANNEL, record(4, &[b"/topic", b"cdr", &pairs]), vec![4, 14, 21, 25, 32]),
        ] {
            assert!(is_whole(opcode, &sound));
            for at in lengths_at {
                let mut bytes = sound.clone();
                bytes[at..at + 4].fill(0xff);
                assert!(!is_whole(opcode, &bytes), "{opcode} {at}");
            }
            assert!(!is_whole(opcode, &sound[..sound.len() - 1]), "{opcode}");
        }
    }
}
