//! What a monitor remembers from tick to tick.

use super::ReportOf;
use super::channel_state::ChannelState;
use crate::blanking::{BlankingKind, BlankingState};
use crate::course::Verdict;
use crate::index_set::IndexSet;
use crate::number::Number;
use crate::options::Options;
use crate::sample::{Exclusion, Exclusions};
use crate::trace::Trace;
use crate::window::WindowKind;

/// What the last readings are to the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Link {
    /// There are none: the start, or the loop was open.
    None,
    /// Ticks are missing in between: a step of the reference still shows, a speed does not.
    Gap,
    /// One tick earlier.
    Tick,
}

/// What a monitor remembers. What every tick touches comes first: a Cortex-M0 reaches no further in one instruction.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct State<N: Number, S: IndexSet<N>, O: Options, const C: usize = 1> {
    /// First of all: two readings that lie at the state's own address are stored by one instruction.
    pub(super) trace: S::Trace,
    /// The open strip.
    pub(super) sums: S::Sums,
    // The order of these two: from the first place of a word a host's compiler loads the whole word, which waits until the half that
    // the tick before wrote has left the store buffer. On a controller the other order is the shorter code.
    /// The tick of the block that needs a closer look than the usual one: the last of a strip or, unless the readings
    /// before are known, the next. Counted from 0.
    #[cfg(target_pointer_width = "64")]
    pub(super) look_at: u16,
    pub(super) tick_in_block: u16,
    /// As above.
    #[cfg(not(target_pointer_width = "64"))]
    pub(super) look_at: u16,
    pub(super) blanking: <O::Blanking as BlankingKind>::State<N>,
    pub(super) peaks: S::Peaks,
    /// The operating point of the tick, held until the next one.
    pub(super) point: S::Point,
    /// Ticks left out of the open block so far.
    pub(super) left_out: u16,
    pub(super) blocks_to_hop: u16,
    /// The open block's strips.
    pub(super) joined: S::Joined,
    /// The closed blocks.
    pub(super) window: <O::Window as WindowKind>::Blocks<S::Closed, S::Placed>,
    pub(super) channels: [ChannelState<O>; C],
    pub(super) report: ReportOf<N, S, O, C>,
    pub(super) link: Link,
    /// The report's count of ticks left out is that of the last decision.
    pub(super) counted: bool,
}

impl<N: Number, S: IndexSet<N>, O: Options, const C: usize> State<N, S, O, C> {
    /// The last report; of a monitor that has not decided yet, one of nothing.
    pub const fn report(&self) -> &ReportOf<N, S, O, C> {
        &self.report
    }

    /// The most severe of the channels' courses now: `Healthy`, `Suspect` or `Drift`. That a deviation ended
    /// ([`Verdict::Disturbance`], [`Verdict::Recovered`]) is said once, in the report.
    pub fn verdict(&self) -> Verdict {
        self.channels.iter().map(|c| c.course.verdict()).max().unwrap_or(Verdict::Healthy)
    }

    /// Always so where no operating point is kept.
    #[inline(always)]
    pub(super) fn point_known(&self) -> bool {
        self.point.as_ref().iter().all(|point| point.admissible())
    }

    /// A tick without a usable sample: time passes.
    pub(super) fn miss(&mut self) {
        if self.link == Link::Tick {
            self.link = Link::Gap;
        }
        self.blanking.set(self.blanking.ticks().saturating_sub(1));
    }

    pub(super) fn leave_out(&mut self, why: Exclusion) {
        if self.counted {
            self.report.excluded = O::Excluded::NONE;
            self.counted = false;
        }
        self.report.excluded.count(why);
        self.left_out = self.left_out.wrapping_add(1);
        self.trace.leave_out(self.tick_in_block);
        if N::EXACT {
            // The running sums of the weighted ones go on.
            for &(weighted, plain) in S::WEIGHTED {
                if let Some(term) = self.sums.as_ref().get(plain).copied()
                    && let Some(sum) = self.sums.as_mut().get_mut(weighted)
                {
                    N::add_sum(sum, term);
                }
            }
        }
    }

    pub(super) fn join_strip(&mut self) {
        // By two: the loop itself is a quarter of the work.
        let (joined, last_joined) = self.joined.as_mut().as_chunks_mut::<2>();
        let (sums, last_sums) = self.sums.as_mut().as_chunks_mut::<2>();
        for ([joined_a, joined_b], [a, b]) in joined.iter_mut().zip(sums) {
            N::join(joined_a, core::mem::replace(a, N::NOTHING));
            N::join(joined_b, core::mem::replace(b, N::NOTHING));
        }
        for (joined, sum) in last_joined.iter_mut().zip(last_sums) {
            N::join(joined, core::mem::replace(sum, N::NOTHING));
        }
    }

    pub(super) fn clear_sums(&mut self) {
        self.sums = S::NO_SUMS;
        self.joined = S::NO_STRIPS;
    }

    pub(super) fn start_block(&mut self) {
        self.peaks = S::NO_PEAKS;
        self.left_out = 0;
        self.trace.start_block();
    }
}

#[cfg(feature = "defmt")]
impl<N: Number, S: IndexSet<N>, O: Options, const C: usize> defmt::Format for State<N, S, O, C> {
    /// Where it stands; the sums are no reading for a log.
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "State {{ hop: {}, verdict: {} }}", self.report.hop, self.verdict());
    }
}
