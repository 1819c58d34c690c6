//! Messages of ROS 2: the text of a message definition (`ros2msg`) laid out, and numbers read from its CDR bytes (OMG DDS-XTypes,
//! plain CDR: every number aligned to its own size behind a header of four bytes).

use std::collections::HashMap;

/// Messages in messages, at most.
const DEPTH_MAX: usize = 12;
/// Elements of an array that become columns.
const ELEMENTS_MAX: usize = 64;
/// Values of one message that are visited, at most.
const VALUES_MAX: usize = 100_000;
/// Fields that an error lists of one topic.
const FIELDS_SHOWN: usize = 8;

/// The fields of a message type and of those within it.
#[derive(Debug)]
pub(super) struct Layout {
    types: HashMap<String, Vec<Field>>,
    root: String,
}

#[derive(Debug)]
struct Field {
    name: String,
    kind: Kind,
    length: Length,
}

#[derive(Debug)]
enum Kind {
    /// Size, and how its bytes are read.
    Number(usize, fn([u8; 8]) -> f64),
    Text,
    /// Text of two or four bytes a letter is not read on from.
    Message(String),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Length {
    One,
    Fixed(usize),
    Counted,
}

fn low<const N: usize>(bytes: [u8; 8]) -> [u8; N] {
    let mut part = [0; N];
    for (to, from) in part.iter_mut().zip(bytes) {
        *to = from;
    }
    part
}

fn kind_of(name: &str, package: &str) -> Kind {
    match name {
        "bool" | "byte" | "char" | "uint8" => Kind::Number(1, |b| f64::from(b[0])),
        "int8" => Kind::Number(1, |b| f64::from(b[0].cast_signed())),
        "int16" => Kind::Number(2, |b| f64::from(i16::from_le_bytes(low(b)))),
        "uint16" => Kind::Number(2, |b| f64::from(u16::from_le_bytes(low(b)))),
        "int32" => Kind::Number(4, |b| f64::from(i32::from_le_bytes(low(b)))),
        "uint32" => Kind::Number(4, |b| f64::from(u32::from_le_bytes(low(b)))),
        "float32" => Kind::Number(4, |b| f64::from(f32::from_le_bytes(low(b)))),
        "int64" => Kind::Number(8, |b| i64::from_le_bytes(b) as f64),
        "uint64" => Kind::Number(8, |b| u64::from_le_bytes(b) as f64),
        "float64" => Kind::Number(8, f64::from_le_bytes),
        text if text == "string" || text.starts_with("string<=") => Kind::Text,
        "Header" => Kind::Message("std_msgs/Header".into()),
        other if other.contains('/') => Kind::Message(short(other)),
        other => Kind::Message(format!("{package}/{other}")),
    }
}

/// `std_msgs/Header` for `std_msgs/msg/Header`.
fn short(name: &str) -> String {
    let mut parts = name.split('/');
    match (parts.next(), parts.next_back()) {
        (Some(package), Some(own)) => format!("{package}/{own}"),
        _ => name.to_owned(),
    }
}

impl Layout {
    /// Lays out a definition, with those of the messages within it behind lines of `=`.
    pub fn parse(text: &str, name: &str) -> Option<Self> {
        let root = short(name);
        let mut types: HashMap<String, Vec<Field>> = HashMap::new();
        let mut own = root.clone();
        types.insert(root.clone(), Vec::new());
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if line.is_empty() || line.starts_with("===") {
                continue;
            }
            if let Some(name) = line.strip_prefix("MSG:") {
                own = short(name.trim());
                types.entry(own.clone()).or_default();
                continue;
            }
            let (kind, rest) = line.split_once(char::is_whitespace)?;
            // A constant is no field.
            if rest.split_whitespace().next().is_some_and(|name| name.contains('='))
                || rest.split_whitespace().nth(1).is_some_and(|word| word.starts_with('='))
            {
                continue;
            }
            let field = rest.split_whitespace().next()?.to_owned();
            let (kind, length) = match kind.split_once('[') {
                None => (kind, Length::One),
                Some((kind, count)) => match count.trim_end_matches(']').parse() {
                    Ok(count) => (kind, Length::Fixed(count)),
                    Err(_) => (kind, Length::Counted),
                },
            };
            let package = own.split('/').next().unwrap_or_default().to_owned();
            let field = Field { name: field, kind: kind_of(kind, &package), length };
            types.entry(own.clone()).or_default().push(field);
        }
        Some(Self { types, root })
    }

    /// Some fields that are numbers, for an error to list.
    pub fn some_fields(&self) -> Vec<String> {
        let fields = self.types.get(&self.root).map(Vec::as_slice).unwrap_or_default();
        let number = |field: &Field| match (&field.kind, field.length) {
            (Kind::Number(..), Length::One) => Some(field.name.clone()),
            (Kind::Number(..), _) => Some(format!("{}[0]", field.name)),
            (Kind::Message(name), Length::One) => {
                let inner = self.types.get(name)?.iter().find(|f| matches!(f.kind, Kind::Number(..)))?;
                Some(format!("{}.{}", field.name, inner.name))
            }
            _ => None,
        };
        fields.iter().filter_map(number).take(FIELDS_SHOWN).collect()
    }

    /// Tells every number of a message, up to where its bytes end.
    pub fn read(&self, data: &[u8], tell: &mut dyn FnMut(&str, f64)) {
        let Some((header, body)) = data.split_at_checked(4) else { return };
        let is_little = header.get(1).is_some_and(|b| b & 1 == 1);
        let mut bytes = Bytes { body, at: 0, is_little, values: 0 };
        let _ = self.message(&self.root, "", &mut bytes, 0, tell);
    }

    fn message(
        &self,
        name: &str,
        prefix: &str,
        bytes: &mut Bytes,
        depth: usize,
        tell: &mut dyn FnMut(&str, f64),
    ) -> Option<()> {
        let fields = self.types.get(name).filter(|_| depth <= DEPTH_MAX)?;
        if fields.is_empty() {
            // An empty message has one byte, so that it is something.
            bytes.number(1)?;
        }
        for field in fields {
            let count = match field.length {
                Length::One => 1,
                Length::Fixed(count) => count,
                Length::Counted => bytes.count()?,
            };
            for index in 0..count {
                let place = if field.length == Length::One { String::new() } else { format!("[{index}]") };
                let own = format!("{prefix}{}{place}", field.name);
                match &field.kind {
                    Kind::Number(size, read) => {
                        let value = read(bytes.number(*size)?);
                        if index < ELEMENTS_MAX {
                            tell(&own, value);
                        }
                    }
                    Kind::Text => bytes.text()?,
                    Kind::Message(inner) => {
                        self.message(inner, &format!("{own}."), bytes, depth + 1, tell)?
                    }
                }
            }
        }
        Some(())
    }
}

/// The bytes of a message behind its header.
struct Bytes<'a> {
    body: &'a [u8],
    at: usize,
    is_little: bool,
    values: usize,
}

impl Bytes<'_> {
    /// The next number, low byte first.
    fn number(&mut self, size: usize) -> Option<[u8; 8]> {
        self.values += 1;
        let from = self.at.next_multiple_of(size);
        let part = self.body.get(from..from + size).filter(|_| self.values <= VALUES_MAX)?;
        self.at = from + size;
        let mut bytes = [0; 8];
        for (to, from) in bytes.iter_mut().zip(part) {
            *to = *from;
        }
        if !self.is_little {
            bytes.get_mut(..size)?.reverse();
        }
        Some(bytes)
    }

    fn count(&mut self) -> Option<usize> {
        self.number(4).map(|bytes| u32::from_le_bytes(low(bytes)) as usize)
    }

    fn text(&mut self) -> Option<()> {
        let length = self.count()?;
        self.at = self.at.checked_add(length).filter(|at| *at <= self.body.len())?;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_and_nested_messages_are_followed() {
        let text = "std_msgs/Header header\nuint8 LIMIT=3\nbool on # a flag\nfloat64[] position\nfloat32[2] pair\nInner in\n\
                    ===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n===\n\
                    MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n===\nMSG: demo/Inner\nint16 x\n";
        let layout = Layout::parse(text, "demo/msg/State").unwrap();
        let mut data = vec![0, 1, 0, 0];
        data.extend(7_i32.to_le_bytes());
        data.extend(8_u32.to_le_bytes());
        data.extend(3_u32.to_le_bytes());
        data.extend(b"ab\0");
        data.push(1);
        // The count of positions is aligned to four, the positions to eight.
        data.extend(2_u32.to_le_bytes());
        data.extend([0; 4]);
        data.extend(1.5_f64.to_le_bytes());
        data.extend((-2.5_f64).to_le_bytes());
        data.extend(0.5_f32.to_le_bytes());
        data.extend(0.25_f32.to_le_bytes());
        data.extend((-9_i16).to_le_bytes());
        let mut found = Vec::new();
        layout.read(&data, &mut |name, value| found.push((name.to_owned(), value)));
        let wanted = [
            ("header.stamp.sec", 7.0),
            ("header.stamp.nanosec", 8.0),
            ("on", 1.0),
            ("position[0]", 1.5),
            ("position[1]", -2.5),
            ("pair[0]", 0.5),
            ("pair[1]", 0.25),
            ("in.x", -9.0),
        ];
        assert_eq!(found, wanted.map(|(name, value)| (name.to_owned(), value)));
        assert_eq!(
            layout.some_fields(),
            ["header.sec", "on", "position[0]", "pair[0]", "in.x"].map(String::from)[1..]
        );
        // A message that is cut off tells what is there; one that claims a billion numbers ends with its bytes.
        let mut few = 0;
        layout.read(&data[..20], &mut |_, _| few += 1);
        assert_eq!(few, 3);
    }
}
