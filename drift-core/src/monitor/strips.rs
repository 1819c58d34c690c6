//! Many ticks at once: whole strips side by side, the same bits as one tick after the other.

use super::{Plan, ReportOf, STRIP_TICKS, State};
use crate::blanking::{BlankingKind, BlankingState};
use crate::index_set::{IndexSet, Step};
use crate::number::Number;
use crate::options::Options;
use crate::trace::Trace;

impl<N: Number, S: IndexSet<N>, O: Options, const C: usize> Plan<N, S, O, C> {
    /// Many ticks at once: the same, bit for bit, as one by one, and several times as fast. Reads as many as the shortest slice
    /// has; `each` is told every report.
    pub fn ticks(
        &self,
        state: &mut State<N, S, O, C>,
        (mut r, mut y, mut u): (&[N], &[N], &[N]),
        mut each: impl FnMut(&ReportOf<N, S, O, C>),
    ) {
        loop {
            let mut done = self.strips::<4>(state, r, y, u);
            if done == 0 {
                done = self.strips::<3>(state, r, y, u);
            }
            if done > 0 {
                let (Some(rs), Some(ys), Some(us)) = (r.get(done..), y.get(done..), u.get(done..)) else {
                    return;
                };
                (r, y, u) = (rs, ys, us);
                continue;
            }
            let done = self.strip(state, r, y, u);
            let after = (r.get(done..), y.get(done..), u.get(done..));
            let (Some([r0, rs @ ..]), Some([y0, ys @ ..]), Some([u0, us @ ..])) = after else { return };
            if let Some(report) = self.rare_tick(state, *r0, *y0, *u0) {
                each(report);
            }
            (r, y, u) = (rs, ys, us);
        }
    }

    /// So many whole strips side by side, where nothing in them needs a closer look and the block goes on behind them: each is
    /// summed by itself anyway, and a processor adds to several sums in the time of one. How many ticks they were.
    #[inline]
    fn strips<const STRIPS: usize>(&self, state: &mut State<N, S, O, C>, r: &[N], y: &[N], u: &[N]) -> usize {
        const TICKS: usize = STRIP_TICKS as usize;
        let first = u32::from(state.tick_in_block);
        // At the beginning of a strip with nothing rare in sight the next look is at its end.
        let begins = first.is_multiple_of(u32::from(STRIP_TICKS))
            && u32::from(state.look_at) == first + u32::from(STRIP_TICKS) - 1;
        let goes_on = first + (STRIPS * TICKS) as u32;
        if N::EXACT || !begins || goes_on >= self.config.block_ticks || !state.point_known() {
            return 0;
        }
        let (r, y, u) = (r.as_chunks::<TICKS>().0, y.as_chunks::<TICKS>().0, u.as_chunks::<TICKS>().0);
        let (Some(r), Some(y), Some(u)) =
            (r.first_chunk::<STRIPS>(), y.first_chunk::<STRIPS>(), u.first_chunk::<STRIPS>())
        else {
            return 0;
        };
        if !self.usual(&state.blanking, r.as_flattened(), y.as_flattened(), u.as_flattened()) {
            return 0;
        }
        let mut sums = [S::NO_SUMS; STRIPS];
        let mut peaks = [state.peaks; STRIPS];
        let mut before = [state.trace.before(); STRIPS];
        for strip in 1..STRIPS {
            before[strip] = (r[strip - 1][TICKS - 1], y[strip - 1][TICKS - 1]);
        }
        for tick in 0..TICKS {
            for strip in 0..STRIPS {
                let (r, y, u) = (r[strip][tick], y[strip][tick], u[strip][tick]);
                let (r_before, y_before) = core::mem::replace(&mut before[strip], (r, y));
                let step = Step { r, y, u, r_before, y_before };
                let in_block = first + (strip * TICKS + tick) as u32;
                S::add(&mut sums[strip], &mut peaks[strip], in_block, &step, &state.point);
            }
        }
        for (sums, peaks) in sums.into_iter().zip(peaks) {
            state.sums = sums;
            state.join_strip();
            for (highest, peak) in state.peaks.as_mut().iter_mut().zip(peaks.as_ref()) {
                if *peak > *highest {
                    *highest = *peak;
                }
            }
        }
        let (r_last, y_last) = before[STRIPS - 1];
        state.trace.remember(r_last, y_last);
        state.blanking.remember(r_last);
        state.tick_in_block = goes_on as u16;
        state.look_at = self.strip_end(goes_on);
        STRIPS * TICKS
    }

    /// Whether the tick path would take all of these.
    #[inline]
    fn usual(&self, blanking: &<O::Blanking as BlankingKind>::State<N>, r: &[N], y: &[N], u: &[N]) -> bool {
        let Some(first) = r.first() else { return true };
        let mut usual = !O::Blanking::LINKED || self.is_held(blanking.r_before(), *first);
        // Without a way out early, so that several are asked at once.
        for ((&r, &y), &u) in r.iter().zip(y).zip(u) {
            usual &= N::surely_admissible(r, y, u) & self.in_control(u);
        }
        if O::Blanking::LINKED {
            let after = r.get(1..).unwrap_or_default();
            for (&before, &r) in r.iter().zip(after) {
                usual &= self.is_held(before, r);
            }
        }
        usual
    }

    /// Ticks up to the first that needs a closer look, the sums kept in registers; how many there were.
    #[inline]
    fn strip(&self, state: &mut State<N, S, O, C>, r: &[N], y: &[N], u: &[N]) -> usize {
        let free = state.look_at.wrapping_sub(state.tick_in_block);
        if !state.point_known() {
            return 0;
        }
        let (mut sums, mut peaks, mut trace, mut blanking) =
            (state.sums, state.peaks, state.trace, state.blanking);
        let begin = state.tick_in_block;
        let mut tick = begin;
        for ((&r, &y), &u) in r.iter().zip(y).zip(u).take(usize::from(free)) {
            if !(N::surely_admissible(r, y, u) && self.undisturbed(&blanking, r, u)) {
                break;
            }
            let (r_before, y_before) = trace.before();
            trace.remember(r, y);
            blanking.remember(r);
            let step = Step { r, y, u, r_before, y_before };
            S::add(&mut sums, &mut peaks, u32::from(tick), &step, &state.point);
            tick = tick.wrapping_add(1);
        }
        (state.sums, state.peaks, state.trace, state.blanking) = (sums, peaks, trace, blanking);
        state.tick_in_block = tick;
        usize::from(tick.wrapping_sub(begin))
    }
}
