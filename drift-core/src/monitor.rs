//! The monitor: one sample in per tick, one report out per decision.
//!
//! Per tick a few sums grow; at the end of a block they enter a ring of closed blocks, and at a decision the ring
//! is added up anew. Nothing is ever subtracted, so nothing accumulates: after 1e8 ticks the indices are as exact
//! as after the first window. Within a block, strips of about the square root of its length are summed apart and
//! then joined, so that a long block of small samples does not round more than a short one.

mod channel_state;
mod saved_state;

use heapless::Vec;

use self::channel_state::{ChannelState, unjudged};
use crate::config::{Config, ConfigError};
use crate::course::{Course, Verdict};
use crate::error_sums::Trace;
use crate::index::Indices;
use crate::index_set::{Coverage, Full, IndexSet, Pair, Scale, Step};
use crate::number::Number;
use crate::report::{Location, Report, WindowStatus};
use crate::sample::{Excluded, Exclusion, Input};

/// What the last readings are to the next tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Link {
    /// There are none: the start, or the loop was open.
    None,
    /// Ticks are missing in between: a step of the reference still shows, a speed does not.
    Gap,
    /// One tick earlier.
    Tick,
}

/// Watches one loop. `N`: the samples' number; `S`: what is summed; `B`: most blocks per window (at most 64);
/// `C`: channels. The configuration is borrowed and may lie in flash.
///
/// Rounding: within 1e-6 relative of a direct sum for `f32` blocks of up to some thousand ticks, however long it
/// runs; sums of counts are exact.
#[derive(Debug, Clone)]
pub struct Monitor<'c, N: Number, S: IndexSet<N>, const B: usize, const C: usize> {
    config: &'c Config<N, C>,
    /// The open block's last few ticks, not yet joined.
    strip: S::Block,
    tick_in_block: u16,
    /// The tick of the block that needs a closer look than the usual one: the last of a strip or, unless the readings
    /// before are known and there are neither limits nor blanking, the next. Counted from 1.
    look_at: u16,
    /// The open block at place `open`, and round the end the closed ones, the newest before it: the block that a
    /// closed one would push out is not needed once the next is open.
    ring: Vec<S::Block, B, u8>,
    open: u8,
    /// Newest closed blocks in a row that had enough valid ticks, as far as 255.
    whole_run: u8,
    /// Ticks left out of the open block so far.
    left_out: u16,
    trace: S::Trace,
    blocks_to_hop: u16,
    link: Link,
    blank_ticks: u32,
    r_before: N,
    excluded: Excluded,
    hop: u32,
    channels: [ChannelState; C],
}

/// The paper's pair in one channel.
pub type PairMonitor<'c, N, J, const B: usize> = Monitor<'c, N, Pair<J>, B, 1>;

/// All indices, three channels.
pub type FullMonitor<'c, N, const B: usize> = Monitor<'c, N, Full, B, 3>;

impl<'c, N: Number, S: IndexSet<N>, const B: usize, const C: usize> Monitor<'c, N, S, B, C> {
    /// Ticks per strip, less one: a power of two near the root of the block's length, and at least 64 ticks: a
    /// shorter strip costs more ticks than it saves rounding.
    const fn strip_mask(block_ticks: u32) -> u32 {
        if N::EXACT {
            return u16::MAX as u32;
        }
        let half_bits = (33 - (block_ticks | 1).leading_zeros()) / 2;
        (1 << if half_bits > 6 { half_bits } else { 6 }) - 1
    }

    /// A monitor that has seen nothing yet.
    ///
    /// # Errors
    /// The configuration is impossible for this set and capacity.
    pub fn new(config: &'c Config<N, C>) -> Result<Self, ConfigError> {
        const { assert!(B > 0 && B <= 64, "a monitor has 1 to 64 blocks") };
        config.validate::<S>(B)?;
        Ok(Self {
            config,
            ring: Vec::from_array([S::EMPTY; B]),
            open: 0,
            whole_run: 0,
            strip: S::EMPTY,
            left_out: 0,
            trace: S::Trace::START,
            tick_in_block: 0,
            look_at: 1,
            blocks_to_hop: Self::first_hop(config),
            link: Link::None,
            blank_ticks: 0,
            r_before: N::ZERO,
            excluded: Excluded::NONE,
            hop: 0,
            channels: config
                .channels
                .each_ref()
                .map(|c| ChannelState { detectors: c.detectors.start(), course: Course::HEALTHY }),
        })
    }

    /// The configuration that it was started with.
    pub const fn config(&self) -> &'c Config<N, C> {
        self.config
    }

    /// One tick of the closed loop. `Some` once per hop, from the first full window on.
    ///
    /// Besides a hop: adds and compares only, no division, no square root, the same work every tick.
    #[inline(always)]
    pub fn tick(&mut self, r: N, y: N, u: N) -> Option<Report<C>> {
        // Two comparisons on most ticks; whatever else they can lead to is one call apart.
        let next = self.tick_in_block.wrapping_add(1);
        if next != self.look_at && N::surely_admissible(r, y, u) {
            let tick = u32::from(self.tick_in_block);
            self.tick_in_block = next;
            let step = Step { r, y, u, r_before: self.r_before, y_before: self.trace.y_before() };
            if S::KEEPS_EFFORT {
                self.r_before = r;
                self.trace.remember(y);
            }
            S::add(&mut self.strip, tick, &step);
            return None;
        }
        self.rare_tick(r, y, u)
    }

    /// A tick that ends a strip, or has to be looked at more closely.
    #[inline(never)]
    fn rare_tick(&mut self, r: N, y: N, u: N) -> Option<Report<C>> {
        match self.admit(r, y, u) {
            Ok(step) => S::add(&mut self.strip, u32::from(self.tick_in_block), &step),
            Err(why) => self.leave_out(why),
        }
        self.advance()
    }

    /// One tick of any kind.
    pub fn tick_input(&mut self, input: Input<N>) -> Option<Report<C>> {
        match input {
            Input::Sample { r, y, u } => self.tick(r, y, u),
            Input::Manual => {
                // The loop closes again anywhere: a step across the gap is none of its own.
                self.link = Link::None;
                self.blank_ticks = self.blank_ticks.saturating_sub(1);
                self.leave_out(Exclusion::Manual);
                self.advance()
            }
            Input::Missing => {
                self.miss();
                self.leave_out(Exclusion::Missing);
                self.advance()
            }
        }
    }

    /// Many ticks at once: the same, bit for bit, as one by one. Reads as many as the shortest slice has.
    pub fn ticks(&mut self, r: &[N], y: &[N], u: &[N], mut each: impl FnMut(&Report<C>)) {
        for ((&r, &y), &u) in r.iter().zip(y).zip(u) {
            if let Some(report) = self.tick(r, y, u) {
                each(&report);
            }
        }
    }

    /// The most severe of the channels' courses now: `Healthy`, `Suspect` or `Drift`. That a deviation ended
    /// ([`Verdict::Disturbance`], [`Verdict::Recovered`]) is said once, in the report.
    pub fn verdict(&self) -> Verdict {
        self.channels.iter().map(|c| c.course.verdict()).max().unwrap_or(Verdict::Healthy)
    }

    /// Forgets the open window, for a gap of unknown length; detectors and courses stay.
    pub fn restart_window(&mut self) {
        self.ring = Vec::from_array([S::EMPTY; B]);
        self.whole_run = 0;
        self.start_block();
        self.look_at = 1;
        self.blocks_to_hop = Self::first_hop(self.config);
        self.link = Link::None;
        self.blank_ticks = 0;
        self.excluded = Excluded::NONE;
    }

    /// Forgets alarms and courses, for a fault that was seen to; the window stays.
    pub fn acknowledge(&mut self) {
        for (state, channel) in self.channels.iter_mut().zip(&self.config.channels) {
            *state = ChannelState { detectors: channel.detectors.start(), course: Course::HEALTHY };
        }
    }

    fn admit(&mut self, r: N, y: N, u: N) -> Result<Step<N>, Exclusion> {
        if !(r.admissible() && y.admissible() && u.admissible()) {
            self.miss();
            return Err(refusal(r, y, u));
        }
        let (link, mut r_before, mut y_before) = (self.link, self.r_before, self.trace.y_before());
        (self.link, self.r_before) = (Link::Tick, r);
        self.trace.remember(y);
        if link == Link::None {
            r_before = r;
        }
        if let Some(blanking) = &self.config.blanking {
            if r.minus(r_before).magnitude() > blanking.reference_step {
                self.blank_ticks = blanking.ticks;
            }
            if self.blank_ticks > 0 {
                self.blank_ticks -= 1;
                return Err(Exclusion::Blanked);
            }
        }
        if self.config.saturation.as_ref().is_some_and(|s| u >= s.u_max || u <= s.u_min) {
            return Err(Exclusion::Saturated);
        }
        if link != Link::Tick {
            (r_before, y_before) = (r, y);
            self.trace.unpair();
        }
        Ok(Step { r, y, u, r_before, y_before })
    }

    /// A tick without a usable sample: time passes.
    fn miss(&mut self) {
        if self.link == Link::Tick {
            self.link = Link::Gap;
        }
        self.blank_ticks = self.blank_ticks.saturating_sub(1);
    }

    fn leave_out(&mut self, why: Exclusion) {
        self.excluded.count(why);
        self.left_out += 1;
        self.trace.leave_out(self.tick_in_block);
        S::pass(&mut self.strip);
    }

    /// To the next tick, which may begin a strip or a block.
    fn advance(&mut self) -> Option<Report<C>> {
        let end = Self::strip_end(self.config, self.tick_in_block);
        self.tick_in_block += 1;
        let ended = self.tick_in_block == end;
        let closes = u32::from(self.tick_in_block) >= self.config.block_ticks;
        if ended {
            self.join_strip();
        }
        if closes {
            self.tick_in_block = 0;
        }
        let guarded = self.config.saturation.is_some() || self.config.blanking.is_some();
        let usual = self.link == Link::Tick && !guarded;
        self.look_at = self.tick_in_block + 1;
        if usual {
            self.look_at = Self::strip_end(self.config, self.tick_in_block);
        }
        if closes { self.close_block() } else { None }
    }

    /// Where a strip that begins at `tick`, or holds it, ends.
    fn strip_end(config: &Config<N, C>, tick: u16) -> u16 {
        let end = (u32::from(tick) | Self::strip_mask(config.block_ticks)) + 1;
        end.min(config.block_ticks) as u16
    }

    /// Blocks to the first decision: whole hops, and a whole window.
    fn first_hop(config: &Config<N, C>) -> u16 {
        let (hop, window) = (config.hop_blocks.max(1), config.window_blocks);
        hop.saturating_mul(window.div_ceil(hop))
    }

    fn join_strip(&mut self) {
        if let Some(open) = self.ring.get_mut(usize::from(self.open)) {
            S::join(open, &self.strip, u32::from(self.tick_in_block));
        }
        self.strip = S::EMPTY;
    }

    /// Whatever stood in the open block's place goes.
    fn start_block(&mut self) {
        if let Some(open) = self.ring.get_mut(usize::from(self.open)) {
            *open = S::EMPTY;
        }
        self.strip = S::EMPTY;
        self.left_out = 0;
        self.trace.start_block();
        self.tick_in_block = 0;
    }

    #[inline(never)]
    fn close_block(&mut self) -> Option<Report<C>> {
        self.whole_run = self.whole_run.saturating_add(1);
        if self.left_out > 0 || self.trace.unpaired() > 0 {
            self.make_up();
        }
        self.blocks_to_hop = self.blocks_to_hop.saturating_sub(1);
        if self.blocks_to_hop > 0 {
            self.open_next();
            return None;
        }
        self.blocks_to_hop = self.config.hop_blocks;
        self.decide()
    }

    fn open_next(&mut self) {
        let next = self.open.wrapping_add(1);
        self.open = if usize::from(next) < B { next } else { 0 };
        self.start_block();
    }
    /// The open block as if it had no gaps; or leaves it out, if they are too many.
    fn make_up(&mut self) {
        let whole = self.config.block_ticks;
        let valid = whole.saturating_sub(u32::from(self.left_out));
        let paired = valid.saturating_sub(u32::from(self.trace.unpaired()));
        let Some(open) = self.ring.get_mut(usize::from(self.open)) else { return };
        if valid == whole || valid as f32 >= self.config.min_valid * whole as f32 {
            let time_left_out = self.trace.time_left_out();
            // As many pairs as ticks missing at random would leave.
            let least_paired = (self.config.min_valid * self.config.min_valid * whole as f32) as u32;
            let least_paired = if least_paired > 0 { least_paired } else { 1 };
            let coverage = Coverage { whole, valid, paired, least_paired, time_left_out };
            S::extrapolate(open, &coverage);
        } else {
            S::strike(open);
            self.whole_run = 0;
        }
    }

    /// Closes the window: judges it, and opens the next block.
    #[inline(never)]
    fn decide(&mut self) -> Option<Report<C>> {
        let config = self.config;
        let mut indices = Indices::NOT_KEPT;
        let valid = self.window(&mut indices);
        let mut channels = config.channels.each_ref().map(|channel| unjudged(channel.kind));
        let (mut verdict, mut location) = (Verdict::Healthy, Location::Nowhere);
        for ((state, channel), out) in self.channels.iter_mut().zip(&config.channels).zip(&mut channels) {
            state.judge(&config.decision, channel, valid.then_some(&indices), out);
            verdict = verdict.max(out.verdict);
            location = location.with(out);
        }
        let (hop, excluded) = (self.hop, self.excluded);
        self.open_next();
        self.hop = hop.wrapping_add(1);
        self.excluded = Excluded::NONE;
        let status = if valid { WindowStatus::Valid } else { WindowStatus::TooFewValid };
        // Put together only here: the pieces are short enough to be copied without a call.
        Some(Report { hop, status, verdict, location, channels, indices, excluded })
    }

    /// The window's blocks, oldest first: two stretches of the ring.
    fn window_blocks(&self) -> (&[S::Block], &[S::Block]) {
        let (end, blocks) = (usize::from(self.open) + 1, usize::from(self.config.window_blocks));
        let older = self.ring.get((B + end).saturating_sub(blocks)..).unwrap_or(&[]);
        (older, self.ring.get(end.saturating_sub(blocks)..end).unwrap_or(&[]))
    }

    /// Adds the window up into `total`; false, and nothing done, with too few valid blocks.
    #[inline(always)]
    fn window(&self, total: &mut Indices) -> bool {
        let blocks = u32::from(self.config.window_blocks);
        let (older, newer) = self.window_blocks();
        // A block left out is taken as the mean of the valid ones at its own place: `fill` scales the sums, and
        // for those that are weighted with time each valid block also stands at the places left out.
        let (mut valid, mut places_left_out) = (blocks, 0);
        if u32::from(self.whole_run) < blocks {
            for (place, block) in older.iter().chain(newer).enumerate() {
                if S::is_struck(block) {
                    valid -= 1;
                    places_left_out += place as u32;
                }
            }
            if valid == 0 || (valid as f32) < self.config.min_valid * blocks as f32 {
                return false;
            }
        }
        S::begin(total);
        let fill = blocks as f32 / valid as f32;
        let block_ticks = self.config.block_ticks as f32;
        let apart_ticks = block_ticks / fill;
        let mut begins_at = apart_ticks * (places_left_out as f32 / valid as f32);
        for part in [older, newer] {
            for block in part {
                if !S::is_struck(block) {
                    S::fold(total, block, begins_at);
                }
                begins_at += apart_ticks;
            }
        }
        let by = Scale {
            tick_s: self.config.sample_time_s,
            y_unit: self.config.y_unit,
            u_unit: self.config.u_unit,
            per_tick: 1.0 / (valid as f32 * block_ticks),
            fill,
        };
        S::scale(total, &by);
        true
    }
}

#[cfg(feature = "defmt")]
impl<N: Number, S: IndexSet<N>, const B: usize, const C: usize> defmt::Format for Monitor<'_, N, S, B, C> {
    /// Where it stands; the sums are no reading for a log.
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Monitor {{ hop: {}, verdict: {} }}", self.hop, self.verdict());
    }
}

/// Apart and cold: the tick path only asks whether, not why.
#[cold]
fn refusal<N: Number>(r: N, y: N, u: N) -> Exclusion {
    if r.non_finite() || y.non_finite() || u.non_finite() {
        Exclusion::NonFinite
    } else {
        Exclusion::OutOfRange
    }
}
