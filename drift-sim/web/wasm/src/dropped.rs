//! A dropped file, read piece by piece: however large it is, only a piece of it is in memory.

use std::io::{BufReader, Read};

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

/// Bytes of a piece.
const PIECE: usize = 1 << 20;

#[wasm_bindgen]
extern "C" {
    /// The bytes of a dropped file from a place on, at most so many; none at its end.
    #[wasm_bindgen(js_name = driftPiece, catch)]
    fn piece(file: u32, from: f64, length: u32) -> Result<Vec<u8>, JsValue>;
}

/// Where reading stands.
pub struct Dropped {
    file: u32,
    at: u64,
}

impl Dropped {
    /// From its beginning; the number is the page's.
    pub fn open(file: u32) -> BufReader<Self> {
        BufReader::with_capacity(PIECE, Self { file, at: 0 })
    }
}

impl Read for Dropped {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let length = u32::try_from(into.len()).unwrap_or(u32::MAX);
        // Whole numbers of this size are exact as f64.
        let bytes = piece(self.file, self.at as f64, length).map_err(|refused| {
            std::io::Error::other(
                refused.as_string().unwrap_or_else(|| "the browser refuses to read it".into()),
            )
        })?;
        let count = bytes.len().min(into.len());
        if let (Some(into), Some(bytes)) = (into.get_mut(..count), bytes.get(..count)) {
            into.copy_from_slice(bytes);
        }
        self.at += count as u64;
        Ok(count)
    }
}
