//! The formats of recordings, told apart by how a file begins and not by its name.

use std::io::{Cursor, Read};

use super::row::Rows;
use super::{ReadOptions, csv, gzip, matlab, ulog};
use crate::{Error, Result};

/// Bytes that tell every format.
const START_BYTES: usize = 1024;
/// Packed files in packed files, at most.
const PACKED_MAX: usize = 3;

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Csv,
    Gzip,
    Matlab,
    Ulog,
    Parquet,
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
    if is_hdf5(start) {
        return Format::Refused(
            "HDF5, which MATLAB's -v7.3 writes too",
            "in MATLAB: save('file.mat', 'r', 'y', 'u', '-v7')",
        );
    }
    match REFUSED.into_iter().find(|(magic, _, _)| start.starts_with(magic)) {
        Some((_, what, instead)) => Format::Refused(what, instead),
        None => Format::Csv,
    }
}

#[cfg(feature = "parquet")]
fn parquet(source: Box<dyn Read + Send>, options: &ReadOptions) -> Result<Box<dyn Rows>> {
    Ok(Box::new(super::parquet::open(source, options)?))
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: Box<dyn Read + Send>, _: &ReadOptions) -> Result<Box<dyn Rows>> {
    Err(Error::new("this is a Parquet file, which this build of drift does not read")
        .allowed("a build with --features parquet (or all-formats)"))
}

/// HDF5 begins with its signature at 0, 512, 1024 ... bytes; MATLAB's header before it is 512 long.
fn is_hdf5(start: &[u8]) -> bool {
    [0, 512].into_iter().any(|at| start.get(at..).is_some_and(|s| s.starts_with(b"\x89HDF\r\n\x1a\n")))
}

/// The rows of a recording in any format.
///
/// # Errors
/// The source can't be read, is in no format that is read here, or lacks a column.
pub(super) fn open(mut source: Box<dyn Read + Send>, options: &ReadOptions) -> Result<Box<dyn Rows>> {
    for _ in 0..=PACKED_MAX {
        let mut start = Vec::with_capacity(START_BYTES);
        source
            .by_ref()
            .take(START_BYTES as u64)
            .read_to_end(&mut start)
            .map_err(|e| Error::new(format!("can't be read: {e}")))?;
        let format = recognise(&start);
        source = Box::new(Cursor::new(start).chain(source));
        match format {
            Format::Gzip => source = gzip::unpacked(source),
            Format::Csv => return Ok(Box::new(csv::open(source, options)?)),
            Format::Matlab => return Ok(Box::new(matlab::open(source, options)?)),
            Format::Ulog => return Ok(Box::new(ulog::open(source, options)?)),
            Format::Parquet => return parquet(source, options),
            Format::Refused(what, instead) => {
                return Err(Error::new(format!("this is {what}")).allowed(instead));
            }
        }
    }
    Err(Error::new("packed again and again").allowed("gzip once"))
}
