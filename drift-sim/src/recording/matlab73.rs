//! MATLAB files of version 7.3, and other HDF5 files: numeric arrays by the path of their groups, `log.SP` for `/log/SP`.
//!
//! A vector is a column, a matrix one for each of its own (`data(:,2)`). MATLAB writes the columns of a matrix as rows; a
//! file that something else wrote, h5py say, has them as columns. Text, cells and objects (tables, timetables) are passed over.

use hdf5_reader::group::Group;
use hdf5_reader::{ByteOrder, Dataset, Datatype, Hdf5File, OpenOptions};

use super::ReadOptions;
use super::budget::Budget;
use super::contained::contained;
use super::format::Source;
use super::table::{Cells, Table, TableRows};
use crate::{Error, Result};

/// How such a file begins where MATLAB wrote it.
const MATLAB: &[u8] = b"MATLAB 7.3 MAT-file";
const DAMAGED: &str = "the HDF5 file is cut off or damaged";
/// Groups in groups, at most.
const DEPTH_MAX: usize = 16;
/// Columns of a matrix that become columns.
const ACROSS_MAX: u64 = 256;
/// Columns of one file, at most.
const COLUMNS_MAX: usize = 100_000;
/// What the library may keep of unpacked chunks.
const CACHE_BYTES: usize = 1 << 20;

fn refused(error: impl std::fmt::Display) -> Error {
    Error::new(format!("{DAMAGED}: {error}"))
}

/// The rows of a file that begins like one.
///
/// # Errors
/// The file is damaged, holds no numbers, or takes more memory than is allowed.
pub(super) fn open(source: Source, options: &ReadOptions) -> Result<TableRows> {
    let budget = source.budget.clone();
    let bytes = source.bytes()?;
    contained(DAMAGED, || {
        let is_matlab = bytes.starts_with(MATLAB);
        let most = usize::try_from(budget.left_bytes()).unwrap_or(usize::MAX);
        let limits = OpenOptions::default()
            .with_chunk_cache_bytes(CACHE_BYTES)
            .with_max_chunk_bytes(most)
            .with_max_read_bytes(most);
        let file = Hdf5File::from_vec_with_options(bytes, limits).map_err(refused)?;
        let mut arrays =
            Arrays { columns: Vec::new(), is_matlab, budget: budget.clone(), objects: Vec::new() };
        arrays.collect(&file.root_group().map_err(refused)?, "", 0)?;
        if let Some(name) = arrays.objects.first().filter(|_| arrays.columns.is_empty()) {
            return Err(Error::new(format!("'{name}' is a table, which MATLAB writes as an object"))
                .allowed(format!(
                    "in MATLAB: S = table2struct({name}, 'ToScalar', true); save('file.mat', 'S')"
                )));
        }
        if arrays.columns.is_empty() {
            return Err(Error::new("the HDF5 file holds no numeric vectors")
                .allowed("r, y, u as vectors, matrices or fields of a struct"));
        }
        TableRows::new(arrays, Vec::new(), options)
    })
}

struct Arrays {
    columns: Vec<Column>,
    is_matlab: bool,
    budget: Budget,
    /// Names of tables and timetables.
    objects: Vec<String>,
}

struct Column {
    name: String,
    dataset: Dataset,
    rows: usize,
    /// Its first number, and from one to the next.
    first: usize,
    step: usize,
}

impl Arrays {
    fn collect(&mut self, group: &Group, path: &str, depth: usize) -> Result<()> {
        if depth > DEPTH_MAX || self.columns.len() > COLUMNS_MAX {
            return Ok(());
        }
        let (groups, datasets) = group.members().map_err(refused)?;
        for dataset in datasets {
            let name = format!("{path}{}", dataset.name());
            self.list(&name, dataset)?;
        }
        // What MATLAB calls #refs# and #subsystem# belongs to objects.
        for group in groups.iter().filter(|group| !group.name().starts_with('#')) {
            self.collect(group, &format!("{path}{}.", group.name()), depth + 1)?;
        }
        Ok(())
    }

    fn list(&mut self, name: &str, dataset: Dataset) -> Result<()> {
        if dataset.attribute("MATLAB_object_decode").is_ok() {
            self.objects.push(name.to_owned());
            return Ok(());
        }
        let is_text = dataset.attribute("MATLAB_int_decode").is_ok();
        if is_text || size_of_number(dataset.dtype()).is_none() {
            return Ok(());
        }
        let shape = dataset.shape().to_vec();
        let (rows, across, by_rows) = match shape.as_slice() {
            [rows] => (*rows, 1, true),
            [1, rows] | [rows, 1] => (*rows, 1, true),
            [across, rows] if self.is_matlab => (*rows, *across, true),
            [rows, across] => (*rows, *across, false),
            _ => return Ok(()),
        };
        let (Ok(rows), true) = (usize::try_from(rows), rows > 1 && across <= ACROSS_MAX) else {
            return Ok(());
        };
        for column in 0..across as usize {
            let name = if across == 1 { name.to_owned() } else { format!("{name}(:,{})", column + 1) };
            self.budget.take((size_of::<Column>() + name.len()) as u64)?;
            let (first, step) = if by_rows { (column * rows, 1) } else { (column, across as usize) };
            self.columns.push(Column { name, dataset: dataset.clone(), rows, first, step });
        }
        Ok(())
    }
}

impl Table for Arrays {
    fn names(&self) -> Vec<String> {
        self.columns.iter().map(|column| column.name.clone()).collect()
    }

    fn length(&self, index: usize) -> usize {
        self.columns.get(index).map_or(0, |column| column.rows)
    }

    fn cells(&mut self, index: usize) -> Result<Cells> {
        let Some(column) = self.columns.get(index) else { return Ok(Cells::Single(Vec::new())) };
        let length = column.dataset.raw_byte_len().map_err(refused)?;
        self.budget.take(length as u64)?;
        self.budget.take(column.rows as u64 * 8)?;
        let bytes = column.dataset.read_raw_bytes().map_err(refused)?;
        let kind = column.dataset.dtype();
        let size = size_of_number(kind).ok_or_else(|| Error::new(DAMAGED))?;
        let value = |row: usize| {
            let from = (column.first + row * column.step) * size;
            bytes.get(from..from + size).and_then(|bytes| number(kind, bytes))
        };
        let values = (0..column.rows).map(value).collect::<Option<Vec<f64>>>();
        self.budget.give_back(length as u64);
        values.map(Cells::Double).ok_or_else(|| Error::new(DAMAGED))
    }
}

/// Bytes of a stored number; `None` for what is none.
fn size_of_number(kind: &Datatype) -> Option<usize> {
    match kind {
        Datatype::FixedPoint { size: size @ (1 | 2 | 4 | 8), .. }
        | Datatype::FloatingPoint { size: size @ (4 | 8), .. } => Some(usize::from(*size)),
        // h5py writes flags so.
        Datatype::Enum { base, .. } => size_of_number(base),
        _ => None,
    }
}

fn number(kind: &Datatype, bytes: &[u8]) -> Option<f64> {
    let little = |order: &ByteOrder| {
        let mut ordered = bytes.to_vec();
        if matches!(order, ByteOrder::BigEndian) {
            ordered.reverse();
        }
        ordered
    };
    match kind {
        Datatype::FloatingPoint { size: 4, byte_order } => {
            Some(f64::from(f32::from_le_bytes(little(byte_order).try_into().ok()?)))
        }
        Datatype::FloatingPoint { size: 8, byte_order } => {
            Some(f64::from_le_bytes(little(byte_order).try_into().ok()?))
        }
        Datatype::FixedPoint { signed, byte_order, .. } => {
            let mut wide = little(byte_order);
            let is_negative = *signed && wide.last().is_some_and(|b| b & 0x80 != 0);
            wide.resize(8, if is_negative { 0xff } else { 0 });
            let value = u64::from_le_bytes(wide.try_into().ok()?);
            Some(if *signed { value.cast_signed() as f64 } else { value as f64 })
        }
        Datatype::Enum { base, .. } => number(base, bytes),
        _ => None,
    }
}
