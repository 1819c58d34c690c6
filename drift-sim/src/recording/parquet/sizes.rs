//! What a Parquet file asks for, before the library allocates it: a small file can claim lists of a billion entries and
//! pages that unpack to gigabytes.
//!
//! Footer and page headers are Thrift structs in the compact protocol; they are walked here without being kept.

use ::parquet::file::metadata::ColumnChunkMetaData;
use ::parquet::file::reader::ChunkReader;

use super::file::HEADER_BYTES;
use super::refused;
use crate::recording::budget::Budget;
use crate::{Error, Result};

/// What the library makes of one entry of a list in the footer, bytes at most.
const ENTRY_BYTES: u64 = 1 << 10;
/// What it makes of one value of a page while it unpacks it: the value, its place, its level.
const VALUE_BYTES: u64 = 32;
/// Structs in structs, at most.
const DEPTH_MAX: usize = 64;
/// The length of the footer and the magic number at the end of a file.
const TAIL_BYTES: u64 = 8;

fn damaged() -> Error {
    Error::new("the Parquet file is cut off or damaged")
}

/// Refuses a footer whose lists are longer than the footer itself, or that takes more than the budget.
pub(super) fn check_footer(file: &impl ChunkReader, budget: &Budget) -> Result<()> {
    let tail_at = file.len().checked_sub(TAIL_BYTES).ok_or_else(damaged)?;
    let tail = file.get_bytes(tail_at, TAIL_BYTES as usize).map_err(refused)?;
    let length = tail.get(..4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes).ok_or_else(damaged)?;
    let from = tail_at.checked_sub(u64::from(length)).ok_or_else(damaged)?;
    budget.take(u64::from(length))?;
    let bytes = file.get_bytes(from, length as usize).map_err(refused)?;
    let mut walk = Walk { bytes: &bytes, at: 0, entries: 0 };
    walk.fields(0, &mut |_, _| {})?;
    budget.take(walk.entries * ENTRY_BYTES)
}

/// Takes what unpacking the largest page of a column's chunk needs; the caller gives it back.
pub(super) fn check_chunk(
    file: &impl ChunkReader,
    chunk: &ColumnChunkMetaData,
    budget: &Budget,
) -> Result<u64> {
    let (dictionary, data) = (chunk.dictionary_page_offset(), chunk.data_page_offset());
    let start = dictionary.filter(|at| *at > 0).map_or(data, |at| at.min(data));
    let (start, length) = (u64::try_from(start), u64::try_from(chunk.compressed_size()));
    let (Ok(start), Ok(length)) = (start, length) else { return Err(damaged()) };
    let end = start.checked_add(length).filter(|end| *end <= file.len()).ok_or_else(damaged)?;
    let (mut at, mut most) = (start, 0);
    while at < end {
        let page = page(file, at, end, budget)?;
        most = most.max(page.needs_bytes);
        at = page.end;
    }
    // A dictionary stays while the pages that use it are read.
    let most = most.saturating_mul(2);
    budget.take(most)?;
    Ok(most)
}

/// What the header of a page says.
struct Page {
    needs_bytes: u64,
    end: u64,
}

/// The page at a place; its header is read on until it is whole.
fn page(file: &impl ChunkReader, at: u64, end: u64, budget: &Budget) -> Result<Page> {
    let mut length = HEADER_BYTES as u64;
    loop {
        length = length.min(end - at);
        budget.take(length)?;
        let bytes = file.get_bytes(at, length as usize).map_err(refused);
        let page = bytes.and_then(|bytes| page_of(&bytes, at));
        budget.give_back(length);
        if page.is_ok() || length == end - at {
            return page;
        }
        length = length.saturating_mul(16);
    }
}

fn page_of(bytes: &[u8], at: u64) -> Result<Page> {
    let mut walk = Walk { bytes, at: 0, entries: 0 };
    let (mut unpacked, mut packed, mut values) = (0_i64, 0_i64, 0_i64);
    walk.fields(0, &mut |path, number| match path {
        [2] => unpacked = number,
        [3] => packed = number,
        // The number of values of a data page, a dictionary page, a data page of the second version.
        [5 | 7 | 8, 1] => values = number,
        _ => {}
    })?;
    let [unpacked, packed, values] = [unpacked, packed, values].map(u64::try_from);
    let (Ok(unpacked), Ok(packed), Ok(values)) = (unpacked, packed, values) else {
        return Err(damaged());
    };
    let needs_bytes = unpacked.saturating_add(packed).saturating_add(values.saturating_mul(VALUE_BYTES));
    let end = at.checked_add(walk.at as u64).and_then(|at| at.checked_add(packed)).ok_or_else(damaged)?;
    Ok(Page { needs_bytes, end })
}

/// A walk over a struct.
struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Entries of lists so far.
    entries: u64,
}

impl Walk<'_> {
    fn byte(&mut self) -> Result<u8> {
        let byte = self.bytes.get(self.at).copied().ok_or_else(damaged)?;
        self.at += 1;
        Ok(byte)
    }

    fn skip(&mut self, count: u64) -> Result<()> {
        let left = (self.bytes.len() - self.at) as u64;
        if count > left {
            return Err(damaged());
        }
        self.at += count as usize;
        Ok(())
    }

    fn varint(&mut self) -> Result<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(damaged())
    }

    fn number(&mut self) -> Result<i64> {
        let value = self.varint()?;
        Ok((value >> 1).cast_signed() ^ -(value & 1).cast_signed())
    }

    /// Walks the fields of a struct; whole numbers in it, and in structs within it, are told with the path of their ids.
    fn fields(&mut self, depth: usize, tell: &mut dyn FnMut(&[i64], i64)) -> Result<()> {
        self.fields_at(&mut Vec::new(), depth, tell)
    }

    fn fields_at(
        &mut self,
        path: &mut Vec<i64>,
        depth: usize,
        tell: &mut dyn FnMut(&[i64], i64),
    ) -> Result<()> {
        if depth > DEPTH_MAX {
            return Err(damaged());
        }
        let mut id = 0;
        loop {
            let header = self.byte()?;
            if header == 0 {
                return Ok(());
            }
            id = match header >> 4 {
                0 => self.number()?,
                step => i64::from(step) + id,
            };
            path.push(id);
            self.value(header & 0xf, path, depth, tell, false)?;
            path.pop();
        }
    }

    fn value(
        &mut self,
        kind: u8,
        path: &mut Vec<i64>,
        depth: usize,
        tell: &mut dyn FnMut(&[i64], i64),
        in_list: bool,
    ) -> Result<()> {
        if depth > DEPTH_MAX {
            return Err(damaged());
        }
        match kind {
            // True and false: in a list a byte, in a struct the kind itself.
            1 | 2 if in_list => self.skip(1),
            1 | 2 => Ok(()),
            3 => self.skip(1),
            4..=6 => {
                let number = self.number()?;
                tell(path, number);
                Ok(())
            }
            7 => self.skip(8),
            8 => {
                let length = self.varint()?;
                self.skip(length)
            }
            9 | 10 => self.list(path, depth, tell),
            11 => self.map(path, depth, tell),
            12 => self.fields_at(path, depth + 1, tell),
            13 => self.skip(16),
            _ => Err(damaged()),
        }
    }

    /// Every entry takes a byte at least.
    fn count(&mut self, count: u64) -> Result<u64> {
        if count > (self.bytes.len() - self.at) as u64 {
            return Err(damaged());
        }
        self.entries += count;
        Ok(count)
    }

    fn list(&mut self, path: &mut Vec<i64>, depth: usize, tell: &mut dyn FnMut(&[i64], i64)) -> Result<()> {
        let header = self.byte()?;
        let length = if header >> 4 == 15 { self.varint()? } else { u64::from(header >> 4) };
        for _ in 0..self.count(length)? {
            self.value(header & 0xf, path, depth + 1, tell, true)?;
        }
        Ok(())
    }

    fn map(&mut self, path: &mut Vec<i64>, depth: usize, tell: &mut dyn FnMut(&[i64], i64)) -> Result<()> {
        let length = self.varint()?;
        if length == 0 {
            return Ok(());
        }
        let kinds = self.byte()?;
        for _ in 0..self.count(length)? {
            self.value(kinds >> 4, path, depth + 1, tell, true)?;
            self.value(kinds & 0xf, path, depth + 1, tell, true)?;
        }
        Ok(())
    }
}
