//! MATLAB files of version 4 ("Level 4 MAT-File Format", MathWorks): full numeric matrices by name, as old data loggers and
//! `save -v4` write them. A vector is a column, a matrix one for each of its own (`data(:,2)`).

use super::ReadOptions;
use super::budget::Budget;
use super::format::Source;
use super::table::{Cells, Table, TableRows};
use crate::{Error, Result};

const HEADER_BYTES: usize = 20;
/// Letters of a name, its end counted; MATLAB's own limit is 63.
const NAME_BYTES_MAX: usize = 256;
/// Columns of a matrix that become columns.
const ACROSS_MAX: usize = 256;

/// What stands before each matrix.
#[derive(Clone, Copy)]
struct Header {
    big_endian: bool,
    /// Which type its numbers have: `P` of the format.
    precision: u32,
    /// 0 for numbers, 1 for text, 2 for a sparse matrix.
    kind: u32,
    rows: usize,
    columns: usize,
    is_complex: bool,
    name_bytes: usize,
}

impl Header {
    fn of(bytes: &[u8]) -> Option<Self> {
        // The type is a number of four decimal digits M O P T; M is 1 on machines that write the high byte first.
        let little = Self::read(bytes, u32::from_le_bytes).filter(|header| !header.big_endian);
        little.or_else(|| Self::read(bytes, u32::from_be_bytes).filter(|header| header.big_endian))
    }

    fn read(bytes: &[u8], number: fn([u8; 4]) -> u32) -> Option<Self> {
        let field = |i: usize| bytes.get(4 * i..4 * i + 4)?.try_into().ok().map(number);
        let (kind, is_complex) = (field(0)?, field(3)?);
        let [rows, columns, name_bytes] = [field(1)?, field(2)?, field(4)?].map(|x| x as usize);
        let (machine, zero, precision, kind) = (kind / 1000, kind / 100 % 10, kind / 10 % 10, kind % 10);
        let is_sound = machine < 2
            && zero == 0
            && precision < 6
            && kind < 3
            && is_complex < 2
            && (1..=NAME_BYTES_MAX).contains(&name_bytes)
            && rows <= i32::MAX as usize
            && columns <= i32::MAX as usize;
        is_sound.then_some(Self {
            big_endian: machine == 1,
            precision,
            kind,
            rows,
            columns,
            is_complex: is_complex == 1,
            name_bytes,
        })
    }

    fn number_bytes(self) -> usize {
        [8, 4, 4, 2, 2, 1].get(self.precision as usize).copied().unwrap_or(8)
    }
}

/// Whether a file begins like one: a sound header, then a name that ends in a zero byte.
pub(super) fn is_version_4(start: &[u8]) -> bool {
    let Some(header) = Header::of(start) else { return false };
    let name = start.get(HEADER_BYTES..HEADER_BYTES + header.name_bytes);
    name.and_then(<[u8]>::split_last).is_some_and(|(end, name)| {
        let is_letter = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
        *end == 0 && !name.is_empty() && name.iter().all(is_letter)
    })
}

fn damaged() -> Error {
    Error::new("the MATLAB file (version 4) is cut off or damaged").allowed("a whole file")
}

/// The rows of a file that begins like one.
///
/// # Errors
/// The file is damaged, holds no numbers, or takes more memory than is allowed.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<TableRows> {
    let budget = source.budget.clone();
    let bytes = source.bytes()?;
    let mut columns = Vec::new();
    let mut rest = bytes.as_slice();
    while !rest.is_empty() {
        let header = Header::of(rest).ok_or_else(damaged)?;
        let name = rest.get(HEADER_BYTES..HEADER_BYTES + header.name_bytes - 1).ok_or_else(damaged)?;
        let count = header.rows.checked_mul(header.columns).ok_or_else(damaged)?;
        let size = count.checked_mul(header.number_bytes()).ok_or_else(damaged)?;
        let whole = if header.is_complex { size.checked_mul(2).ok_or_else(damaged)? } else { size };
        let data = rest.get(HEADER_BYTES + header.name_bytes..).ok_or_else(damaged)?;
        let (all, behind) = data.split_at_checked(whole).ok_or_else(damaged)?;
        if header.kind == 0 && !header.is_complex {
            list(&String::from_utf8_lossy(name), header, all, &mut columns, &budget)?;
        }
        rest = behind;
    }
    if columns.is_empty() {
        return Err(
            Error::new("the MATLAB file (version 4) holds no numeric vectors").allowed("r, y, u as vectors")
        );
    }
    TableRows::new(Columns { columns, budget }, Vec::new(), options)
}

struct Columns<'a> {
    columns: Vec<Column<'a>>,
    budget: Budget,
}

struct Column<'a> {
    name: String,
    header: Header,
    rows: usize,
    data: &'a [u8],
}

fn list<'a>(
    name: &str,
    header: Header,
    data: &'a [u8],
    columns: &mut Vec<Column<'a>>,
    budget: &Budget,
) -> Result<()> {
    let across = match (header.rows, header.columns) {
        (1, 1) | (_, 0) | (0, _) => 0,
        (1, _) | (_, 1) => 1,
        (_, across) if across <= ACROSS_MAX => across,
        _ => 0,
    };
    let rows = if across == 1 { header.rows * header.columns } else { header.rows };
    for (i, data) in data.chunks_exact((rows * header.number_bytes()).max(1)).take(across).enumerate() {
        let name = if across == 1 { name.to_owned() } else { format!("{name}(:,{})", i + 1) };
        budget.take((size_of::<Column>() + name.len()) as u64)?;
        columns.push(Column { name, header, rows, data });
    }
    Ok(())
}

impl Table for Columns<'_> {
    fn names(&self) -> Vec<String> {
        self.columns.iter().map(|column| column.name.clone()).collect()
    }

    fn length(&self, index: usize) -> usize {
        self.columns.get(index).map_or(0, |column| column.rows)
    }

    fn cells(&mut self, index: usize) -> Result<Cells> {
        let Some(column) = self.columns.get(index) else { return Ok(Cells::Single(Vec::new())) };
        self.budget.take(column.rows as u64 * 8)?;
        let size = column.header.number_bytes();
        Ok(Cells::Double(column.data.chunks_exact(size).map(|bytes| number(column.header, bytes)).collect()))
    }
}

/// A stored number; its bytes are as many as its type has.
fn number(header: Header, bytes: &[u8]) -> f64 {
    let mut ordered = [0_u8; 8];
    for (to, from) in ordered.iter_mut().zip(bytes) {
        *to = *from;
    }
    if header.big_endian {
        ordered[..bytes.len().min(8)].reverse();
    }
    let [a, b, c, d, ..] = ordered;
    match header.precision {
        0 => f64::from_le_bytes(ordered),
        1 => f64::from(f32::from_le_bytes([a, b, c, d])),
        2 => f64::from(i32::from_le_bytes([a, b, c, d])),
        3 => f64::from(i16::from_le_bytes([a, b])),
        4 => f64::from(u16::from_le_bytes([a, b])),
        _ => f64::from(a),
    }
}
