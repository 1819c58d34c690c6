//! The elements that MATLAB files of version 5 to 7 are made of ("MAT-File Format", MathWorks): tags, heads of arrays, numbers.

use super::table::Cells;
use crate::{Error, Result};

/// Data types of an element (table 1-1 of the format).
pub(super) mod element {
    pub const MATRIX: u32 = 14;
    pub const COMPRESSED: u32 = 15;
}

/// Classes of an array (table 1-3; 17 is not published).
pub(super) mod class {
    pub const CELL: u8 = 1;
    pub const STRUCT: u8 = 2;
    pub const CHAR: u8 = 4;
    pub const DOUBLE: u8 = 6;
    pub const SINGLE: u8 = 7;
    pub const UINT64: u8 = 15;
    pub const OPAQUE: u8 = 17;
}

const COMPLEX: u32 = 0x0800;

pub(super) fn damaged() -> Error {
    Error::new("the MATLAB file is cut off or damaged").allowed("a whole file, saved with -v7 or -v6")
}

/// Where a part stands in the whole that it was cut from.
pub(super) fn offset_in(whole: &[u8], part: &[u8]) -> usize {
    (part.as_ptr() as usize).saturating_sub(whole.as_ptr() as usize)
}

#[derive(Clone, Copy)]
pub(super) enum Order {
    Little,
    Big,
}

macro_rules! number {
    ($name:ident, $kind:ty) => {
        pub fn $name(self, bytes: &[u8]) -> Option<$kind> {
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
pub(super) struct Tag {
    pub kind: u32,
    pub size: usize,
    /// Bytes of the tag itself.
    pub bytes: usize,
}

impl Tag {
    pub fn of(bytes: &[u8], order: Order) -> Result<Self> {
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
pub(super) struct Element<'a> {
    pub kind: u32,
    pub data: &'a [u8],
}

/// The first element, and what follows it.
pub(super) fn split_element(bytes: &[u8], order: Order) -> Result<(Element<'_>, &[u8])> {
    let tag = Tag::of(bytes, order)?;
    let end = tag.bytes + tag.size;
    let data = bytes.get(tag.bytes..end).ok_or_else(damaged)?;
    let padded = if tag.kind == element::COMPRESSED { end } else { end.next_multiple_of(8) };
    Ok((Element { kind: tag.kind, data }, bytes.get(padded..).unwrap_or_default()))
}

/// The class of an array, and whether it is complex; what follows.
pub(super) fn class_of(data: &[u8], order: Order) -> Result<(u8, bool, &[u8])> {
    let (flags, rest) = split_element(data, order)?;
    let flags = order.u32(flags.data).ok_or_else(damaged)?;
    Ok(((flags & 0xff) as u8, flags & COMPLEX != 0, rest))
}

/// What stands before the content of an array.
pub(super) struct Head<'a> {
    pub class: u8,
    pub is_complex: bool,
    pub dimensions: Vec<usize>,
    /// Elements of the array.
    pub count: usize,
    pub name: &'a [u8],
    pub content: &'a [u8],
}

impl<'a> Head<'a> {
    pub fn of(data: &'a [u8], order: Order) -> Result<Self> {
        let (class, is_complex, rest) = class_of(data, order)?;
        let (dimensions, rest) = split_element(rest, order)?;
        let dimensions: Vec<usize> = dimensions
            .data
            .chunks_exact(4)
            .map(|d| order.i32(d).and_then(|d| usize::try_from(d).ok()))
            .collect::<Option<_>>()
            .ok_or_else(damaged)?;
        let count = dimensions.iter().try_fold(1, |n: usize, d| n.checked_mul(*d)).ok_or_else(damaged)?;
        let (name, content) = split_element(rest, order)?;
        Ok(Self { class, is_complex, dimensions, count, name: name.data, content })
    }

    /// Rows and columns; `None` for what is empty or has more dimensions.
    pub fn shape(&self) -> Option<(usize, usize)> {
        match self.dimensions.as_slice() {
            [rows, across] if *rows > 0 && *across > 0 => Some((*rows, *across)),
            _ => None,
        }
    }
}

/// An object, which is built otherwise: its name, then the names of its system and its class.
pub(super) struct Opaque<'a> {
    pub name: String,
    pub system: String,
    pub class: String,
    pub content: &'a [u8],
}

impl<'a> Opaque<'a> {
    pub fn of(data: &'a [u8], order: Order) -> Result<Self> {
        let (_, _, mut content) = class_of(data, order)?;
        let [mut name, mut system, mut class] = [const { String::new() }; 3];
        for word in [&mut name, &mut system, &mut class] {
            let (text, rest) = split_element(content, order)?;
            *word = String::from_utf8_lossy(text.data).into_owned();
            content = rest;
        }
        Ok(Self { name, system, class, content })
    }
}

/// The names of a struct's fields; what follows.
pub(super) fn field_names(content: &[u8], order: Order) -> Result<(Vec<String>, &[u8])> {
    let (width, rest) = split_element(content, order)?;
    let width =
        order.i32(width.data).and_then(|w| usize::try_from(w).ok()).filter(|w| *w > 0).ok_or_else(damaged)?;
    let (names, rest) = split_element(rest, order)?;
    let name =
        |n: &[u8]| String::from_utf8_lossy(n.split(|b| *b == 0).next().unwrap_or_default()).into_owned();
    Ok((names.data.chunks_exact(width).map(name).collect(), rest))
}

/// Text, of whatever bytes a letter takes.
pub(super) fn text(element: Element, order: Order) -> String {
    match element.kind {
        4 | 17 => {
            let units: Vec<u16> = element.data.chunks_exact(2).filter_map(|b| order.u16(b)).collect();
            String::from_utf16_lossy(&units)
        }
        _ => String::from_utf8_lossy(element.data).into_owned(),
    }
}

/// Bytes of a stored number; `None` for what is none.
pub(super) fn size_of_number(kind: u32) -> Option<usize> {
    match kind {
        1 | 2 => Some(1),
        3 | 4 => Some(2),
        5..=7 => Some(4),
        9 | 12 | 13 => Some(8),
        _ => None,
    }
}

/// Numbers of any stored type: an array of doubles may be stored as bytes where they fit.
pub(super) fn numbers(kind: u32, data: &[u8], order: Order, single: bool) -> Option<Cells> {
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

/// Whole numbers from 0 on, to the last bit; `None` where others are stored.
pub(super) fn whole_numbers(kind: u32, data: &[u8], order: Order) -> Option<Vec<u64>> {
    match kind {
        2 => Some(data.iter().map(|b| u64::from(*b)).collect()),
        4 => data.chunks_exact(2).map(|b| order.u16(b).map(u64::from)).collect(),
        6 => data.chunks_exact(4).map(|b| order.u32(b).map(u64::from)).collect(),
        13 => data.chunks_exact(8).map(|b| order.u64(b)).collect(),
        _ => None,
    }
}
