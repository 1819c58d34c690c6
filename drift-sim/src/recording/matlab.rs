//! MATLAB files of version 5 to 7 ("MAT-File Format", MathWorks): numeric arrays by name, also in structs.
//!
//! A vector is a column under its name, a matrix one column for each of its own (`data(:,2)`), a struct's field one as
//! `log.y`, an element of a struct array `log.signals(2).values`, or `log.signals.y` where its label is `y`, a table's variable
//! `T.y`. Scalars, text, cells, sparse and complex
//! arrays and other objects are passed over.

use std::ops::Range;

use flate2::read::ZlibDecoder;

use super::ReadOptions;
use super::budget::Budget;
use super::format::Source;
use super::matlab_elements::{
    Element, Head, Opaque, Order, Tag, class, class_of, damaged, element, field_names, numbers, offset_in,
    size_of_number, split_element, text, whole_numbers,
};
use super::matlab_labels::{is_of_label, labels};
use super::matlab_objects::{Arrays, Kind, Objects};
use super::matlab_table::{self, TableColumn};
use super::matlab_unread::{Unread, told_or_refused};
use super::table::{Cells, Table, TableRows};
use crate::{Error, Result};

const HEADER_BYTES: usize = 128;
/// Where the header says where the objects' properties are.
const SUBSYSTEM_AT: Range<usize> = 116..124;
/// What stands before the first element of those.
const SUBSYSTEM_HEADER_BYTES: usize = 8;
/// What of a packed variable is unpacked to see what it is.
const START_BYTES: u64 = 1 << 12;
/// Structs in structs, at most.
const DEPTH_MAX: usize = 16;
/// Columns of a matrix and elements of a struct array that become columns.
const ACROSS_MAX: usize = 256;
/// Columns of one file, at most: a broken file could name as many as it likes.
const COLUMNS_MAX: usize = 100_000;

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
    // 0, or blanks, where there are no objects.
    let subsystem_at = header
        .get(SUBSYSTEM_AT)
        .and_then(|at| usize::try_from(order.u64(at)?).ok()?.checked_sub(HEADER_BYTES))
        .filter(|at| *at < body.len());
    let mut file = File {
        order,
        budget,
        columns: Vec::new(),
        opaque: Vec::new(),
        subsystem: None,
        unpacked: None,
        body,
    };
    let mut rest = body;
    while !rest.is_empty() {
        let at = offset_in(body, rest);
        let (element, behind) = split_element(rest, order)?;
        let start = offset_in(body, element.data);
        let variable = Variable {
            place: start..start + element.data.len(),
            is_packed: element.kind == element::COMPRESSED,
        };
        if subsystem_at == Some(at) {
            file.subsystem = Some(variable);
        } else {
            file.list(element, &variable)?;
        }
        rest = behind;
    }
    let unread = file.list_objects()?;
    let notes = told_or_refused(&unread, !file.columns.is_empty())?;
    if file.columns.is_empty() {
        return Err(Error::new("the MATLAB file holds no numeric vectors")
            .allowed("r, y, u as vectors, matrices or fields of a struct"));
    }
    TableRows::new(file, notes, options)
}

/// A file whose variables are unpacked when they are needed.
struct File<'a> {
    order: Order,
    budget: Budget,
    columns: Vec<Column>,
    /// Variables that are objects.
    opaque: Vec<Reference>,
    /// Where the objects' properties are.
    subsystem: Option<Variable>,
    /// The variable that was unpacked last, by where it stands.
    unpacked: Option<(Range<usize>, Vec<u8>)>,
    body: &'a [u8],
}

/// A variable of the file: its place in the body, and whether it is packed.
#[derive(Clone)]
struct Variable {
    place: Range<usize>,
    is_packed: bool,
}

/// A variable that is an object.
struct Reference {
    name: String,
    class: String,
    words: Vec<u64>,
}

/// One column: where its numbers are.
struct Column {
    name: String,
    /// How many values it has.
    rows: usize,
    content: Content,
}

enum Content {
    /// A column of an array, whose numbers are of this type and at this place within the variable.
    Numbers { variable: Variable, kind: u32, numbers: Range<usize>, column: usize, is_single: bool },
    /// A column of a table; arrays are places within the unpacked subsystem.
    OfTable(TableColumn<Range<usize>>),
    /// It was read before.
    Unpacked,
}

impl File<'_> {
    /// Lists the columns of one variable.
    fn list(&mut self, element: Element, variable: &Variable) -> Result<()> {
        let mut found = Found { order: self.order, arrays: Vec::new(), opaque: Vec::new() };
        if !variable.is_packed {
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
                let whole = self.unpack(&variable.place)?;
                let inside = whole.get(tag.bytes..).unwrap_or_default();
                found.collect(inside, tag.bytes, inside.len(), Path::Top, 0)?;
            }
        }
        self.opaque.extend(found.opaque);
        for array in found.arrays {
            for column in 0..array.across {
                let name = match array.across {
                    1 => array.name.clone(),
                    _ => format!("{}(:,{})", array.name, column + 1),
                };
                let content = Content::Numbers {
                    variable: variable.clone(),
                    kind: array.kind,
                    numbers: array.numbers.clone(),
                    column,
                    is_single: array.is_single,
                };
                self.push(Column { name, rows: array.rows, content })?;
            }
        }
        Ok(())
    }

    fn push(&mut self, column: Column) -> Result<()> {
        self.budget.take((size_of::<Column>() + column.name.len()) as u64)?;
        self.columns.push(column);
        Ok(())
    }

    /// Lists the columns of all tables; returns the objects that can't be read.
    fn list_objects(&mut self) -> Result<Vec<Unread>> {
        let opaque = std::mem::take(&mut self.opaque);
        let mut objects = None;
        if !opaque.is_empty()
            && let Some(wrapper) = self.wrapper()?
        {
            objects = Objects::of(self, &wrapper)?;
        }
        let mut unread = Vec::new();
        for Reference { name, class, words } in opaque {
            let columns = match &objects {
                Some(objects) => matlab_table::columns(self, objects, &name, &words)?,
                None => None,
            };
            let Some(columns) = columns else {
                unread.push(Unread { name, class });
                continue;
            };
            for column in columns {
                let (name, rows) = (column.name.clone(), column.rows);
                self.push(Column { name, rows, content: Content::OfTable(column) })?;
            }
        }
        Ok(unread)
    }

    /// Where the properties of all objects are: the subsystem is an array of bytes which is a file of its own, with one
    /// struct.
    fn wrapper(&mut self) -> Result<Option<Range<usize>>> {
        let order = self.order;
        let whole = self.subsystem()?;
        let Ok(head) = Head::of(whole, order) else { return Ok(None) };
        let (bytes, _) = split_element(head.content, order)?;
        let Some(inner) = bytes.data.get(SUBSYSTEM_HEADER_BYTES..) else { return Ok(None) };
        let (element, _) = split_element(inner, order)?;
        let start = offset_in(whole, element.data);
        let place = start..start + element.data.len();
        let Kind::Fields(fields) = self.kind(&place)? else { return Ok(None) };
        Ok(fields.into_iter().find(|(name, _)| name == "MCOS").map(|(_, place)| place))
    }

    /// The array of the subsystem.
    fn subsystem(&mut self) -> Result<&[u8]> {
        let Some(Variable { place, is_packed }) = self.subsystem.clone() else { return Ok(&[]) };
        if !is_packed {
            return Ok(self.body.get(place).unwrap_or_default());
        }
        let order = self.order;
        let whole = self.unpack(&place)?;
        Ok(split_element(whole, order)?.0.data)
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
        let Some(column) = self.columns.get_mut(index) else { return Ok(Cells::Single(Vec::new())) };
        let rows = column.rows;
        // A column is unpacked once.
        let content = std::mem::replace(&mut column.content, Content::Unpacked);
        match content {
            Content::Numbers { variable, kind, numbers: place, column, is_single } => {
                let order = self.order;
                let size = size_of_number(kind).ok_or_else(damaged)?;
                let from = place.start + column * rows * size;
                self.budget.take((rows * if is_single { 4 } else { 8 }) as u64)?;
                let whole = if variable.is_packed {
                    self.unpack(&variable.place)?
                } else {
                    self.body.get(variable.place).unwrap_or_default()
                };
                let data = whole.get(from..from + rows * size).ok_or_else(damaged)?;
                numbers(kind, data, order, is_single).ok_or_else(damaged)
            }
            Content::OfTable(column) => column.cells(self),
            Content::Unpacked => Ok(Cells::Single(Vec::new())),
        }
    }
}

/// Arrays of the subsystem, by their place in it.
impl Arrays for File<'_> {
    type Array = Range<usize>;

    fn budget(&self) -> &Budget {
        &self.budget
    }

    fn kind(&mut self, array: &Range<usize>) -> Result<Kind<Range<usize>>> {
        let (order, budget) = (self.order, self.budget.clone());
        let whole = self.subsystem()?;
        let place = |part: &[u8]| {
            let start = offset_in(whole, part);
            start..start + part.len()
        };
        let mut data = whole.get(array.clone()).ok_or_else(damaged)?;
        for _ in 0..DEPTH_MAX {
            if data.is_empty() || class_of(data, order)?.0 != class::OPAQUE {
                break;
            }
            data = split_element(Opaque::of(data, order)?.content, order)?.0.data;
        }
        if data.is_empty() || class_of(data, order)?.0 > class::UINT64 {
            return Ok(Kind::Other);
        }
        let head = Head::of(data, order)?;
        match (head.class, head.shape()) {
            (class::CELL, _) => {
                let (mut cells, mut rest) = (Vec::new(), head.content);
                for _ in 0..head.count {
                    let (cell, behind) = split_element(rest, order)?;
                    budget.push(&mut cells, place(cell.data))?;
                    rest = behind;
                }
                Ok(Kind::Cells(cells))
            }
            (class::STRUCT, Some((1, 1))) => {
                let (names, mut rest) = field_names(head.content, order)?;
                let mut fields = Vec::new();
                for name in names {
                    let (field, behind) = split_element(rest, order)?;
                    fields.push((name, place(field.data)));
                    rest = behind;
                }
                Ok(Kind::Fields(fields))
            }
            (class::CHAR, Some((1, _))) => Ok(Kind::Text(text(split_element(head.content, order)?.0, order))),
            (class::CHAR, None) => Ok(Kind::Text(String::new())),
            (class::DOUBLE..=class::UINT64, Some((rows, across))) => {
                Ok(Kind::Numbers { rows, across, is_complex: head.is_complex })
            }
            _ => Ok(Kind::Other),
        }
    }

    fn column(&mut self, array: &Range<usize>, column: usize) -> Result<Cells> {
        let (order, budget) = (self.order, self.budget.clone());
        let data = self.subsystem()?.get(array.clone()).ok_or_else(damaged)?;
        let head = Head::of(data, order)?;
        let (rows, _) = head.shape().ok_or_else(damaged)?;
        let (element, _) = split_element(head.content, order)?;
        let size = size_of_number(element.kind).ok_or_else(damaged)?;
        let length = rows.checked_mul(size).ok_or_else(damaged)?;
        let from = length.checked_mul(column).ok_or_else(damaged)?;
        let data = element.data.get(from..).and_then(|data| data.get(..length)).ok_or_else(damaged)?;
        budget.take(rows as u64 * 8)?;
        numbers(element.kind, data, order, head.class == class::SINGLE).ok_or_else(damaged)
    }

    fn whole_numbers(&mut self, array: &Range<usize>) -> Result<Vec<u64>> {
        let (order, budget) = (self.order, self.budget.clone());
        let data = self.subsystem()?.get(array.clone()).ok_or_else(damaged)?;
        let (element, _) = split_element(Head::of(data, order)?.content, order)?;
        budget.take(element.data.len() as u64 * 8)?;
        Ok(whole_numbers(element.kind, element.data, order).unwrap_or_default())
    }
}

/// Where an array stands: its own name counts at the top only.
enum Path {
    Top,
    Field(String),
}

impl Path {
    fn name(self, own: &[u8]) -> String {
        match self {
            Self::Top => String::from_utf8_lossy(own).into_owned(),
            Self::Field(name) => name,
        }
    }
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
    opaque: Vec<Reference>,
}

impl Found {
    fn is_struct(data: &[u8], order: Order) -> bool {
        class_of(data, order).is_ok_and(|(class, _, _)| class == class::STRUCT)
    }

    /// Adds an array, and those within it. `data` begins `at` bytes into the variable and may be cut off behind the tag of
    /// the numbers; `whole` is its size.
    fn collect(&mut self, data: &[u8], at: usize, whole: usize, path: Path, depth: usize) -> Result<()> {
        let order = self.order;
        // An empty array within a struct has no content at all.
        if data.is_empty() || depth > DEPTH_MAX || self.arrays.len() > COLUMNS_MAX {
            return Ok(());
        }
        let (class, _, _) = class_of(data, order)?;
        if class == class::OPAQUE {
            return self.object(data, path);
        }
        if class > class::UINT64 {
            return Ok(());
        }
        let head = Head::of(data, order)?;
        let name = path.name(head.name);
        let behind = at + offset_in(data, head.content);
        match class {
            class::STRUCT if head.count <= ACROSS_MAX => {
                self.fields(head.content, behind, &name, head.count, depth)
            }
            class::DOUBLE..=class::UINT64 if !head.is_complex => {
                let tag = Tag::of(head.content, order)?;
                let from = behind + tag.bytes;
                let size = size_of_number(tag.kind).ok_or_else(damaged)?;
                if from + tag.size > at + whole || head.count.checked_mul(size) != Some(tag.size) {
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
                let longer = head.dimensions.iter().filter(|d| **d > 1).count();
                match (longer, head.dimensions.as_slice()) {
                    (1, _) => self.arrays.push(array(head.count, 1)),
                    (2, [rows, across]) if *across <= ACROSS_MAX => self.arrays.push(array(*rows, *across)),
                    _ => {}
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Adds an object: what it holds stands elsewhere.
    fn object(&mut self, data: &[u8], path: Path) -> Result<()> {
        let opaque = Opaque::of(data, self.order)?;
        if opaque.system != "MCOS" {
            return Ok(());
        }
        let name = path.name(opaque.name.as_bytes());
        let words = split_element(opaque.content, self.order).and_then(|(array, _)| {
            let (words, _) = split_element(Head::of(array.data, self.order)?.content, self.order)?;
            Ok(whole_numbers(words.kind, words.data, self.order).unwrap_or_default())
        });
        self.opaque.push(Reference { name, class: opaque.class, words: words.unwrap_or_default() });
        Ok(())
    }

    fn fields(&mut self, data: &[u8], at: usize, name: &str, count: usize, depth: usize) -> Result<()> {
        let order = self.order;
        let (names, mut rest) = field_names(data, order)?;
        for (index, label) in labels(&names, rest, count, order)?.into_iter().enumerate() {
            for field in &names {
                let (element, behind) = split_element(rest, order)?;
                if element.kind != element::MATRIX {
                    return Err(damaged());
                }
                let place = if count == 1 { String::new() } else { format!("({})", index + 1) };
                let path = Path::Field(match &label {
                    Some(label) if is_of_label(field) => format!("{name}.{label}"),
                    _ => format!("{name}{place}.{field}"),
                });
                let from = at + offset_in(data, element.data);
                self.collect(element.data, from, element.data.len(), path, depth + 1)?;
                rest = behind;
            }
        }
        Ok(())
    }
}
