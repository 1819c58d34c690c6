//! Saved state as bytes: little-endian words behind a header, closed by a checksum. A torn, damaged or foreign
//! blob is refused as a whole.
//!
//! Layout (version 3): `DRFT`, version u16, number tag u8, set tag u8, capacity u16, channels u16, configuration
//! fingerprint u32, payload length u32, payload, CRC-32 (ISO-HDLC) of all before it.

use crc::{Crc, NoTable};

/// No table: 16 bytes of code beat 1 KiB of flash where speed does not matter.
const CRC32: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&crc::CRC_32_ISO_HDLC);
const MAGIC: [u8; 4] = *b"DRFT";
/// The layout's version; it changes whenever the bytes do, apart from the crate's own.
pub const STATE_VERSION: u16 = 3;
pub(crate) const HEADER_BYTES: usize = 20;
pub(crate) const CHECKSUM_BYTES: usize = 4;

/// Why a saved state was refused, or could not be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StateError {
    /// The buffer is too small to save into.
    BufferTooSmall,
    /// Fewer bytes than the header or the payload says: torn.
    Torn,
    /// It does not begin as a saved state does.
    NotAState,
    /// Written by another version of the layout.
    Version,
    /// The checksum does not match: damaged.
    Checksum,
    /// Of a monitor with another number type, index set, capacity or count of channels.
    OtherMonitor,
    /// Of a monitor with another configuration.
    OtherConfig,
    /// The bytes are whole but a value in them is impossible.
    Impossible,
}

impl core::fmt::Display for StateError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::BufferTooSmall => "the buffer is too small for the state",
            Self::Torn => "the state is cut short",
            Self::NotAState => "these bytes are no saved state",
            Self::Version => "the state is of another layout version",
            Self::Checksum => "the state is damaged",
            Self::OtherMonitor => "the state is of another kind of monitor",
            Self::OtherConfig => "the state is of another configuration",
            Self::Impossible => "the state holds an impossible value",
        })
    }
}

impl core::error::Error for StateError {}

/// The quiet NaN.
const UNKNOWN: u32 = 0x7fc0_0000;

/// What the state belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Owner {
    pub number: u8,
    pub set: u8,
    pub capacity: u16,
    pub channels: u16,
    pub fingerprint: u32,
}

/// Writes little-endian words into a borrowed buffer; what does not fit is remembered, not written.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Writer<'a> {
    buffer: &'a mut [u8],
    at: usize,
    full: bool,
}

impl<'a> Writer<'a> {
    pub(crate) fn new(buffer: &'a mut [u8]) -> Self {
        Self { buffer, at: 0, full: false }
    }
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        match self.buffer.get_mut(self.at..).and_then(|rest| rest.get_mut(..bytes.len())) {
            Some(place) => {
                for (to, from) in place.iter_mut().zip(bytes) {
                    *to = *from;
                }
                self.at = self.at.wrapping_add(bytes.len());
            }
            None => self.full = true,
        }
    }
    pub(crate) fn u8(&mut self, value: u8) {
        self.bytes(&[value]);
    }
    pub(crate) fn u16(&mut self, value: u16) {
        self.bytes(&value.to_le_bytes());
    }
    pub(crate) fn u32(&mut self, value: u32) {
        self.bytes(&value.to_le_bytes());
    }
    pub(crate) fn u64(&mut self, value: u64) {
        self.bytes(&value.to_le_bytes());
    }
    pub(crate) fn f32(&mut self, value: f32) {
        self.u32(value.to_bits());
    }
    /// A number that is NaN where it is not known: one pattern for all of them.
    pub(crate) fn f32_or_nan(&mut self, value: f32) {
        self.u32(if value.is_nan() { UNKNOWN } else { value.to_bits() });
    }

    /// Header, payload and checksum; the bytes used.
    pub(crate) fn envelope(
        buffer: &'a mut [u8],
        owner: Owner,
        payload: impl FnOnce(&mut Writer<'_>),
    ) -> Result<usize, StateError> {
        let mut writer = Writer::new(buffer);
        writer.bytes(&MAGIC);
        writer.u16(STATE_VERSION);
        writer.u8(owner.number);
        writer.u8(owner.set);
        writer.u16(owner.capacity);
        writer.u16(owner.channels);
        writer.u32(owner.fingerprint);
        let length_at = writer.at;
        writer.u32(0);
        payload(&mut writer);
        let (end, full) = (writer.at, writer.full);
        let length = (end.saturating_sub(HEADER_BYTES)) as u32;
        for (to, from) in writer.buffer.iter_mut().skip(length_at).zip(length.to_le_bytes()) {
            *to = from;
        }
        let checksum = CRC32.checksum(writer.buffer.get(..end).unwrap_or(&[]));
        writer.u32(checksum);
        if full || writer.full { Err(StateError::BufferTooSmall) } else { Ok(writer.at) }
    }
}

/// Reads them back; `None` past the end.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take<const K: usize>(&mut self) -> Option<[u8; K]> {
        let (head, rest) = self.bytes.split_first_chunk::<K>()?;
        self.bytes = rest;
        Some(*head)
    }
    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[b]| b)
    }
    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }
    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }
    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }
    /// A finite number.
    pub(crate) fn f32(&mut self) -> Option<f32> {
        self.u32().map(f32::from_bits).filter(|x| x.is_finite())
    }
    /// A finite number, or the one NaN that stands for what is not known.
    pub(crate) fn f32_or_nan(&mut self) -> Option<f32> {
        let word = self.u32()?;
        let value = f32::from_bits(word);
        (value.is_finite() || word == UNKNOWN).then_some(value)
    }
    pub(crate) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Checks header, length and checksum; the payload.
    pub(crate) fn open(bytes: &'a [u8], owner: Owner) -> Result<Self, StateError> {
        let mut header = Reader { bytes };
        if header.take::<4>().ok_or(StateError::Torn)? != MAGIC {
            return Err(StateError::NotAState);
        }
        if header.u16().ok_or(StateError::Torn)? != STATE_VERSION {
            return Err(StateError::Version);
        }
        let found = read_owner(&mut header).ok_or(StateError::Torn)?;
        let length = header.u32().ok_or(StateError::Torn)? as usize;
        let payload = header.bytes.get(..length).ok_or(StateError::Torn)?;
        let mut tail = Reader { bytes: header.bytes.get(length..).unwrap_or(&[]) };
        let checksum = tail.u32().ok_or(StateError::Torn)?;
        let covered = bytes.get(..HEADER_BYTES.wrapping_add(length)).ok_or(StateError::Torn)?;
        if CRC32.checksum(covered) != checksum {
            return Err(StateError::Checksum);
        }
        if (Owner { fingerprint: owner.fingerprint, ..found }) != owner {
            return Err(StateError::OtherMonitor);
        }
        if found.fingerprint != owner.fingerprint {
            return Err(StateError::OtherConfig);
        }
        Ok(Reader { bytes: payload })
    }
}

fn read_owner(header: &mut Reader<'_>) -> Option<Owner> {
    Some(Owner {
        number: header.u8()?,
        set: header.u8()?,
        capacity: header.u16()?,
        channels: header.u16()?,
        fingerprint: header.u32()?,
    })
}

/// A checksum over a configuration's numbers, so that a state is not restored under another one.
pub(crate) struct Fingerprint<'a>(crc::Digest<'a, u32, NoTable>);

impl Fingerprint<'_> {
    pub(crate) fn of(words: impl FnOnce(&mut Fingerprint<'_>)) -> u32 {
        let mut fingerprint = Fingerprint(CRC32.digest());
        words(&mut fingerprint);
        fingerprint.0.finalize()
    }
    pub(crate) fn u32(&mut self, value: u32) {
        self.0.update(&value.to_le_bytes());
    }
    pub(crate) fn f32(&mut self, value: f32) {
        self.u32(value.to_bits());
    }
}
