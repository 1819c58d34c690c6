//! The monitor's state in bytes: over a restart, a restored one goes on bit for bit.

use super::channel_state::ChannelState;
use super::{Link, Monitor, Plan, State};
use crate::blanking::{BlankingKind, BlankingState};
use crate::index_set::IndexSet;
use crate::number::Number;
use crate::options::Options;
use crate::sample::Exclusions;
use crate::store::{CHECKSUM_BYTES, HEADER_BYTES, Owner, Reader, StateError, Writer};
use crate::trace::Trace;
use crate::window::{Blocks, WindowKind};

/// Saved numbers of a fixed size: three u16, two u8, one u32.
const FIXED_BYTES: usize = 12;

impl<N: Number, S: IndexSet<N>, O: Options, const C: usize> Plan<N, S, O, C> {
    /// Bytes that [`Plan::save`] needs.
    pub const STATE_BYTES: usize = HEADER_BYTES
        + FIXED_BYTES
        + S::SUMS * (N::SUM_BYTES + N::JOINED_BYTES)
        + size_of::<S::Peaks>()
        + size_of::<S::Point>()
        + <<O::Window as WindowKind>::Blocks<S::Closed, S::Placed> as Blocks<S::Closed, S::Placed>>::BYTES
        + <S::Trace as Trace<N>>::BYTES
        + <<O::Blanking as BlankingKind>::State<N> as BlankingState<N>>::BYTES
        + O::Excluded::BYTES
        + C * ChannelState::<O>::BYTES
        + CHECKSUM_BYTES;

    fn owner(&self) -> Owner {
        Owner {
            number: N::TAG,
            set: S::TAG,
            capacity: if O::Window::SLIDES { O::Window::CAPACITY } else { 0 },
            // The options, told apart by the length of what they remember.
            channels: (C as u16) << 12 ^ (ChannelState::<O>::BYTES as u16),
            fingerprint: self.config.fingerprint(),
        }
    }

    /// Writes everything that the monitor remembers; a restored one goes on bit for bit. Returns the bytes used,
    /// [`Plan::STATE_BYTES`].
    ///
    /// # Errors
    /// [`StateError::BufferTooSmall`]; nothing is written then.
    pub fn save(&self, state: &State<N, S, O, C>, into: &mut [u8]) -> Result<usize, StateError> {
        if into.len() < Self::STATE_BYTES {
            return Err(StateError::BufferTooSmall);
        }
        Writer::envelope(into, self.owner(), |to| {
            to.u16(state.tick_in_block);
            to.u16(state.left_out);
            to.u16(state.blocks_to_hop);
            to.u8(state.link as u8);
            to.u8(u8::from(state.counted));
            to.u32(state.report.hop);
            state.report.excluded.write(to);
            state.trace.write(to);
            state.blanking.write(to);
            state.sums.as_ref().iter().for_each(|sum| N::write_sum(*sum, to));
            state.joined.as_ref().iter().for_each(|joined| N::write_joined(joined, to));
            state.peaks.as_ref().iter().for_each(|peak| to.u32(peak.to_word()));
            state.point.as_ref().iter().for_each(|point| to.u32(point.to_word()));
            state.window.write(to);
            state.channels.iter().for_each(|channel| channel.write(to));
        })
    }

    /// Takes up a saved state, all of it or none.
    ///
    /// # Errors
    /// The bytes are torn, damaged, of another layout version, another kind of monitor or another configuration;
    /// the state is then unchanged.
    pub fn restore(&self, state: &mut State<N, S, O, C>, from: &[u8]) -> Result<(), StateError> {
        let mut payload = Reader::open(from, self.owner())?;
        let restored = self.read(&mut payload).filter(|_| payload.is_empty());
        *state = restored.ok_or(StateError::Impossible)?;
        Ok(())
    }

    fn read(&self, from: &mut Reader<'_>) -> Option<State<N, S, O, C>> {
        let mut state = self.start();
        state.tick_in_block = from.u16()?;
        state.look_at = state.tick_in_block;
        state.left_out = from.u16()?;
        state.blocks_to_hop = from.u16()?;
        state.link = match from.u8()? {
            0 => Link::None,
            1 => Link::Gap,
            2 => Link::Tick,
            _ => return None,
        };
        state.counted = match from.u8()? {
            0 => false,
            1 => true,
            _ => return None,
        };
        state.report.hop = from.u32()?;
        state.report.excluded = O::Excluded::read(from)?;
        state.trace = S::Trace::read(from)?;
        state.blanking = BlankingState::read(from)?;
        for sum in state.sums.as_mut() {
            *sum = N::read_sum(from)?;
        }
        for joined in state.joined.as_mut() {
            *joined = N::read_joined(from)?;
        }
        for peak in state.peaks.as_mut() {
            *peak = N::from_word(from.u32()?);
            if peak.non_finite() {
                return None;
            }
        }
        for point in state.point.as_mut() {
            *point = N::from_word(from.u32()?);
        }
        state.window = Blocks::read(from)?;
        for (state, channel) in state.channels.iter_mut().zip(&self.config.channels) {
            *state = ChannelState::read(from, &self.config.decision, channel)?;
        }
        self.possible(&state).then_some(state)
    }

    /// What only damage beyond the checksum, or another program, could not have written.
    fn possible(&self, state: &State<N, S, O, C>) -> bool {
        let (tick, left_out) = (u32::from(state.tick_in_block), u32::from(state.left_out));
        let (r_before, y_before) = state.trace.before();
        tick < self.config.block_ticks
            && left_out.saturating_add(u32::from(state.trace.unpaired())) <= tick
            && state.trace.time_left_out() <= left_out.saturating_mul(tick)
            && (1..=self.config.hop_blocks.max(self.first_hop())).contains(&state.blocks_to_hop)
            && state.blanking.ticks() <= self.config.blanking.as_ref().map_or(0, |b| b.ticks)
            && r_before.admissible()
            && y_before.admissible()
    }
}

impl<N: Number, S: IndexSet<N>, O: Options, const C: usize> Monitor<N, S, O, C> {
    /// As [`Plan::STATE_BYTES`].
    pub const STATE_BYTES: usize = Plan::<N, S, O, C>::STATE_BYTES;

    /// As [`Plan::save`].
    ///
    /// # Errors
    /// As [`Plan::save`].
    pub fn save(&self, into: &mut [u8]) -> Result<usize, StateError> {
        self.plan.save(&self.state, into)
    }

    /// As [`Plan::restore`].
    ///
    /// # Errors
    /// As [`Plan::restore`].
    pub fn restore(&mut self, from: &[u8]) -> Result<(), StateError> {
        self.plan.restore(&mut self.state, from)
    }
}
