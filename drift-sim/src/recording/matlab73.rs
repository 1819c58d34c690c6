//! MATLAB files of version 7.3, and other HDF5 files: numeric arrays by the path of their groups, `log.SP` for `/log/SP`.
//!
//! A vector is a column, a matrix one for each of its own (`data(:,2)`), a table's variable `T.y`. MATLAB writes the columns of a
//! matrix as rows; a file that something else wrote, h5py say, has them as columns. Text, cells and other objects are passed over.

use std::collections::HashMap;

use hdf5_reader::group::Group;
use hdf5_reader::{ByteOrder, Dataset, Datatype, Hdf5File, OpenOptions};

use super::ReadOptions;
use super::budget::Budget;
use super::contained::contained;
use super::format::Source;
use super::matlab_objects::{Arrays, Kind, Objects};
use super::matlab_table::{self, TableColumn};
use super::matlab_unread::{Unread, told_or_refused};
use super::table::{Cells, Table, TableRows};
use crate::{Error, Result};

/// How such a file begins where MATLAB wrote it.
const MATLAB: &[u8] = b"MATLAB 7.3 MAT-file";
const DAMAGED: &str = "the HDF5 file is cut off or damaged";
/// Groups in groups, at most.
const DEPTH_MAX: usize = 16;
/// Columns of a matrix that become columns.
const ACROSS_MAX: usize = 256;
/// Columns of one file, at most.
const COLUMNS_MAX: usize = 100_000;
/// Groups of what objects refer to, and where their properties are.
const REFERRED: &str = "#refs#";
const WRAPPER: &str = "#subsystem#/MCOS";
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
        let root = file.root_group().map_err(refused)?;
        let mut found = File {
            columns: Vec::new(),
            is_matlab,
            budget: budget.clone(),
            opaque: Vec::new(),
            nodes: HashMap::new(),
        };
        found.collect(&root, "", 0)?;
        let unread = found.list_objects(&file, &root)?;
        let notes = told_or_refused(&unread, !found.columns.is_empty())?;
        if found.columns.is_empty() {
            return Err(Error::new("the HDF5 file holds no numeric vectors")
                .allowed("r, y, u as vectors, matrices or fields of a struct"));
        }
        TableRows::new(found, notes, options)
    })
}

struct File {
    columns: Vec<Column>,
    is_matlab: bool,
    budget: Budget,
    /// Variables that are objects.
    opaque: Vec<Opaque>,
    /// What references mean, by its address.
    nodes: HashMap<u64, Node>,
}

/// A variable that is an object.
struct Opaque {
    name: String,
    class: String,
    dataset: Dataset,
}

#[derive(Clone)]
enum Node {
    Group(Group),
    Dataset(Dataset),
}

struct Column {
    name: String,
    rows: usize,
    content: Content,
}

#[derive(Clone)]
enum Content {
    Numbers(Numbers),
    /// Arrays are their addresses.
    OfTable(std::rc::Rc<TableColumn<u64>>),
}

/// The numbers of a column within a dataset: the first, and from one to the next.
#[derive(Clone)]
struct Numbers {
    dataset: Dataset,
    rows: usize,
    first: usize,
    step: usize,
}

impl File {
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
            let class =
                dataset.attribute("MATLAB_class").and_then(|class| class.read_string()).unwrap_or_default();
            self.opaque.push(Opaque { name: name.to_owned(), class, dataset });
            return Ok(());
        }
        let is_text = dataset.attribute("MATLAB_int_decode").is_ok();
        let is_complex = matches!(dataset.dtype(), Datatype::Compound { .. });
        if is_text || is_complex || size_of_number(dataset.dtype()).is_none() {
            return Ok(());
        }
        let Some((rows, across)) = self.shape(&dataset).filter(|(rows, _)| *rows > 1) else { return Ok(()) };
        for column in 0..across {
            let name = if across == 1 { name.to_owned() } else { format!("{name}(:,{})", column + 1) };
            let content = Content::Numbers(self.numbers_of(&dataset, rows, across, column));
            self.push(Column { name, rows, content })?;
        }
        Ok(())
    }

    fn push(&mut self, column: Column) -> Result<()> {
        self.budget.take((size_of::<Column>() + column.name.len()) as u64)?;
        self.columns.push(column);
        Ok(())
    }

    /// Rows and columns of an array, of which a vector has one; `None` for what is no vector or matrix.
    fn shape(&self, dataset: &Dataset) -> Option<(usize, usize)> {
        let (rows, across) = match dataset.shape() {
            [rows] | [1, rows] | [rows, 1] => (*rows, 1),
            [across, rows] if self.is_matlab => (*rows, *across),
            [rows, across] => (*rows, *across),
            _ => return None,
        };
        Some((usize::try_from(rows).ok()?, usize::try_from(across).ok()?))
            .filter(|(rows, across)| *rows > 0 && (1..=ACROSS_MAX).contains(across))
    }

    fn numbers_of(&self, dataset: &Dataset, rows: usize, across: usize, column: usize) -> Numbers {
        let by_rows = across == 1 || self.is_matlab;
        let (first, step) = if by_rows { (column * rows, 1) } else { (column, across) };
        Numbers { dataset: dataset.clone(), rows, first, step }
    }

    /// Lists the columns of all tables; returns the objects that can't be read.
    fn list_objects(&mut self, file: &Hdf5File, root: &Group) -> Result<Vec<Unread>> {
        let opaque = std::mem::take(&mut self.opaque);
        let mut objects = None;
        if !opaque.is_empty()
            && let (Ok(wrapper), Ok(referred)) = (file.dataset(WRAPPER), root.group(REFERRED))
        {
            self.note_nodes(&referred)?;
            let address = wrapper.address();
            self.note(address, Node::Dataset(wrapper))?;
            objects = Objects::of(self, &address)?;
        }
        let mut unread = Vec::new();
        for Opaque { name, class, dataset } in opaque {
            let columns = match &objects {
                Some(objects) => {
                    let words = self.whole_numbers_of(&dataset)?;
                    matlab_table::columns(self, objects, &name, &words)?
                }
                None => None,
            };
            let Some(columns) = columns else {
                unread.push(Unread { name, class });
                continue;
            };
            for column in columns {
                let (name, rows) = (column.name.clone(), column.rows);
                self.push(Column { name, rows, content: Content::OfTable(column.into()) })?;
            }
        }
        Ok(unread)
    }

    /// Notes what stands in a group, by its addresses.
    fn note_nodes(&mut self, group: &Group) -> Result<()> {
        let (groups, datasets) = group.members().map_err(refused)?;
        for group in groups {
            self.note(group.address(), Node::Group(group))?;
        }
        for dataset in datasets {
            self.note(dataset.address(), Node::Dataset(dataset))?;
        }
        Ok(())
    }

    fn note(&mut self, address: u64, node: Node) -> Result<()> {
        self.budget.take(size_of::<Node>() as u64)?;
        self.nodes.insert(address, node);
        Ok(())
    }

    fn dataset(&self, address: u64) -> Result<&Dataset> {
        match self.nodes.get(&address) {
            Some(Node::Dataset(dataset)) => Ok(dataset),
            _ => Err(Error::new(DAMAGED)),
        }
    }

    /// The stored bytes of an array, off the budget until the caller gives them back.
    fn bytes(&self, dataset: &Dataset) -> Result<Vec<u8>> {
        self.budget.take(dataset.raw_byte_len().map_err(refused)? as u64)?;
        dataset.read_raw_bytes().map_err(refused)
    }

    fn numbers(&self, of: &Numbers) -> Result<Cells> {
        self.budget.take(of.rows as u64 * 8)?;
        let bytes = self.bytes(&of.dataset)?;
        let kind = of.dataset.dtype();
        let (size, stride) = size_of_number(kind).zip(stride(kind)).ok_or_else(|| Error::new(DAMAGED))?;
        let value = |row: usize| {
            let from = (of.first + row * of.step) * stride;
            bytes.get(from..from + size).and_then(|bytes| number(kind, bytes))
        };
        let values = (0..of.rows).map(value).collect::<Option<Vec<f64>>>();
        self.budget.give_back(bytes.len() as u64);
        values.map(Cells::Double).ok_or_else(|| Error::new(DAMAGED))
    }

    fn whole_numbers_of(&self, dataset: &Dataset) -> Result<Vec<u64>> {
        let Datatype::FixedPoint { size: size @ (1 | 2 | 4 | 8), signed: false, byte_order, .. } =
            dataset.dtype()
        else {
            return Ok(Vec::new());
        };
        let bytes = self.bytes(dataset)?;
        self.budget.take(bytes.len() as u64 * 8)?;
        let word = |bytes: &[u8]| {
            let add = |word, byte: &u8| (word << 8) | u64::from(*byte);
            match byte_order {
                ByteOrder::BigEndian => bytes.iter().fold(0, add),
                ByteOrder::LittleEndian => bytes.iter().rev().fold(0, add),
            }
        };
        Ok(bytes.chunks_exact(usize::from(*size)).map(word).collect())
    }
}

impl Table for File {
    fn names(&self) -> Vec<String> {
        self.columns.iter().map(|column| column.name.clone()).collect()
    }

    fn length(&self, index: usize) -> usize {
        self.columns.get(index).map_or(0, |column| column.rows)
    }

    fn cells(&mut self, index: usize) -> Result<Cells> {
        match self.columns.get(index).map(|column| column.content.clone()) {
            Some(Content::Numbers(numbers)) => self.numbers(&numbers),
            Some(Content::OfTable(column)) => column.cells(self),
            None => Ok(Cells::Single(Vec::new())),
        }
    }
}

/// What references mean, by its address.
impl Arrays for File {
    type Array = u64;

    fn budget(&self) -> &Budget {
        &self.budget
    }

    fn kind(&mut self, array: &u64) -> Result<Kind<u64>> {
        let dataset = match self.nodes.get(array).cloned() {
            None => return Ok(Kind::Other),
            Some(Node::Dataset(dataset)) => dataset,
            Some(Node::Group(group)) => return self.fields(&group),
        };
        if dataset.attribute("MATLAB_empty").is_ok() {
            return Ok(Kind::Other);
        }
        let class =
            dataset.attribute("MATLAB_class").and_then(|class| class.read_string()).unwrap_or_default();
        if class == "char" {
            let letters = self.whole_numbers_of(&dataset)?;
            let letters: Vec<u16> =
                letters.into_iter().filter_map(|letter| u16::try_from(letter).ok()).collect();
            return Ok(Kind::Text(String::from_utf16_lossy(&letters)));
        }
        if let Datatype::Reference { size: 8, .. } = dataset.dtype() {
            let bytes = self.bytes(&dataset)?;
            let address = |bytes: &[u8]| bytes.try_into().ok().map(u64::from_le_bytes);
            return Ok(Kind::Cells(bytes.chunks_exact(8).filter_map(address).collect()));
        }
        let is_complex = matches!(dataset.dtype(), Datatype::Compound { .. });
        match (self.shape(&dataset), size_of_number(dataset.dtype())) {
            (Some((rows, across)), Some(_)) => Ok(Kind::Numbers { rows, across, is_complex }),
            _ => Ok(Kind::Other),
        }
    }

    fn column(&mut self, array: &u64, column: usize) -> Result<Cells> {
        let dataset = self.dataset(*array)?;
        let (rows, across) = self.shape(dataset).ok_or_else(|| Error::new(DAMAGED))?;
        self.numbers(&self.numbers_of(dataset, rows, across, column))
    }

    fn whole_numbers(&mut self, array: &u64) -> Result<Vec<u64>> {
        self.whole_numbers_of(self.dataset(*array)?)
    }
}

impl File {
    /// The fields of a struct.
    fn fields(&mut self, group: &Group) -> Result<Kind<u64>> {
        let (groups, datasets) = group.members().map_err(refused)?;
        let groups = groups.into_iter().map(|group| (group.name().to_owned(), group.address()));
        let datasets = datasets.into_iter().map(|dataset| (dataset.name().to_owned(), dataset.address()));
        let fields = groups.chain(datasets).collect();
        self.note_nodes(group)?;
        Ok(Kind::Fields(fields))
    }
}

/// Bytes of a stored number; `None` for what is none.
fn size_of_number(kind: &Datatype) -> Option<usize> {
    match kind {
        Datatype::FixedPoint { size: size @ (1 | 2 | 4 | 8), .. }
        | Datatype::FloatingPoint { size: size @ (4 | 8), .. } => Some(usize::from(*size)),
        // h5py writes flags so.
        Datatype::Enum { base, .. } => size_of_number(base),
        // MATLAB's complex numbers: the real part comes first.
        Datatype::Compound { fields, .. } => match fields.as_slice() {
            [real, _] if real.name == "real" && real.byte_offset == 0 => size_of_number(&real.datatype),
            _ => None,
        },
        _ => None,
    }
}

/// Bytes from one number to the next.
fn stride(kind: &Datatype) -> Option<usize> {
    match kind {
        Datatype::Compound { size, .. } => usize::try_from(*size).ok(),
        _ => size_of_number(kind),
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
        Datatype::Compound { fields, .. } => number(&fields.first()?.datatype, bytes),
        _ => None,
    }
}
