//! PX4's ULog files ("ULog File Format", docs.px4.io): every field of a topic is a column `topic.field`, of its further
//! instances `topic[1].field`.
//!
//! Topics come at rates of their own. The rows are those of y's topic, with its time stamps; fields of other topics hold
//! their last value before.

use std::collections::HashMap;

use super::ReadOptions;
use super::budget::Budget;
use super::format::Source;
use super::row::excerpt;
use super::table::{Cells, TableRows};
use crate::{Error, Result};

/// What such a file begins with.
pub(super) const MAGIC: &[u8] = b"ULog\x01\x12\x35";
const HEADER_BYTES: usize = 16;
/// Formats in formats, and columns of one topic, at most.
const DEPTH_MAX: usize = 8;
const FIELDS_MAX: usize = 4096;
/// Letters of a field's whole name.
const NAME_BYTES_MAX: usize = 1024;
/// Steps to lay out one format: arrays of nothing in arrays of nothing need no room, but time.
const STEPS_MAX: usize = 100_000;

/// The rows of a file that begins like one.
///
/// # Errors
/// The file is damaged; y is not named; a topic or field is not there.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<TableRows> {
    let budget = source.budget.clone();
    let bytes = source.bytes()?;
    let log = Log::parse(&bytes, &budget)?;
    let map = &options.columns;
    let y = log.signal(&map.y)?;
    let base = y.topic;
    let stamps = log.stamps(base)?;
    let mut notes = Vec::new();
    let has_r = !map.r.is_empty() && (map.is_named[1] || log.signal(&map.r).is_ok());
    let mut names: Vec<&str> = if has_r { vec![&map.r] } else { Vec::new() };
    names.extend([map.y.as_str(), map.u.as_str()]);
    names.extend(options.when.iter().map(|when| when.column.as_str()));
    names.extend(options.extra.iter().map(String::as_str));
    names.extend(map.t.as_deref().filter(|_| map.is_named[0]));
    let mut columns: Vec<(String, Cells)> = Vec::new();
    for name in names {
        if columns.iter().any(|(there, _)| there == name) {
            continue;
        }
        let signal = log.signal(name)?;
        let values = log.values(&signal)?;
        if signal.topic == base {
            columns.push((name.to_owned(), Cells::Double(values)));
        } else {
            columns
                .push((name.to_owned(), Cells::Double(held(&stamps, &log.stamps(signal.topic)?, &values))));
            notes.push(format!("'{name}' holds its last value before each '{}'", map.y));
        }
    }
    let mut options = options.clone();
    if map.t.is_some() && !map.is_named[0] {
        // Time counts from the first row; the stamps are whole microseconds since the start of the system.
        let first = stamps.first().copied().unwrap_or(0);
        let seconds = stamps.iter().map(|t| t.saturating_sub(first) as f64 / 1e6).collect();
        options.columns.t = Some("t".into());
        budget.take(stamps.len() as u64 * 8)?;
        columns.push(("t".into(), Cells::Double(seconds)));
        notes.push(format!("t counts from {} s after the start of the system", first as f64 / 1e6));
    }
    TableRows::new(columns, notes, &options)
}

/// The last value before each stamp, or at it; missing before the first.
pub(super) fn held(stamps: &[u64], others: &[u64], values: &[f64]) -> Vec<f64> {
    let mut pairs = others.iter().zip(values).peekable();
    let mut last = f64::NAN;
    stamps
        .iter()
        .map(|stamp| {
            while let Some((_, value)) = pairs.next_if(|(other, _)| *other <= stamp) {
                last = *value;
            }
            last
        })
        .collect()
}

fn damaged(what: &str) -> Error {
    Error::new(format!("the ULog file is damaged: {what}"))
}

/// A number's type: its name in a format, its size, and how it is read.
type Scalar = (&'static str, usize, fn(&[u8]) -> Option<f64>);

macro_rules! scalar {
    ($name:literal, $kind:ty) => {
        ($name, size_of::<$kind>(), |b| Some(<$kind>::from_le_bytes(b.try_into().ok()?) as f64))
    };
}

const SCALARS: [Scalar; 12] = [
    scalar!("int8_t", i8),
    scalar!("uint8_t", u8),
    scalar!("int16_t", i16),
    scalar!("uint16_t", u16),
    scalar!("int32_t", i32),
    scalar!("uint32_t", u32),
    scalar!("int64_t", i64),
    scalar!("uint64_t", u64),
    scalar!("float", f32),
    scalar!("double", f64),
    ("bool", 1, |b| b.first().map(|b| f64::from(u8::from(*b != 0)))),
    ("char", 1, |b| b.first().map(|b| f64::from(*b))),
];

/// One number in a topic's data.
#[derive(Debug, Clone)]
struct Field {
    name: String,
    offset: usize,
    scalar: usize,
}

/// A topic's instance, by its place in [`Log::topics`], and the field.
struct Signal {
    topic: usize,
    field: Field,
}

struct Topic<'a> {
    name: String,
    /// Laid out only when a field is asked for.
    format: String,
    data: Vec<&'a [u8]>,
}

/// What the messages so far have declared.
#[derive(Default)]
struct Known {
    /// Places in [`Log::topics`] by the id in data messages.
    topics: HashMap<u16, usize>,
}

/// What is read of a file.
struct Log<'a> {
    topics: Vec<Topic<'a>>,
    formats: HashMap<String, String>,
    budget: &'a Budget,
}

impl<'a> Log<'a> {
    fn parse(bytes: &'a [u8], budget: &'a Budget) -> Result<Self> {
        let body = bytes.get(HEADER_BYTES..).ok_or_else(|| damaged("it ends in its header"))?;
        let mut log = Self { topics: Vec::new(), formats: HashMap::new(), budget };
        let mut known = Known::default();
        // Data appended after a crash begin at a stated place, whatever was cut off before it.
        let appended = appended_at(body).filter(|at| *at > 0).and_then(|at| body.split_at_checked(at));
        let (main, appended) = appended.unwrap_or((body, &[]));
        log.read_messages(main, &mut known)?;
        log.read_messages(appended, &mut known)?;
        log.topics.retain(|topic| !topic.data.is_empty());
        if log.topics.is_empty() {
            return Err(Error::new("the ULog file holds no data"));
        }
        Ok(log)
    }

    /// Messages up to the last whole one: a log may end anywhere, where the vehicle lost its power.
    fn read_messages(&mut self, mut rest: &'a [u8], known: &mut Known) -> Result<()> {
        while let Some((header, behind)) = rest.split_at_checked(3) {
            let size = usize::from(u16::from_le_bytes([header[0], header[1]]));
            let Some((payload, behind)) = behind.split_at_checked(size) else { break };
            rest = behind;
            match header[2] {
                b'B' => check_flags(payload)?,
                b'F' => {
                    let text = String::from_utf8_lossy(payload);
                    let (name, fields) =
                        text.split_once(':').ok_or_else(|| damaged("a format without a name"))?;
                    self.budget.take((2 * size_of::<String>() + text.len()) as u64)?;
                    self.formats.insert(name.to_owned(), fields.to_owned());
                }
                b'A' => {
                    if let Some((id, topic)) = subscription(payload) {
                        if !self.formats.contains_key(&topic.format) {
                            return Err(missing_format(&topic.format));
                        }
                        known.topics.insert(id, self.topics.len());
                        self.budget.take(2 * topic.name.len() as u64)?;
                        self.budget.push(&mut self.topics, topic)?;
                    }
                }
                b'D' => {
                    let Some((id, data)) = payload.split_at_checked(2) else { continue };
                    let topic = known.topics.get(&u16::from_le_bytes([id[0], id[1]]));
                    if let Some(topic) = topic.and_then(|index| self.topics.get_mut(*index)) {
                        self.budget.push(&mut topic.data, data)?;
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// A field by the name of its column.
    fn signal(&self, name: &str) -> Result<Signal> {
        let (topic, field) = name.split_once('.').ok_or_else(|| self.unnamed(name))?;
        let index = self.topics.iter().position(|t| t.name == topic).ok_or_else(|| self.unnamed(name))?;
        let fields = self.fields(index)?;
        match fields.iter().find(|f| f.name == field) {
            Some(field) => Ok(Signal { topic: index, field: field.clone() }),
            None => {
                let there: Vec<_> = fields.iter().map(|f| f.name.as_str()).collect();
                Err(Error::new(format!("no field '{field}' in the topic '{topic}'"))
                    .allowed(format!("its fields are {}", excerpt(&there.join(", ")))))
            }
        }
    }

    fn unnamed(&self, name: &str) -> Error {
        let there: Vec<_> = self.topics.iter().map(|t| t.name.as_str()).collect();
        Error::new(format!("no topic and field '{name}' in the ULog file")).allowed(format!(
            "--columns r=topic.field,y=topic.field,u=topic.field; the topics are {}",
            excerpt(&there.join(", "))
        ))
    }

    /// The fields of a topic.
    fn fields(&self, topic: usize) -> Result<Vec<Field>> {
        let mut layout = Layout { formats: &self.formats, fields: Vec::new(), steps: 0 };
        if let Some(topic) = self.topics.get(topic) {
            layout.add(&topic.format, "", 0, 0)?;
        }
        Ok(layout.fields)
    }

    fn values(&self, signal: &Signal) -> Result<Vec<f64>> {
        let (_, size, read) = SCALARS[signal.field.scalar];
        let at = signal.field.offset;
        let value = |data: &&[u8]| data.get(at..at + size).and_then(read).unwrap_or(f64::NAN);
        let Some(topic) = self.topics.get(signal.topic) else { return Ok(Vec::new()) };
        self.budget.take(topic.data.len() as u64 * 8)?;
        Ok(topic.data.iter().map(value).collect())
    }

    /// The time stamps of a topic, microseconds: its first field, or the one of that name.
    fn stamps(&self, topic: usize) -> Result<Vec<u64>> {
        let at = self.fields(topic)?.iter().find(|f| f.name == "timestamp").map_or(0, |f| f.offset);
        let Some(topic) = self.topics.get(topic) else { return Ok(Vec::new()) };
        self.budget.take(topic.data.len() as u64 * 8)?;
        let stamp =
            |data: &&[u8]| data.get(at..at + 8).and_then(|b| b.try_into().ok()).map_or(0, u64::from_le_bytes);
        Ok(topic.data.iter().map(stamp).collect())
    }
}

/// Flags that a reader must know: of them only appended data, which is read like the rest.
fn check_flags(payload: &[u8]) -> Result<()> {
    let incompatible = payload.get(8..16).unwrap_or_default();
    let known = |(i, flags): (usize, &u8)| if i == 0 { flags & !1 == 0 } else { *flags == 0 };
    if incompatible.iter().enumerate().all(known) {
        return Ok(());
    }
    Err(Error::new("the ULog file is of a later version").allowed("version 1, with appended data or without"))
}

/// Where appended data begin, from the end of the file's header on; the flags are the first message.
fn appended_at(body: &[u8]) -> Option<usize> {
    let flags = body.get(3..43).filter(|_| body.get(2) == Some(&b'B'))?;
    let is_appended = flags.get(8)? & 1 == 1;
    let at = u64::from_le_bytes(flags.get(16..24)?.try_into().ok()?);
    usize::try_from(at).ok()?.checked_sub(HEADER_BYTES).filter(|_| is_appended)
}

fn subscription<'a>(payload: &[u8]) -> Option<(u16, Topic<'a>)> {
    let (&[instance, low, high], name) = payload.split_first_chunk::<3>()?;
    let format = String::from_utf8_lossy(name).into_owned();
    let name = if instance == 0 { format.clone() } else { format!("{format}[{instance}]") };
    Some((u16::from_le_bytes([low, high]), Topic { name, format, data: Vec::new() }))
}

fn missing_format(format: &str) -> Error {
    damaged(&format!("the format '{}' is missing", excerpt(format)))
}

/// The fields of a format, one behind the other.
struct Layout<'a> {
    formats: &'a HashMap<String, String>,
    fields: Vec<Field>,
    steps: usize,
}

impl Layout<'_> {
    /// Adds the fields of a format from this offset on; gives the offset behind them.
    fn add(&mut self, format: &str, prefix: &str, mut offset: usize, depth: usize) -> Result<usize> {
        let text = self.formats.get(format).ok_or_else(|| missing_format(format))?;
        if depth > DEPTH_MAX {
            return Err(damaged("formats within formats without end"));
        }
        for field in text.split(';').filter(|field| !field.is_empty()) {
            let (kind, name) = field.split_once(' ').ok_or_else(|| damaged("a field without a name"))?;
            if prefix.len() + name.len() > NAME_BYTES_MAX {
                return Err(damaged("a field's name of more than 1024 letters"));
            }
            let (kind, count) = match kind.split_once('[') {
                Some((kind, count)) => {
                    let count = count.trim_end_matches(']').parse::<usize>();
                    (kind, Some(count.map_err(|_| damaged("an array without a length"))?))
                }
                None => (kind, None),
            };
            let scalar = SCALARS.iter().position(|(name, _, _)| *name == kind);
            for index in 0..count.unwrap_or(1) {
                self.steps += 1;
                let is_too_long = self.fields.len() > FIELDS_MAX || offset > usize::from(u16::MAX);
                if is_too_long || self.steps > STEPS_MAX {
                    return Err(damaged("a format longer than a message"));
                }
                let place = if count.is_some() { format!("[{index}]") } else { String::new() };
                let name = format!("{prefix}{name}{place}");
                match scalar {
                    Some(scalar) => {
                        if !name.starts_with("_padding") {
                            self.fields.push(Field { name, offset, scalar });
                        }
                        offset += SCALARS[scalar].1;
                    }
                    None => offset = self.add(kind, &format!("{name}."), offset, depth + 1)?,
                }
            }
        }
        Ok(offset)
    }
}
