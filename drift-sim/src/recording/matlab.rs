//! MATLAB files of version 5 to 7 ("MAT-File Format", MathWorks): numeric arrays by name, also in structs.
//!
//! A vector is a column under its name, a matrix one column for each of its own (`data(:,2)`), a struct's field one as
//! `log.y`, an element of a struct array `log.signals(2).values`. Scalars, text, cells, sparse and complex arrays and
//! objects (tables, timeseries) are passed over.

use std::ops::Range;

use flate2::read::ZlibDecoder;

use super::ReadOptions;
use super::budget::Budget;
use super::format::Source;
use super::table::{Cells, Table, TableRows};
use crate::{Error, Result};

const HEADER_BYTES: usize = 128;
/// What of a packed variable is unpacked to see what it is.
const START_BYTES: u64 = 1 << 12;
/// Structs in structs, at most.
const DEPTH_MAX: usize = 16;
/// Columns of a matrix and elements of a struct array that become columns.
const ACROSS_MAX: usize = 256;
/// Columns of one file, at most: a broken file could name as many as it likes.
const COLUMNS_MAX: usize = 100_000;

/// Data types of an element (table 1-1 of the format).
mod element {
    pub const MATRIX: u32 = 14;
    pub const COMPRESSED: u32 = 15;
}

/// Classes of an array (table 1-3).
mod class {
    pub const STRUCT: u8 = 2;
    pub const DOUBLE: u8 = 6;
    pub const SINGLE: u8 = 7;
    pub const UINT64: u8 = 15;
}

const COMPLEX: u32 = 0x0800;

/// Whether a file begins like one of version 5 to 7.
pub(super) fn is_version_5(start: &[u8]) -> bool {
    matches!(start.get(124..HEADER_BYTES), Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I']))
}

/// The rows of a file that begins like one. Only the columns that are read are unpacked.
///
/// # Errors
/// The file is damaged, has no such arrays, or takes more memory than is allowed.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<TableRows> {
    let budget = source.budget.clone();
    let bytes = source.bytes()?;
    let (header, body) = bytes.split_at_checked(HEADER_BYTES).ok_or_else(damaged)?;
    let order = if header.ends_with(b"IM") { Order::Little } else { Order::Big };
    let mut file = File { order, budget, columns: Vec::new(), objects: Vec::new(), unpacked: None, body };
    let mut rest = body;
    while !rest.is_empty() {
        let (element, behind) = split_element(rest, order)?;
        let variable = offset_in(body, element.data);
        file.list(element, variable..variable + element.data.len())?;
        rest = behind;
    }
    if let Some(name) = file.objects.first().filter(|_| file.columns.is_empty()) {
        return Err(Error::new(format!("'{name}' is a table, which MATLAB writes as an object")).allowed(
            format!("in MATLAB: S = table2struct({name}, 'ToScalar', true); save('file.mat', 'S')"),
        ));
    }
    if file.columns.is_empty() {
        return Err(Error::new("the MATLAB file holds no numeric vectors")
            .allowed("r, y, u as vectors, matrices or fields of a struct"));
    }
    TableRows::new(file, Vec::new(), options)
}

/// A file whose variables are unpacked when they are needed.
struct File<'a> {
    order: Order,
    budget: Budget,
    columns: Vec<Column>,
    /// Names of tables and timetables.
    objects: Vec<String>,
    /// The variable that was unpacked last, by where it stands.
    unpacked: Option<(Range<usize>, Vec<u8>)>,
    body: &'a [u8],
}

/// One column: where its numbers are.
struct Column {
    name: String,
    /// The variable in the file's body, and whether it is packed.
    variable: Range<usize>,
    is_packed: bool,
    /// Its array's numbers within the variable: their type and place.
    kind: u32,
    numbers: Range<usize>,
    /// Which column of the array, and how many values each has.
    column: usize,
    rows: usize,
    is_single: bool,
}

impl File<'_> {
    /// Lists the columns of one variable.
    fn list(&mut self, element: Element, variable: Range<usize>) -> Result<()> {
        let mut found = Found { order: self.order, arrays: Vec::new(), objects: Vec::new() };
        let is_packed = element.kind == element::COMPRESSED;
        if !is_packed {
            if element.kind == element::MATRIX {
                found.collect(element.data, 0, element.data.len(), Path::Top, 0)?;
            }
        } else {
            // The start of an array tells its name and size; a struct has to be unpacked to see its fields.
            let start = self.budget.read_up_to(ZlibDecoder::new(element.data), START_BYTES, |_| damaged())?;
            self.budget.give_back(start.capacity() as u64);
            let tag = Tag::of(&start, self.order)?;
            let inside = start.get(tag.bytes..).unwrap_or_default();
            if tag.kind == element::MATRIX && !Found::is_struct(inside, self.order) {
                found.collect(inside, tag.bytes, tag.size, Path::Top, 0)?;
            } else if tag.kind == element::MATRIX {
                let whole = self.unpack(&variable)?;
                let inside = whole.get(tag.bytes..).unwrap_or_default();
                found.collect(inside, tag.bytes, inside.len(), Path::Top, 0)?;
            }
        }
        self.objects.extend(found.objects);
        for array in found.arrays {
            for column in 0..array.across {
                let name = match array.across {
                    1 => array.name.clone(),
                    _ => format!("{}(:,{})", array.name, column + 1),
                };
                self.budget.take((size_of::<Column>() + name.len()) as u64)?;
                self.columns.push(Column {
                    name,
                    variable: variable.clone(),
                    is_packed,
                    kind: array.kind,
                    numbers: array.numbers.clone(),
                    column,
                    rows: array.rows,
                    is_single: array.is_single,
                });
            }
        }
        Ok(())
    }

    /// A packed variable, unpacked: the one that was unpacked last is kept.
    fn unpack(&mut self, variable: &Range<usize>) -> Result<&[u8]> {
        if self.unpacked.as_ref().is_none_or(|(there, _)| there != variable) {
            if let Some((_, old)) = self.unpacked.take() {
                self.budget.give_back(old.capacity() as u64);
            }
            let packed = self.body.get(variable.clone()).unwrap_or_default();
            let start = self.budget.read_up_to(ZlibDecoder::new(packed), 8, |_| damaged())?;
            let tag = Tag::of(&start, self.order)?;
            // Refused before it is unpacked, where it says itself that it is too large.
            let size = (tag.bytes + tag.size) as u64;
            self.budget.take(size)?;
            self.budget.give_back(size);
            let bytes = self.budget.read_up_to(ZlibDecoder::new(packed), size, |_| damaged())?;
            self.unpacked = Some((variable.clone(), bytes));
        }
        Ok(self.unpacked.as_ref().map_or(&[], |(_, bytes)| bytes.as_slice()))
    }
}

impl Table for File<'_> {
    fn names(&self) -> Vec<String> {
        self.columns.iter().map(|column| column.name.clone()).collect()
    }

    fn length(&self, index: usize) -> usize {
        self.columns.get(index).map_or(0, |column| column.rows)
    }

    fn cells(&mut self, index: usize) -> Result<Cells> {
        let Some(column) = self.columns.get(index) else { return Ok(Cells::Single(Vec::new())) };
        let (kind, order, is_single, rows) = (column.kind, self.order, column.is_single, column.rows);
        let size = size_of_number(kind).ok_or_else(damaged)?;
        let from = column.numbers.start + column.column * rows * size;
        let (variable, is_packed) = (column.variable.clone(), column.is_packed);
        self.budget.take((rows * if is_single { 4 } else { 8 }) as u64)?;
        let whole =
            if is_packed { self.unpack(&variable)? } else { self.body.get(variable).unwrap_or_default() };
        let data = whole.get(from..from + rows * size).ok_or_else(damaged)?;
        numbers(kind, data, order, is_single).ok_or_else(damaged)
    }
}

/// Where a part stands in the whole that it was cut from.
fn offset_in(whole: &[u8], part: &[u8]) -> usize {
    (part.as_ptr() as usize).saturating_sub(whole.as_ptr() as usize)
}

fn damaged() -> Error {
    Error::new("the MATLAB file is cut off or damaged").allowed("a whole file, saved with -v7 or -v6")
}

#[derive(Clone, Copy)]
enum Order {
    Little,
    Big,
}

macro_rules! number {
    ($name:ident, $kind:ty) => {
        fn $name(self, bytes: &[u8]) -> Option<$kind> {
            let bytes = bytes.get(..size_of::<$kind>())?.try_into().ok()?;
            Some(match self {
                Self::Little => <$kind>::from_le_bytes(bytes),
                Self::Big => <$kind>::from_be_bytes(bytes),
            })
        }
    };
}

impl Order {
    number!(u16, u16);
    number!(i16, i16);
    number!(u32, u32);
    number!(i32, i32);
    number!(u64, u64);
    number!(i64, i64);
    number!(f32, f32);
    number!(f64, f64);
}

/// What stands before an element's data.
#[derive(Clone, Copy)]
struct Tag {
    kind: u32,
    size: usize,
    /// Bytes of the tag itself.
    bytes: usize,
}

impl Tag {
    fn of(bytes: &[u8], order: Order) -> Result<Self> {
        let tag = order.u32(bytes).ok_or_else(damaged)?;
        if tag >> 16 == 0 {
            let size = bytes.get(4..).and_then(|b| order.u32(b)).ok_or_else(damaged)?;
            return Ok(Self { kind: tag, size: size as usize, bytes: 8 });
        }
        // A small element: up to four bytes in the tag itself.
        Ok(Self { kind: tag & 0xffff, size: (tag >> 16) as usize, bytes: 4 })
    }
}

/// An element that is there as a whole.
#[derive(Clone, Copy)]
struct Element<'a> {
    kind: u32,
    data: &'a [u8],
}

/// The first element, and what follows it.
fn split_element(bytes: &[u8], order: Order) -> Result<(Element<'_>, &[u8])> {
    let tag = Tag::of(bytes, order)?;
    let end = tag.bytes + tag.size;
    let data = bytes.get(tag.bytes..end).ok_or_else(damaged)?;
    let padded = if tag.kind == element::COMPRESSED { end } else { end.next_multiple_of(8) };
    Ok((Element { kind: tag.kind, data }, bytes.get(padded..).unwrap_or_default()))
}

/// Where an array stands: its own name counts at the top only.
enum Path {
    Top,
    Field(String),
}

/// A numeric array: its name, its shape, and where its numbers are within its variable.
struct Array {
    name: String,
    kind: u32,
    numbers: Range<usize>,
    rows: usize,
    across: usize,
    is_single: bool,
}

/// The arrays of one variable.
struct Found {
    order: Order,
    arrays: Vec<Array>,
    objects: Vec<String>,
}

impl Found {
    fn is_struct(data: &[u8], order: Order) -> bool {
        let flags = split_element(data, order).ok().and_then(|(flags, _)| order.u32(flags.data));
        flags.is_some_and(|flags| (flags & 0xff) as u8 == class::STRUCT)
    }

    /// Adds an array, and those within it. `data` begins `at` bytes into the variable and may be cut off behind the tag of
    /// the numbers; `whole` is its size.
    fn collect(&mut self, data: &[u8], at: usize, whole: usize, path: Path, depth: usize) -> Result<()> {
        let order = self.order;
        // An empty array within a struct has no content at all.
        if data.is_empty() || depth > DEPTH_MAX || self.arrays.len() > COLUMNS_MAX {
            return Ok(());
        }
        let (flags, rest) = split_element(data, order)?;
        let flags = order.u32(flags.data).ok_or_else(damaged)?;
        let class = (flags & 0xff) as u8;
        if class > class::UINT64 {
            // An object of a later kind is built otherwise: its name, then the names of its system and its class.
            let words: Vec<String> = texts(rest, order).take(3).collect();
            if let [name, _, kind] = words.as_slice()
                && ["table", "timetable"].contains(&kind.as_str())
            {
                self.objects.push(name.clone());
            }
            return Ok(());
        }
        let (dimensions, rest) = split_element(rest, order)?;
        let dimensions: Vec<usize> = dimensions
            .data
            .chunks_exact(4)
            .map(|d| order.i32(d).and_then(|d| usize::try_from(d).ok()))
            .collect::<Option<_>>()
            .ok_or_else(damaged)?;
        let count = dimensions.iter().try_fold(1, |n: usize, d| n.checked_mul(*d)).ok_or_else(damaged)?;
        let (own_name, rest) = split_element(rest, order)?;
        let name = match path {
            Path::Top => String::from_utf8_lossy(own_name.data).into_owned(),
            Path::Field(name) => name,
        };
        let behind = at + offset_in(data, rest);
        match class {
            class::STRUCT if count <= ACROSS_MAX => self.fields(rest, behind, &name, count, depth),
            class::DOUBLE..=class::UINT64 if flags & COMPLEX == 0 => {
                let tag = Tag::of(rest, order)?;
                let from = behind + tag.bytes;
                let size = size_of_number(tag.kind).ok_or_else(damaged)?;
                if from + tag.size > at + whole || count.checked_mul(size) != Some(tag.size) {
                    return Err(damaged());
                }
                let numbers = from..from + tag.size;
                let array = |rows, across| Array {
                    name,
                    kind: tag.kind,
                    numbers,
                    rows,
                    across,
                    is_single: class == class::SINGLE && tag.kind == 7,
                };
                // A vector is one column, a matrix as many as it has; what is shorter than two is none.
                let longer = dimensions.iter().filter(|d| **d > 1).count();
                match (longer, dimensions.as_slice()) {
                    (1, _) => self.arrays.push(array(count, 1)),
                    (2, [rows, across]) if *across <= ACROSS_MAX => self.arrays.push(array(*rows, *across)),
                    _ => {}
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn fields(&mut self, data: &[u8], at: usize, name: &str, count: usize, depth: usize) -> Result<()> {
        let order = self.order;
        let (width, rest) = split_element(data, order)?;
        let width = order
            .i32(width.data)
            .and_then(|w| usize::try_from(w).ok())
            .filter(|w| *w > 0)
            .ok_or_else(damaged)?;
        let (names, mut rest) = split_element(rest, order)?;
        let names: Vec<String> = names
            .data
            .chunks_exact(width)
            .map(|n| String::from_utf8_lossy(n.split(|b| *b == 0).next().unwrap_or_default()).into_owned())
            .collect();
        for index in 1..=count {
            for field in &names {
                let (element, behind) = split_element(rest, order)?;
                if element.kind != element::MATRIX {
                    return Err(damaged());
                }
                let place = if count == 1 { String::new() } else { format!("({index})") };
                let path = Path::Field(format!("{name}{place}.{field}"));
                let from = at + offset_in(data, element.data);
                self.collect(element.data, from, element.data.len(), path, depth + 1)?;
                rest = behind;
            }
        }
        Ok(())
    }
}

/// Elements of text, as far as they are whole.
fn texts(mut rest: &[u8], order: Order) -> impl Iterator<Item = String> {
    std::iter::from_fn(move || {
        let (element, behind) = split_element(rest, order).ok()?;
        rest = behind;
        Some(String::from_utf8_lossy(element.data).into_owned())
    })
}

/// Bytes of a stored number; `None` for what is none.
fn size_of_number(kind: u32) -> Option<usize> {
    match kind {
        1 | 2 => Some(1),
        3 | 4 => Some(2),
        5..=7 => Some(4),
        9 | 12 | 13 => Some(8),
        _ => None,
    }
}

/// Numbers of any stored type: an array of doubles may be stored as bytes where they fit.
fn numbers(kind: u32, data: &[u8], order: Order, single: bool) -> Option<Cells> {
    // The budget was asked for what they take.
    let all = |size: usize, read: &dyn Fn(&[u8]) -> Option<f64>| {
        data.chunks_exact(size).map(read).collect::<Option<Vec<f64>>>().map(Cells::Double)
    };
    match kind {
        1 => all(1, &|b| b.first().map(|b| f64::from(b.cast_signed()))),
        2 => all(1, &|b| b.first().map(|b| f64::from(*b))),
        3 => all(2, &|b| order.i16(b).map(f64::from)),
        4 => all(2, &|b| order.u16(b).map(f64::from)),
        5 => all(4, &|b| order.i32(b).map(f64::from)),
        6 => all(4, &|b| order.u32(b).map(f64::from)),
        7 if single => data.chunks_exact(4).map(|b| order.f32(b)).collect::<Option<_>>().map(Cells::Single),
        7 => all(4, &|b| order.f32(b).map(f64::from)),
        9 => all(8, &|b| order.f64(b)),
        12 => all(8, &|b| order.i64(b).map(|x| x as f64)),
        13 => all(8, &|b| order.u64(b).map(|x| x as f64)),
        _ => None,
    }
}
