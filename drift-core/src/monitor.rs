//! The monitor: one sample in per tick, one report out per decision.
//!
//! Per tick a few sums grow; at the end of a block they enter a ring of closed blocks, and at a decision the ring
//! is added up anew. Nothing is ever subtracted, so nothing accumulates: after 1e8 ticks the indices are as exact
//! as after the first window. Within a block, strips of about the square root of its length are summed apart and
//! then joined, so that a long block of small samples does not round more than a short one.

use heapless::Vec;

use crate::channel::{Channel, ChannelKind, ChannelReport, FaultCurve};
use crate::config::{Config, ConfigError};
use crate::course::{COURSE_BYTES, Course, Decision, Verdict};
use crate::detector::{Alarms, DETECTOR_BYTES, DetectorStates};
use crate::index::Indices;
use crate::index_set::{Coverage, Full, IndexSet, Pair, Scale, Step};
use crate::number::Number;
use crate::report::{Location, Report, WindowStatus};
use crate::sample::{Excluded, Exclusion, Input};
use crate::store::{CHECKSUM_BYTES, HEADER_BYTES, Owner, Reader, StateError, Writer};

/// Saved numbers besides header, blocks and channels.
const FIXED_BYTES: usize = 51;

/// What one channel remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ChannelState {
    detectors: DetectorStates,
    course: Course,
}

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
    /// Ticks in the block at which the strip, or the block, ends.
    strip_end: u16,
    /// The next tick needs no closer look unless its sample is bad: the readings before are known, there are no
    /// limits and no blanking.
    usual: bool,
    /// Closed blocks; once it is full, `oldest` is overwritten. (heapless' own history buffer indexes with a bounds
    /// check, and with it a panic, that the compiler can't remove.)
    ring: Vec<S::Block, B, u8>,
    oldest: u8,
    /// Bit i: the i-th newest block in the ring had enough valid ticks.
    valid_blocks: u64,
    open: S::Block,
    /// Ticks left out of the open block so far, and the sum of their positions in it.
    left_out: u16,
    time_left_out: u32,
    /// Valid ticks of the open block whose predecessor is not known.
    unpaired: u16,
    blocks_to_hop: u16,
    link: Link,
    blank_ticks: u32,
    r_before: N,
    y_before: N,
    excluded: Excluded,
    hop: u32,
    channels: [ChannelState; C],
}

/// The paper's pair in one channel.
pub type PairMonitor<'c, N, J, const B: usize> = Monitor<'c, N, Pair<J>, B, 1>;

/// All indices, three channels.
pub type FullMonitor<'c, N, const B: usize> = Monitor<'c, N, Full, B, 3>;

impl<'c, N: Number, S: IndexSet<N>, const B: usize, const C: usize> Monitor<'c, N, S, B, C> {
    /// Bytes that [`Monitor::save`] needs at most.
    pub const STATE_BYTES: usize = HEADER_BYTES
        + FIXED_BYTES
        + (B + 2) * size_of::<S::Block>()
        + C * (DETECTOR_BYTES + COURSE_BYTES)
        + CHECKSUM_BYTES;

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
            ring: Vec::new(),
            oldest: 0,
            valid_blocks: 0,
            open: S::EMPTY,
            strip: S::EMPTY,
            left_out: 0,
            time_left_out: 0,
            unpaired: 0,
            tick_in_block: 0,
            strip_end: Self::strip_end(config, 0),
            usual: false,
            blocks_to_hop: config.hop_blocks,
            link: Link::None,
            blank_ticks: 0,
            r_before: N::ZERO,
            y_before: N::ZERO,
            excluded: Excluded::NONE,
            hop: 0,
            channels: config
                .channels
                .each_ref()
                .map(|c| ChannelState { detectors: c.detectors.start(), course: Course::HEALTHY }),
        })
    }

    /// The configuration.
    pub const fn config(&self) -> &'c Config<N, C> {
        self.config
    }

    /// One tick of the closed loop. `Some` once per hop, from the first full window on.
    ///
    /// Besides a hop: adds and compares only, no division, no square root, the same work every tick.
    #[inline(always)]
    pub fn tick(&mut self, r: N, y: N, u: N) -> Option<Report<C>> {
        // Three comparisons on most ticks; whatever else they can lead to is one call apart.
        let next = self.tick_in_block.wrapping_add(1);
        if self.usual && next != self.strip_end && N::surely_admissible(r, y, u) {
            let tick = u32::from(self.tick_in_block);
            self.tick_in_block = next;
            let step = Step { r, y, u, r_before: self.r_before, y_before: self.y_before };
            if S::KEEPS_EFFORT {
                (self.r_before, self.y_before) = (r, y);
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
        let guarded = self.config.saturation.is_some() || self.config.blanking.is_some();
        self.usual = self.link == Link::Tick && !guarded;
        self.advance()
    }

    /// One tick of any kind.
    pub fn tick_input(&mut self, input: Input<N>) -> Option<Report<C>> {
        match input {
            Input::Sample { r, y, u } => self.tick(r, y, u),
            Input::Manual => {
                // The loop closes again anywhere: a step across the gap is none of its own.
                self.link = Link::None;
                self.usual = false;
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
        self.ring.clear();
        self.oldest = 0;
        self.valid_blocks = 0;
        self.start_block();
        self.blocks_to_hop = self.config.hop_blocks;
        self.link = Link::None;
        self.usual = false;
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
        let (link, mut r_before, mut y_before) = (self.link, self.r_before, self.y_before);
        (self.link, self.r_before, self.y_before) = (Link::Tick, r, y);
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
            self.unpaired += 1;
        }
        Ok(Step { r, y, u, r_before, y_before })
    }

    /// A tick without a usable sample: time passes.
    fn miss(&mut self) {
        self.usual = false;
        if self.link == Link::Tick {
            self.link = Link::Gap;
        }
        self.blank_ticks = self.blank_ticks.saturating_sub(1);
    }

    fn leave_out(&mut self, why: Exclusion) {
        self.excluded.count(why);
        self.left_out += 1;
        self.time_left_out += u32::from(self.tick_in_block);
        S::pass(&mut self.strip);
    }

    fn advance(&mut self) -> Option<Report<C>> {
        self.tick_in_block += 1;
        if self.tick_in_block != self.strip_end {
            return None;
        }
        self.join_strip();
        if u32::from(self.tick_in_block) >= self.config.block_ticks {
            return self.close_block();
        }
        self.strip_end = Self::strip_end(self.config, self.tick_in_block);
        None
    }

    /// Where a strip that begins at `tick` ends.
    fn strip_end(config: &Config<N, C>, tick: u16) -> u16 {
        let end = (u32::from(tick) | Self::strip_mask(config.block_ticks)) + 1;
        end.min(config.block_ticks) as u16
    }

    fn join_strip(&mut self) {
        S::join(&mut self.open, &self.strip, u32::from(self.tick_in_block));
        self.strip = S::EMPTY;
    }

    fn start_block(&mut self) {
        self.open = S::EMPTY;
        self.strip = S::EMPTY;
        self.left_out = 0;
        self.time_left_out = 0;
        self.unpaired = 0;
        self.tick_in_block = 0;
        self.strip_end = Self::strip_end(self.config, 0);
    }

    fn store(&mut self, block: S::Block) {
        let Err(block) = self.ring.push(block) else { return };
        if let Some(oldest) = self.ring.get_mut(usize::from(self.oldest)) {
            *oldest = block;
        }
        let next = self.oldest.wrapping_add(1);
        self.oldest = if usize::from(next) < B { next } else { 0 };
    }

    /// The stored blocks, oldest first.
    fn stored(&self) -> impl Iterator<Item = &S::Block> {
        let oldest = usize::from(self.oldest);
        self.ring.iter().skip(oldest).chain(self.ring.iter().take(oldest))
    }

    #[inline(never)]
    fn close_block(&mut self) -> Option<Report<C>> {
        let whole = self.config.block_ticks;
        let valid = whole.saturating_sub(u32::from(self.left_out));
        let paired = valid.saturating_sub(u32::from(self.unpaired));
        let enough = valid == whole || valid as f32 >= self.config.min_valid * whole as f32;
        if enough && paired < whole {
            let coverage = Coverage { whole, valid, paired, time_left_out: self.time_left_out };
            S::extrapolate(&mut self.open, &coverage);
        }
        self.store(self.open);
        self.valid_blocks = (self.valid_blocks << 1) | u64::from(enough);
        self.start_block();
        self.blocks_to_hop = self.blocks_to_hop.saturating_sub(1);
        if self.blocks_to_hop > 0 {
            return None;
        }
        self.blocks_to_hop = self.config.hop_blocks;
        if self.ring.len() < usize::from(self.config.window_blocks) {
            return None;
        }
        self.decide()
    }

    #[inline(always)]
    fn decide(&mut self) -> Option<Report<C>> {
        let indices = self.window();
        let (states, config) = (&mut self.channels, self.config);
        // In its place from the start: the report is copied nowhere.
        let mut decided = Some(Report {
            hop: self.hop,
            status: if indices.is_some() { WindowStatus::Valid } else { WindowStatus::TooFewValid },
            verdict: Verdict::Healthy,
            location: Location::Nowhere,
            channels: core::array::from_fn(|i| match (states.get_mut(i), config.channels.get(i)) {
                (Some(state), Some(channel)) => state.judge(&config.decision, channel, indices.as_ref()),
                _ => unjudged(ChannelKind::Effort),
            }),
            indices: indices.unwrap_or(Indices::NOT_KEPT),
            excluded: self.excluded,
        });
        if let Some(report) = &mut decided {
            for channel in &report.channels {
                report.verdict = report.verdict.max(channel.verdict);
                report.location = report.location.with(channel);
            }
        }
        self.hop = self.hop.wrapping_add(1);
        self.excluded = Excluded::NONE;
        decided
    }

    /// Adds the ring up; `None` with too few valid blocks.
    fn window(&self) -> Option<Indices> {
        let blocks = u32::from(self.config.window_blocks);
        let block_is_valid =
            |place: u32| self.valid_blocks.wrapping_shr(blocks.saturating_sub(1 + place)) & 1 == 1;
        // The bits of the window's blocks; `blocks` is 1 to 64.
        let window_bits = self.valid_blocks & (u64::MAX >> (64 - blocks.clamp(1, 64)));
        let valid = window_bits.count_ones();
        if valid == 0 || (valid as f32) < self.config.min_valid * blocks as f32 {
            return None;
        }
        // A block left out is taken as the mean of the valid ones at its own place: `fill` scales the sums, and
        // for those that are weighted with time each valid block also stands at the places left out.
        let places_left_out: u32 =
            if valid == blocks { 0 } else { (0..blocks).filter(|&place| !block_is_valid(place)).sum() };
        let offset_ticks = |place: u32| {
            let stands_at = if valid == blocks {
                place as f32
            } else {
                (valid * place + places_left_out) as f32 / blocks as f32
            };
            stands_at * self.config.block_ticks as f32
        };
        let mut total = Indices::NOT_KEPT;
        S::begin(&mut total);
        let older = self.ring.len().saturating_sub(blocks as usize);
        let (newer, oldest) = self.ring.split_at_checked(usize::from(self.oldest)).unwrap_or((&[], &[]));
        let mut place = 0;
        let mut skip = older;
        for part in [oldest, newer] {
            for block in part {
                if skip > 0 {
                    skip -= 1;
                    continue;
                }
                if valid == blocks || block_is_valid(place) {
                    S::fold(&mut total, block, offset_ticks(place));
                }
                place += 1;
            }
        }
        let by = Scale {
            tick_s: self.config.sample_time_s,
            y_unit: self.config.y_unit,
            u_unit: self.config.u_unit,
            per_tick: 1.0 / (valid as f32 * self.config.block_ticks as f32),
            fill: blocks as f32 / valid as f32,
        };
        S::scale(&mut total, &by);
        Some(total)
    }

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
            to.u16(self.ring.len() as u16);
            to.u64(self.valid_blocks);
            to.u16(self.tick_in_block);
            to.u16(self.left_out);
            to.u32(self.time_left_out);
            to.u16(self.unpaired);
            to.u16(self.blocks_to_hop);
            to.u32(self.blank_ticks);
            to.u8(self.link as u8);
            to.u32(self.r_before.to_word());
            to.u32(self.y_before.to_word());
            self.excluded.as_array().into_iter().for_each(|n| to.u16(n));
            to.u32(self.hop);
            S::write(&self.open, to);
            S::write(&self.strip, to);
            self.stored().for_each(|block| S::write(block, to));
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
        let blocks = usize::from(from.u16()?);
        self.valid_blocks = from.u64()?;
        self.tick_in_block = from.u16()?;
        self.strip_end = Self::strip_end(self.config, self.tick_in_block);
        self.left_out = from.u16()?;
        self.time_left_out = from.u32()?;
        self.unpaired = from.u16()?;
        self.blocks_to_hop = from.u16()?;
        self.blank_ticks = from.u32()?;
        self.link = match from.u8()? {
            0 => Link::None,
            1 => Link::Gap,
            2 => Link::Tick,
            _ => return None,
        };
        self.r_before = N::from_word(from.u32()?);
        self.y_before = N::from_word(from.u32()?);
        let mut counts = [0u16; 6];
        for count in &mut counts {
            *count = from.u16()?;
        }
        self.excluded = Excluded::from_array(counts);
        self.hop = from.u32()?;
        self.open = S::read(from)?;
        self.strip = S::read(from)?;
        if blocks > B {
            return None;
        }
        for _ in 0..blocks {
            self.store(S::read(from)?);
        }
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
            && left_out + u32::from(self.unpaired) <= u32::from(self.tick_in_block)
            && self.time_left_out <= left_out * u32::from(self.tick_in_block)
            && (1..=self.config.hop_blocks).contains(&self.blocks_to_hop)
            && self.blank_ticks <= self.config.blanking.as_ref().map_or(0, |b| b.ticks)
            && self.r_before.admissible()
            && self.y_before.admissible()
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

fn unjudged(kind: ChannelKind) -> ChannelReport {
    ChannelReport {
        kind,
        x: f32::NAN,
        value: f32::NAN,
        residual: f32::NAN,
        z: f32::NAN,
        extrapolated: false,
        detectors: DetectorStates {
            cusum: crate::detector::CusumState::ZERO,
            sprt: crate::detector::SprtState::ZERO,
        },
        alarms: Alarms::NONE,
        verdict: Verdict::Healthy,
        side: None,
        fault_curve: None,
    }
}

impl ChannelState {
    #[inline(never)]
    fn judge(&mut self, decision: &Decision, channel: &Channel, indices: Option<&Indices>) -> ChannelReport {
        let mut out = unjudged(channel.kind);
        out.verdict = self.course.verdict();
        if let Some(indices) = indices {
            (out.x, out.value) = channel.kind.coordinates(indices);
            if channel.baseline.learned() {
                self.judge_residual(decision, channel, &mut out);
            }
        }
        out.detectors = self.detectors;
        out.side = self.course.side();
        out.fault_curve = self.course.drifted().map(|fit| FaultCurve::of(fit, &channel.baseline));
        out
    }

    fn judge_residual(&mut self, decision: &Decision, channel: &Channel, out: &mut ChannelReport) {
        let residual = channel.baseline.residual(out.x, out.value);
        let z = channel.baseline.standardise(out.x, residual);
        // A unit that makes an index overflow must not poison the detectors.
        if !z.is_finite() {
            return;
        }
        out.residual = residual;
        out.z = z;
        out.extrapolated = out.x < channel.baseline.x_min || out.x > channel.baseline.x_max;
        out.alarms = channel.detectors.update(&mut self.detectors, z);
        out.verdict = self.course.update(decision, z, out.alarms.side(), out.x, out.value);
    }
}

impl Location {
    fn with(self, channel: &ChannelReport) -> Self {
        if channel.side.is_none() {
            return self;
        }
        let here = match channel.kind {
            ChannelKind::EnergyError(_) => Self::Tracking,
            ChannelKind::Effort => Self::OperatingPoint,
            ChannelKind::MotionEffort => Self::Friction,
            ChannelKind::Activity => Self::Dynamics,
        };
        match self {
            Self::Nowhere => here,
            same if same == here => same,
            _ => Self::Several,
        }
    }
}
