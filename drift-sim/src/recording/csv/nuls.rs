//! NULs in a text: a file system leaves them where a file was being written when the power failed, and a logger that takes its room ahead
//! leaves them behind the last row. One of a run stays as a sign that the row around it was cut off.

use std::io::{self, Read};

/// NULs in a run that are passed over, at most: what a file system or a logger takes ahead is mostly less, and to read so many takes no
/// time.
const NULS_MAX: u64 = 64 << 20;

/// The text with one NUL for each run of them.
pub(super) fn shortened<R: Read>(source: R) -> impl Read {
    Shortened { source, run: 0 }
}

struct Shortened<R> {
    source: R,
    /// NULs that were read one behind the other, up to where the text was handed on to.
    run: u64,
}

impl<R> Shortened<R> {
    /// Shortens what was read, in its place; how much of it is left.
    fn shorten(&mut self, text: &mut [u8]) -> io::Result<usize> {
        if self.run == 0 && memchr::memchr(0, text).is_none() {
            return Ok(text.len());
        }
        let mut kept = 0;
        for at in 0..text.len() {
            let byte = text[at];
            self.run = if byte == 0 { self.run + 1 } else { 0 };
            if self.run <= 1 {
                text[kept] = byte;
                kept += 1;
            }
        }
        if self.run > NULS_MAX {
            return Err(io::Error::other("more than 64 MiB of NULs, one behind the other"));
        }
        Ok(kept)
    }
}

impl<R: Read> Read for Shortened<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let count = self.source.read(buffer)?;
            let kept = self.shorten(buffer.get_mut(..count).unwrap_or_default())?;
            if kept > 0 || count == 0 {
                return Ok(kept);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_nuls_is_one_however_it_is_read() {
        for most in [1, 2, 3, 100] {
            let mut source = shortened(&b"\0a\0\0\0b\0\0\0\0\0"[..]);
            let (mut text, mut buffer) = (Vec::new(), vec![0; most]);
            while let count @ 1.. = source.read(&mut buffer).unwrap() {
                text.extend_from_slice(&buffer[..count]);
            }
            assert_eq!(text, b"\0a\0b\0");
        }
    }

    #[test]
    fn an_endless_run_ends() {
        let mut text = Vec::new();
        let error = shortened(io::repeat(0)).read_to_end(&mut text).unwrap_err();
        assert!(error.to_string().contains("64 MiB"));
    }
}
