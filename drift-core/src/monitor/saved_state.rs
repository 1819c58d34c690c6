//! The monitor's state in bytes: over a restart, a restored one goes on bit for bit.

use super::{Link, Monitor};
use crate::course::{COURSE_BYTES, Course};
use crate::detector::{DETECTOR_BYTES, DetectorStates};
use crate::error_sums::Trace;
use crate::index_set::IndexSet;
use crate::number::Number;
use crate::sample::Excluded;
use crate::store::{CHECKSUM_BYTES, HEADER_BYTES, Owner, Reader, StateError, Writer};

/// Saved numbers besides header, blocks and channels.
const FIXED_BYTES: usize = 32;

impl<N: Number, S: IndexSet<N>, const B: usize, const C: usize> Monitor<'_, N, S, B, C> {
    /// Bytes that [`Monitor::save`] needs at most.
    pub const STATE_BYTES: usize = HEADER_BYTES
        + FIXED_BYTES
        + (B + 1) * size_of::<S::Block>()
        + <S::Trace as Trace<N>>::BYTES
        + C * (DETECTOR_BYTES + COURSE_BYTES)
        + CHECKSUM_BYTES;

    fn owner(&self) -> Owner {
        Owner {
            number: N::TAG,
            set: S::TAG,
            capacity: B as u16,
            channels: C as u16,
            fingerprint: self.config.fingerprint(),
        }
    }

    /// Writes everything that the monitor remembers; a restored one goes on bit for bit. Returns the bytes used.
    ///
    /// # Errors
    /// [`StateError::BufferTooSmall`]; [`Monitor::STATE_BYTES`] always suffice.
    pub fn save(&self, into: &mut [u8]) -> Result<usize, StateError> {
        Writer::envelope(into, self.owner(), |to| {
            to.u8(self.whole_run);
            to.u16(self.tick_in_block);
            to.u16(self.left_out);
            self.trace.write(to);
            to.u16(self.blocks_to_hop);
            to.u32(self.blank_ticks);
            to.u8(self.link as u8);
            to.u32(self.r_before.to_word());
            self.excluded.as_array().into_iter().for_each(|n| to.u16(n));
            to.u32(self.hop);
            S::write(&self.strip, to);
            // The oldest first, the open one last: wherever the ring stood, the bytes are the same.
            let (newer, older) = self.ring.split_at_checked(usize::from(self.open) + 1).unwrap_or_default();
            older.iter().chain(newer).for_each(|block| S::write(block, to));
            for channel in &self.channels {
                channel.detectors.write(to);
                channel.course.write(to);
            }
        })
    }

    /// Takes up a saved state, all of it or none.
    ///
    /// # Errors
    /// The bytes are torn, damaged, of another layout version, another kind of monitor or another configuration;
    /// the monitor is then unchanged.
    pub fn restore(&mut self, from: &[u8]) -> Result<(), StateError> {
        let mut payload = Reader::open(from, self.owner())?;
        let mut restored = Self::new(self.config).map_err(|_| StateError::OtherConfig)?;
        restored.read(&mut payload).ok_or(StateError::Impossible)?;
        if !payload.is_empty() {
            return Err(StateError::Impossible);
        }
        *self = restored;
        Ok(())
    }

    fn read(&mut self, from: &mut Reader<'_>) -> Option<()> {
        self.whole_run = from.u8()?;
        self.tick_in_block = from.u16()?;
        self.look_at = self.tick_in_block.wrapping_add(1);
        self.left_out = from.u16()?;
        self.trace = S::Trace::read(from)?;
        self.blocks_to_hop = from.u16()?;
        self.blank_ticks = from.u32()?;
        self.link = match from.u8()? {
            0 => Link::None,
            1 => Link::Gap,
            2 => Link::Tick,
            _ => return None,
        };
        self.r_before = N::from_word(from.u32()?);
        let mut counts = [0u16; 6];
        for count in &mut counts {
            *count = from.u16()?;
        }
        self.excluded = Excluded::from_array(counts);
        self.hop = from.u32()?;
        self.strip = S::read(from)?;
        for block in &mut self.ring {
            *block = S::read(from)?;
        }
        self.open = (B - 1) as u8;
        for (state, channel) in self.channels.iter_mut().zip(&self.config.channels) {
            state.detectors =
                DetectorStates::read(from).filter(|states| channel.detectors.possible(states))?;
            state.course = Course::read(from).filter(|course| course.possible(&self.config.decision))?;
        }
        self.possible().then_some(())
    }

    /// What only damage beyond the checksum, or another program, could have written.
    fn possible(&self) -> bool {
        let left_out = u32::from(self.left_out);
        u32::from(self.tick_in_block) < self.config.block_ticks
            && left_out + u32::from(self.trace.unpaired()) <= u32::from(self.tick_in_block)
            && self.trace.time_left_out() <= left_out * u32::from(self.tick_in_block)
            && (1..=self.config.hop_blocks.max(Self::first_hop(self.config))).contains(&self.blocks_to_hop)
            && self.blank_ticks <= self.config.blanking.as_ref().map_or(0, |b| b.ticks)
            && self.r_before.admissible()
            && self.trace.y_before().admissible()
    }
}
