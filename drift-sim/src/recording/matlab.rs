//! MATLAB files of version 5 to 7 ("MAT-File Format", MathWorks): numeric arrays by name, also in structs.
//!
//! A vector is a column under its name, a matrix one column for each of its own (`data(:,2)`), a struct's field one as
//! `log.y`, an element of a struct array `log.signals(2).values`. Scalars, text, cells, sparse and complex arrays and
//! objects (tables, timeseries) are passed over.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::ReadOptions;
use super::table::{Cells, TableRows};
use crate::{Error, Result};

const HEADER_BYTES: usize = 128;
/// What one variable may unpack to.
const UNPACKED_BYTES_MAX: u64 = 1 << 31;
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

/// The rows of a file that begins like one.
///
/// # Errors
/// The file is damaged, or has no such arrays.
pub(super) fn open(mut source: impl Read, options: &ReadOptions) -> Result<TableRows> {
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes).map_err(|e| Error::new(format!("can't be read: {e}")))?;
    let Some((header, body)) = bytes.split_at_checked(HEADER_BYTES) else { return Err(damaged()) };
    let order = if header.ends_with(b"IM") { Order::Little } else { Order::Big };
    let mut columns = Vec::new();
    let mut rest = body;
    while !rest.is_empty() {
        let (kind, data, behind) = split_element(rest, order)?;
        match kind {
            element::COMPRESSED => {
                let mut unpacked = Vec::new();
                ZlibDecoder::new(data)
                    .take(UNPACKED_BYTES_MAX)
                    .read_to_end(&mut unpacked)
                    .map_err(|_| damaged())?;
                let (kind, data, _) = split_element(&unpacked, order)?;
                if kind == element::MATRIX {
                    collect(data, order, Path::Top, &mut columns, 0)?;
                }
            }
            element::MATRIX => collect(data, order, Path::Top, &mut columns, 0)?,
            _ => {}
        }
        rest = behind;
    }
    if columns.is_empty() {
        return Err(Error::new("the MATLAB file holds no numeric vectors")
            .allowed("r, y, u as vectors, matrices or fields of a struct"));
    }
    TableRows::new(columns, Vec::new(), options)
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

/// The first element's type and data, and what follows it.
fn split_element(bytes: &[u8], order: Order) -> Result<(u32, &[u8], &[u8])> {
    let tag = order.u32(bytes).ok_or_else(damaged)?;
    let (kind, size, from) = if tag >> 16 == 0 {
        let size = bytes.get(4..).and_then(|b| order.u32(b)).ok_or_else(damaged)?;
        (tag, size as usize, 8)
    } else {
        // A small element: up to four bytes in the tag itself.
        (tag & 0xffff, (tag >> 16) as usize, 4)
    };
    let end = from + size;
    let data = bytes.get(from..end).ok_or_else(damaged)?;
    let padded = if kind == element::COMPRESSED { end } else { end.next_multiple_of(8) };
    Ok((kind, data, bytes.get(padded..).unwrap_or_default()))
}

/// Where an array stands: its own name counts at the top only.
enum Path {
    Top,
    Field(String),
}

/// Adds the columns of one array, and of those within it.
fn collect(
    data: &[u8],
    order: Order,
    path: Path,
    columns: &mut Vec<(String, Cells)>,
    depth: usize,
) -> Result<()> {
    // An empty array within a struct has no content at all.
    if data.is_empty() || depth > DEPTH_MAX || columns.len() > COLUMNS_MAX {
        return Ok(());
    }
    let (_, flags, rest) = split_element(data, order)?;
    let flags = order.u32(flags).ok_or_else(damaged)?;
    let class = (flags & 0xff) as u8;
    if class > class::UINT64 {
        // An object of a later kind is built otherwise.
        return Ok(());
    }
    let (_, dimensions, rest) = split_element(rest, order)?;
    let dimensions: Vec<usize> = dimensions
        .chunks_exact(4)
        .map(|d| order.i32(d).and_then(|d| usize::try_from(d).ok()))
        .collect::<Option<_>>()
        .ok_or_else(damaged)?;
    let count = dimensions.iter().try_fold(1, |n: usize, d| n.checked_mul(*d)).ok_or_else(damaged)?;
    let (_, own_name, rest) = split_element(rest, order)?;
    let name = match path {
        Path::Top => String::from_utf8_lossy(own_name).into_owned(),
        Path::Field(name) => name,
    };
    match class {
        class::STRUCT if count <= ACROSS_MAX => fields(rest, order, &name, count, columns, depth),
        class::DOUBLE..=class::UINT64 if flags & COMPLEX == 0 => {
            let (kind, data, _) = split_element(rest, order)?;
            let cells = numbers(kind, data, order, class == class::SINGLE).ok_or_else(damaged)?;
            if cells.len() != count {
                return Err(damaged());
            }
            split_columns(&name, cells, &dimensions, columns);
            Ok(())
        }
        _ => Ok(()),
    }
}

fn fields(
    data: &[u8],
    order: Order,
    name: &str,
    count: usize,
    columns: &mut Vec<(String, Cells)>,
    depth: usize,
) -> Result<()> {
    let (_, width, rest) = split_element(data, order)?;
    let width =
        order.i32(width).and_then(|w| usize::try_from(w).ok()).filter(|w| *w > 0).ok_or_else(damaged)?;
    let (_, names, mut rest) = split_element(rest, order)?;
    let names: Vec<String> = names
        .chunks_exact(width)
        .map(|n| String::from_utf8_lossy(n.split(|b| *b == 0).next().unwrap_or_default()).into_owned())
        .collect();
    for index in 1..=count {
        for field in &names {
            let (kind, data, behind) = split_element(rest, order)?;
            if kind != element::MATRIX {
                return Err(damaged());
            }
            let place = if count == 1 { String::new() } else { format!("({index})") };
            collect(data, order, Path::Field(format!("{name}{place}.{field}")), columns, depth + 1)?;
            rest = behind;
        }
    }
    Ok(())
}

/// Numbers of any stored type: an array of doubles may be stored as bytes where they fit.
fn numbers(kind: u32, data: &[u8], order: Order, single: bool) -> Option<Cells> {
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

/// A vector is one column, a matrix as many as it has; what is shorter than two is none.
fn split_columns(name: &str, cells: Cells, dimensions: &[usize], columns: &mut Vec<(String, Cells)>) {
    let longer = dimensions.iter().filter(|d| **d > 1).count();
    match (longer, dimensions) {
        (1, _) => columns.push((name.to_owned(), cells)),
        (2, [rows, across]) if *across <= ACROSS_MAX => {
            for column in 0..*across {
                let range = column * rows..(column + 1) * rows;
                let part = match &cells {
                    Cells::Double(values) => values.get(range).map(|v| Cells::Double(v.to_vec())),
                    Cells::Single(values) => values.get(range).map(|v| Cells::Single(v.to_vec())),
                    Cells::Text(_) => None,
                };
                columns.extend(part.map(|part| (format!("{name}(:,{})", column + 1), part)));
            }
        }
        _ => {}
    }
}
