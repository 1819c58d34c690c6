//! The formats of recordings, told apart by how a file begins and not by its name.

use std::fs::File;
use std::io::{Cursor, Read};

use super::budget::Budget;
use super::row::Rows;
use super::{ReadOptions, csv, gzip, json_lines, klippy, matlab, matlab4, ulog};
use crate::{Error, Result};

/// What is read, for people.
pub(super) const ALL: &str = "CSV, JSON lines, klippy.log, MATLAB .mat, Parquet, PX4 .ulg, Betaflight .bbl, ROS 2 .mcap; any of them in gzip";

/// Bytes that tell every format.
const START_BYTES: usize = 1 << 15;
/// Packed files in packed files, at most.
const PACKED_MAX: usize = 3;

/// Where a recording is read from.
pub(super) struct Source {
    pub reader: Box<dyn Read + Send>,
    /// The same as a file, for formats of which only parts are read; `None` for a pipe and within a packed file.
    pub file: Option<File>,
    /// What reading it may take.
    pub budget: Budget,
}

impl Source {
    /// All of it in memory.
    ///
    /// # Errors
    /// It can't be read, or is larger than the budget.
    pub fn bytes(self) -> Result<Vec<u8>> {
        if let Some(length) =
            self.file.as_ref().and_then(|file| file.metadata().ok()).map(|there| there.len())
        {
            // A file that can't fit is refused before it is read.
            self.budget.take(length)?;
            self.budget.give_back(length);
        }
        self.budget.read_to_end(self.reader)
    }
}

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Csv,
    JsonLines,
    Klippy,
    Gzip,
    Matlab,
    Matlab4,
    Ulog,
    Parquet,
    Hdf5,
    Blackbox,
    Mcap,
    /// Known, and not read: what it is, and what to do.
    Refused(&'static str, &'static str),
}

/// How files begin that can't be read here.
const REFUSED: [(&[u8], &str, &str); 4] = [
    (b"PK\x03\x04", "a spreadsheet (or another zip archive)", "save it as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet", "save it as CSV"),
    (b"\x28\xb5\x2f\xfd", "packed with zstd", "unpack it, or pack it with gzip"),
    (b"BZh", "packed with bzip2", "unpack it, or pack it with gzip"),
];

fn recognise(start: &[u8]) -> Format {
    if start.starts_with(gzip::MAGIC) {
        return Format::Gzip;
    }
    if start.starts_with(ulog::MAGIC) {
        return Format::Ulog;
    }
    if start.starts_with(b"PAR1") {
        return Format::Parquet;
    }
    if matlab::is_version_5(start) {
        return Format::Matlab;
    }
    if matlab4::is_version_4(start) {
        return Format::Matlab4;
    }
    if is_hdf5(start) {
        return Format::Hdf5;
    }
    if start.starts_with(b"H Product:Blackbox") {
        return Format::Blackbox;
    }
    if start.starts_with(b"\x89MCAP0\r\n") {
        return Format::Mcap;
    }
    match REFUSED.into_iter().find(|(magic, _, _)| start.starts_with(magic)) {
        Some((_, what, instead)) => Format::Refused(what, instead),
        None if json_lines::is_json_lines(start) => Format::JsonLines,
        None if klippy::is_klippy_log(start) => Format::Klippy,
        None => Format::Csv,
    }
}

/// A reader that is a feature of the build: it, or what to build where it is left out.
macro_rules! feature {
    ($name:ident, $feature:literal, $what:literal) => {
        #[cfg(feature = $feature)]
        fn $name(source: Source, options: &ReadOptions) -> Result<Box<dyn Rows>> {
            Ok(Box::new(super::$name::open(source, options)?))
        }

        #[cfg(not(feature = $feature))]
        fn $name(_: Source, _: &ReadOptions) -> Result<Box<dyn Rows>> {
            Err(Error::new(concat!("this is ", $what, ", which this build of drift does not read"))
                .allowed(concat!("a build with --features ", $feature, " (or all-formats)")))
        }
    };
}

feature!(parquet, "parquet", "a Parquet file");
feature!(matlab73, "matlab73", "HDF5 (MATLAB's -v7.3 is)");
feature!(blackbox, "blackbox", "a Betaflight blackbox");
feature!(mcap, "mcap", "a ROS 2 bag (mcap)");

/// HDF5 begins with its signature at 0, 512, 1024 ... bytes; MATLAB's header before it is 512 long.
fn is_hdf5(start: &[u8]) -> bool {
    [0, 512].into_iter().any(|at| start.get(at..).is_some_and(|s| s.starts_with(b"\x89HDF\r\n\x1a\n")))
}

/// The rows of a recording in any format.
///
/// # Errors
/// The source can't be read, is in no format that is read here, or lacks a column.
pub(super) fn open(mut source: Source, options: &ReadOptions) -> Result<(Box<dyn Rows>, &'static str)> {
    for _ in 0..=PACKED_MAX {
        let mut start = Vec::with_capacity(START_BYTES);
        source
            .reader
            .by_ref()
            .take(START_BYTES as u64)
            .read_to_end(&mut start)
            .map_err(|e| Error::new(format!("can't be read: {e}")))?;
        let format = recognise(&start);
        source.reader = Box::new(Cursor::new(start).chain(source.reader));
        match format {
            Format::Gzip => {
                source.reader = gzip::unpacked(source.reader);
                source.file = None;
            }
            Format::Csv => return Ok((csv::open(source, options)?, "CSV")),
            Format::JsonLines => return json_lines::open(source, options),
            Format::Klippy => return Ok((Box::new(klippy::open(source.reader, options)?), "klippy.log")),
            Format::Matlab => return Ok((Box::new(matlab::open(source, options)?), "MATLAB")),
            Format::Matlab4 => return Ok((Box::new(matlab4::open(source, options)?), "MATLAB, version 4")),
            Format::Ulog => return Ok((Box::new(ulog::open(source, options)?), "PX4 ULog")),
            Format::Parquet => return Ok((parquet(source, options)?, "Parquet")),
            Format::Hdf5 => return Ok((matlab73(source, options)?, "HDF5 (MATLAB 7.3)")),
            Format::Blackbox => return Ok((blackbox(source, options)?, "Betaflight blackbox")),
            Format::Mcap => return Ok((mcap(source, options)?, "ROS 2 bag (mcap)")),
            Format::Refused(what, instead) => {
                return Err(Error::new(format!("this is {what}")).allowed(instead));
            }
        }
    }
    Err(Error::new("packed again and again").allowed("gzip once"))
}
