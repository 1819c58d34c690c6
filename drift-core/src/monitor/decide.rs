//! The end of a block and of a window: gaps are made up, the blocks are added up to indices, the channels judge them.

use super::{Plan, ReportOf, State};
use crate::course::Verdict;
use crate::index_set::{IndexSet, Row, Scale};
use crate::number::Number;
use crate::options::Options;
use crate::report::WindowStatus;
use crate::sample::Exclusions;
use crate::trace::Trace;
use crate::window::{Block, Blocks, ClosedBlock, Layout, Total};

/// A block without gaps, read from the open sums, which are cleared as they are read.
struct OpenBlock<'a, N: Number, S: IndexSet<N>> {
    sums: &'a mut S::Sums,
    joined: &'a mut S::Joined,
    peaks: &'a S::Peaks,
}

impl<N: Number, S: IndexSet<N>> Block for OpenBlock<'_, N, S> {
    #[inline(always)]
    fn sum(&self, i: usize) -> f32 {
        let place = self.joined.as_ref().get(i).zip(self.sums.as_ref().get(i));
        place.map_or(0.0, |(joined, sum)| N::closed(joined, *sum))
    }
    #[inline(always)]
    fn take_sum(&mut self, i: usize) -> f32 {
        let Some((joined, sum)) = self.joined.as_mut().get_mut(i).zip(self.sums.as_mut().get_mut(i)) else {
            return 0.0;
        };
        let closed = N::closed(joined, *sum);
        (*joined, *sum) = (N::NOTHING_JOINED, N::NOTHING);
        closed
    }
    #[inline(always)]
    fn peak(&self, i: usize) -> f32 {
        self.peaks.as_ref().get(i).map_or(0.0, |peak| peak.to_f32())
    }
}

impl<N: Number, S: IndexSet<N>, O: Options, const C: usize> Plan<N, S, O, C> {
    const LAYOUT: Layout = Layout { sums: S::SUMS, weighted: S::WEIGHTED };

    #[inline(never)]
    pub(super) fn close_block<'s>(
        &self,
        state: &'s mut State<N, S, O, C>,
    ) -> Option<&'s ReportOf<N, S, O, C>> {
        let place = self.config.window_blocks.wrapping_sub(state.blocks_to_hop);
        if !N::EXACT && state.left_out == 0 && state.trace.unpaired() == 0 {
            let (sums, joined) = (&mut state.sums, &mut state.joined);
            let mut block = OpenBlock::<N, S> { sums, joined, peaks: &state.peaks };
            state.window.close(&Self::LAYOUT, Some(&mut block), place);
        } else {
            let mut closed = S::Closed::filled(0.0);
            let counts = self.close(state, &mut closed);
            state.clear_sums();
            let block = &mut ClosedBlock { closed: &closed, sums: S::SUMS };
            state.window.close(&Self::LAYOUT, counts.then_some(block), place);
        }
        state.start_block();
        state.blocks_to_hop = state.blocks_to_hop.wrapping_sub(1);
        if state.blocks_to_hop > 0 {
            return None;
        }
        state.blocks_to_hop = self.config.hop_blocks;
        Some(self.decide(state))
    }

    /// The open block's sums and peaks, gaps made up; false if it has too few valid ticks.
    #[inline(always)]
    fn close(&self, state: &State<N, S, O, C>, into: &mut S::Closed) -> bool {
        let whole = self.config.block_ticks;
        let valid = whole.wrapping_sub(u32::from(state.left_out));
        if state.left_out > 0 && !(O::GAPS && valid as f32 >= self.config.min_valid * whole as f32) {
            return false;
        }
        let (sums, joined) = (state.sums.as_ref(), state.joined.as_ref());
        let Some((sums_into, peaks_into)) = into.as_mut().split_at_mut_checked(S::SUMS) else { return false };
        for ((into, sum), joined) in sums_into.iter_mut().zip(sums).zip(joined) {
            *into = N::closed(joined, *sum);
        }
        for (into, peak) in peaks_into.iter_mut().zip(state.peaks.as_ref()) {
            *into = peak.to_f32();
        }
        if N::EXACT {
            for &(weighted, plain) in S::WEIGHTED {
                if let Some(((weighted, plain), into)) =
                    sums.get(weighted).zip(sums.get(plain)).zip(sums_into.get_mut(weighted))
                {
                    *into = N::closed_weighted(*weighted, *plain, whole);
                }
            }
        }
        if O::GAPS && state.left_out > 0 || state.trace.unpaired() > 0 {
            self.make_up(state, sums_into, valid);
        }
        true
    }

    /// As if the ticks left out had shown the mean of the valid ones.
    #[inline(never)]
    fn make_up(&self, state: &State<N, S, O, C>, sums: &mut [f32], valid: u32) {
        let whole = self.config.block_ticks as f32;
        let paired = valid.wrapping_sub(u32::from(state.trace.unpaired()));
        let valid = valid as f32;
        let weighted = S::WEIGHTED.iter().map(|&(weighted, plain)| {
            // Each tick left out gets the mean error at its own time: scaling the weighted sum would move it.
            let at = |sum: usize| sums.get(sum).copied().unwrap_or(0.0);
            at(weighted) + at(plain) * state.trace.time_left_out() as f32 / valid
        });
        let mut made_up = S::Placed::filled(0.0);
        for (into, x) in made_up.as_mut().iter_mut().zip(weighted) {
            *into = x;
        }
        let Some((of_ticks, of_pairs)) = sums.split_at_mut_checked(S::DIFFERENCES_FROM) else { return };
        for sum in of_ticks.iter_mut() {
            *sum = *sum * whole / valid;
        }
        for (&(weighted, _), x) in S::WEIGHTED.iter().zip(made_up.as_ref()) {
            if let Some(sum) = of_ticks.get_mut(weighted) {
                *sum = *x;
            }
        }
        // As many pairs as ticks missing at random would leave; with fewer, differences stand for nothing.
        let enough =
            paired > 0 && paired as f32 >= self.config.min_valid * self.config.min_valid * whole - 1.0;
        for sum in of_pairs {
            *sum = if enough { *sum * whole / paired as f32 } else { f32::NAN };
        }
    }

    /// The window's indices; `None` if it has too few valid blocks.
    #[inline(always)]
    fn indices(&self, total: &mut Total<S::Closed, S::Placed>) -> Option<S::Indices> {
        let config = &self.config;
        let whole = total.valid == config.window_blocks;
        let blocks = f32::from(config.window_blocks);
        let valid = if whole { blocks } else { f32::from(total.valid) };
        if !(whole || O::GAPS && total.valid > 0 && valid >= config.min_valid * blocks) {
            return None;
        }
        let block_ticks = config.block_ticks as f32;
        let fill = if whole { 1.0 } else { blocks / valid };
        total.weigh(&Self::LAYOUT, if whole { block_ticks } else { block_ticks / fill });
        let by = Scale {
            tick_s: config.sample_time_s,
            y_unit: config.y_unit,
            u_unit: config.u_unit,
            per_tick: 1.0 / (valid * block_ticks),
            fill,
        };
        Some(S::indices(&total.closed, &by))
    }

    /// Closes the window: judges it.
    fn decide<'s>(&self, state: &'s mut State<N, S, O, C>) -> &'s ReportOf<N, S, O, C> {
        let (config, report) = (&self.config, &mut state.report);
        report.indices = S::NO_INDICES;
        let judged = state.window.with_total(&Self::LAYOUT, config.window_blocks, |total| {
            let indices = self.indices(total);
            if let Some(indices) = indices {
                report.indices = indices;
            }
            indices.is_some()
        });
        report.status = if judged { WindowStatus::Valid } else { WindowStatus::TooFewValid };
        report.hop = report.hop.wrapping_add(1);
        report.verdict = Verdict::Healthy;
        if state.counted {
            report.excluded = O::Excluded::NONE;
        }
        state.counted = true;
        let point = S::point_mean(&report.indices);
        for ((state, channel), out) in
            state.channels.iter_mut().zip(&config.channels).zip(&mut report.channels)
        {
            (out.x, out.value) = (f32::NAN, f32::NAN);
            if judged {
                (out.x, out.value) = S::coordinates(&report.indices, channel.kind);
            }
            state.judge(&config.decision, channel, &point, out);
            if out.verdict > report.verdict {
                report.verdict = out.verdict;
            }
        }
        report
    }
}
