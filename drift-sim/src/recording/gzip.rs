//! Files packed with gzip, unpacked as they are read; several packed one after the other count as one.

use std::io::Read;

use flate2::read::MultiGzDecoder;

/// What such a file begins with.
pub(super) const MAGIC: &[u8] = &[0x1f, 0x8b];

/// The text or bytes in a packed source; what is broken in it shows when it is reached.
pub(super) fn unpacked(source: Box<dyn Read + Send>) -> Box<dyn Read + Send> {
    Box::new(MultiGzDecoder::new(source))
}
