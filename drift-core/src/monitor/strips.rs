//! Many ticks at once: whole strips side by side, the same bits as one tick after the other.

use super::{Plan, ReportOf, STRIP_TICKS, State};
use crate::blanking::{BlankingKind, BlankingState};
use crate::index_set::{IndexSet, Step};
use crate::number::Number;
use crate::options::Options;
use crate::trace::Trace;

const TICKS: usize = STRIP_TICKS as usize;
/// Ticks whose terms are found side by side: two of the narrowest vectors that a host has.
const LANES: usize = 8;
/// With more sums than these a tick has enough to add at once.
const FEW_SUMS: usize = 3;

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
        if !self.all_undisturbed(&state.blanking, r.as_flattened(), u.as_flattened()) {
            return 0;
        }
        let mut sums = [S::NO_SUMS; STRIPS];
        let mut lanes = Lanes::<N, S> { sizes: [N::NOTHING; LANES], peaks: [state.peaks; LANES] };
        let mut before = [state.trace.before(); STRIPS];
        for strip in 1..STRIPS {
            before[strip] = (r[strip - 1][TICKS - 1], y[strip - 1][TICKS - 1]);
        }
        for piece in 0..TICKS / LANES {
            for strip in 0..STRIPS {
                let (r, y, u) = (r[strip].as_chunks().0, y[strip].as_chunks().0, u[strip].as_chunks().0);
                let in_block = first + (strip * TICKS + piece * LANES) as u32;
                let samples = (&r[piece], &y[piece], &u[piece]);
                lanes.add(&mut sums[strip], samples, &mut before[strip], in_block, &state.point);
            }
        }
        if !N::all_admissible(lanes.sizes) {
            return 0;
        }
        for sums in sums {
            state.sums = sums;
            state.join_strip();
        }
        lanes.raise(&mut state.peaks);
        let (r_last, y_last) = before[STRIPS - 1];
        state.trace.remember(r_last, y_last);
        state.blanking.remember(r_last);
        state.tick_in_block = goes_on as u16;
        state.look_at = self.strip_end(goes_on);
        STRIPS * TICKS
    }

    /// Whether none of these ticks is at a limit or at a step of the reference; asked of finite numbers, so that a monitor without limits
    /// and steps need not ask.
    #[inline]
    fn all_undisturbed(&self, blanking: &<O::Blanking as BlankingKind>::State<N>, r: &[N], u: &[N]) -> bool {
        let mut undisturbed = true;
        // Without a way out early, so that several are asked at once.
        if O::LIMITS && self.config.saturation.is_some() {
            for &u in u {
                undisturbed &= self.in_control(u);
            }
        }
        if O::Blanking::LINKED
            && self.config.blanking.is_some()
            && let [first, after @ ..] = r
        {
            undisturbed &= self.is_held(blanking.r_before(), *first);
            for (&before, &r) in r.iter().zip(after) {
                undisturbed &= self.is_held(before, r);
            }
        }
        undisturbed
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

/// What is kept of ticks side by side, besides their sums.
struct Lanes<N: Number, S: IndexSet<N>> {
    /// What tells whether all were admissible.
    sizes: [N::Sum; LANES],
    peaks: [S::Peaks; LANES],
}

impl<N: Number, S: IndexSet<N>> Lanes<N, S> {
    /// Adds ticks to the sums of one strip: their terms are found side by side and added in turn, `in_block` is the first one's place.
    #[inline(always)]
    fn add(
        &mut self,
        sums: &mut S::Sums,
        (r, y, u): (&[N; LANES], &[N; LANES], &[N; LANES]),
        before: &mut (N, N),
        in_block: u32,
        point: &S::Point,
    ) {
        let mut terms = [[N::NOTHING; LANES]; FEW_SUMS];
        for lane in 0..LANES {
            let (r_before, y_before) = if lane == 0 { *before } else { (r[lane - 1], y[lane - 1]) };
            let step = Step { r: r[lane], y: y[lane], u: u[lane], r_before, y_before };
            N::add_size(&mut self.sizes[lane], step.r, step.y, step.u);
            if S::SUMS > FEW_SUMS {
                S::add(sums, &mut self.peaks[0], in_block + lane as u32, &step, point);
                continue;
            }
            let mut of_tick = S::NO_SUMS;
            S::add(&mut of_tick, &mut self.peaks[lane], in_block + lane as u32, &step, point);
            for (terms, term) in terms.iter_mut().zip(of_tick.as_ref()) {
                terms[lane] = *term;
            }
        }
        *before = (r[LANES - 1], y[LANES - 1]);
        for (sum, terms) in sums.as_mut().iter_mut().zip(&terms) {
            for term in terms {
                N::add_sum(sum, *term);
            }
        }
    }

    /// Raises peaks to the highest of these.
    fn raise(&self, peaks: &mut S::Peaks) {
        for of_lane in &self.peaks {
            for (highest, peak) in peaks.as_mut().iter_mut().zip(of_lane.as_ref()) {
                if *peak > *highest {
                    *highest = *peak;
                }
            }
        }
    }
}
