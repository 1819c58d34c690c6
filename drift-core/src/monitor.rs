//! The monitor: one sample in per tick, one report out per decision.
//!
//! Per tick a few sums grow; at the end of a block they enter a ring of closed blocks, and at a decision the ring
//! is added up anew. Nothing is ever subtracted, so nothing accumulates: after 1e8 ticks the indices are as exact
//! as after the first window.

use heapless::HistoryBuf;

use crate::channel::{Channel, ChannelKind, ChannelReport, FaultCurve};
use crate::config::{Config, ConfigError};
use crate::course::{Course, Verdict};
use crate::detector::{Alarms, DetectorStates};
use crate::index::Indices;
use crate::index_set::{Full, IndexSet, Pair, Scale, Step};
use crate::number::Number;
use crate::report::{Location, Report, WindowStatus};
use crate::sample::{Excluded, Exclusion, Input};
use crate::store::{CHECKSUM_BYTES, HEADER_BYTES, Owner, Reader, StateError, Writer};

/// What one channel remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ChannelState {
    detectors: DetectorStates,
    course: Course,
}

/// Watches one loop. `N`: the samples' number; `S`: what is summed; `B`: most blocks per window (at most 64);
/// `C`: channels. The configuration is borrowed and may lie in flash.
#[derive(Debug, Clone)]
pub struct Monitor<'c, N: Number, S: IndexSet<N>, const B: usize, const C: usize> {
    config: &'c Config<N, C>,
    ring: HistoryBuf<S::Block, B>,
    /// Bit i: the i-th newest block in the ring had enough valid ticks.
    valid_blocks: u64,
    open: S::Block,
    tick_in_block: u32,
    valid_in_block: u32,
    blocks_to_hop: u16,
    blank_ticks: u32,
    before: Option<(N, N)>,
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
    pub const STATE_BYTES: usize =
        HEADER_BYTES + CHECKSUM_BYTES + 64 + (B + 1) * 2 * size_of::<S::Block>() + C * 52;

    /// A monitor that has seen nothing yet.
    ///
    /// # Errors
    /// The configuration is impossible for this set and capacity.
    pub fn new(config: &'c Config<N, C>) -> Result<Self, ConfigError> {
        const { assert!(B > 0 && B <= 64, "a monitor has 1 to 64 blocks") };
        config.validate::<S>(B)?;
        Ok(Self {
            config,
            ring: HistoryBuf::new(),
            valid_blocks: 0,
            open: S::EMPTY,
            tick_in_block: 0,
            valid_in_block: 0,
            blocks_to_hop: config.hop_blocks,
            blank_ticks: 0,
            before: None,
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
    #[inline]
    pub fn tick(&mut self, r: N, y: N, u: N) -> Option<Report<C>> {
        match self.admit(r, y, u) {
            Ok(step) => {
                S::add(&mut self.open, self.tick_in_block, &step);
                self.valid_in_block += 1;
            }
            Err(why) => self.excluded.count(why),
        }
        self.advance()
    }

    /// One tick of any kind.
    pub fn tick_input(&mut self, input: Input<N>) -> Option<Report<C>> {
        match input {
            Input::Sample { r, y, u } => self.tick(r, y, u),
            Input::Manual => {
                // The loop reopens anywhere: a step across the gap is none of its own.
                self.before = None;
                self.excluded.count(Exclusion::Manual);
                self.advance()
            }
            Input::Missing => {
                self.excluded.count(Exclusion::Missing);
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

    /// The most severe verdict of the last decision's courses.
    pub fn verdict(&self) -> Verdict {
        self.channels.iter().map(|c| c.course.verdict()).max().unwrap_or(Verdict::Healthy)
    }

    /// Forgets the open window, for a gap of unknown length; detectors and courses stay.
    pub fn restart_window(&mut self) {
        self.ring = HistoryBuf::new();
        self.valid_blocks = 0;
        self.start_block();
        self.blocks_to_hop = self.config.hop_blocks;
        self.before = None;
        self.blank_ticks = 0;
        self.excluded = Excluded::NONE;
    }

    /// Forgets alarms and courses, for a fault that was seen to; the window stays.
    pub fn acknowledge(&mut self) {
        for (state, channel) in self.channels.iter_mut().zip(&self.config.channels) {
            *state = ChannelState { detectors: channel.detectors.start(), course: Course::HEALTHY };
        }
    }

    #[inline(always)]
    fn admit(&mut self, r: N, y: N, u: N) -> Result<Step<N>, Exclusion> {
        if !(r.admissible() && y.admissible() && u.admissible()) {
            return Err(refusal(r, y, u));
        }
        let (r_before, y_before) = self.before.replace((r, y)).unwrap_or((r, y));
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
        Ok(Step { r, y, u, r_before, y_before })
    }

    #[inline(always)]
    fn advance(&mut self) -> Option<Report<C>> {
        self.tick_in_block += 1;
        if self.tick_in_block < self.config.block_ticks { None } else { self.close_block() }
    }

    fn start_block(&mut self) {
        self.open = S::EMPTY;
        self.tick_in_block = 0;
        self.valid_in_block = 0;
    }

    fn close_block(&mut self) -> Option<Report<C>> {
        let (valid, whole) = (self.valid_in_block, self.tick_in_block);
        let enough = valid == whole || valid as f32 >= self.config.min_valid * whole as f32;
        if enough && valid < whole {
            S::extrapolate(&mut self.open, valid, whole);
        }
        self.ring.write(self.open);
        self.valid_blocks = (self.valid_blocks << 1) | u64::from(enough);
        self.start_block();
        self.blocks_to_hop = self.blocks_to_hop.saturating_sub(1);
        if self.blocks_to_hop > 0 {
            return None;
        }
        self.blocks_to_hop = self.config.hop_blocks;
        (self.ring.len() >= usize::from(self.config.window_blocks)).then(|| self.decide())
    }

    #[inline(never)]
    fn decide(&mut self) -> Report<C> {
        let indices = self.window();
        let mut report = Report {
            hop: self.hop,
            status: if indices.is_some() { WindowStatus::Valid } else { WindowStatus::TooFewValid },
            verdict: Verdict::Healthy,
            location: Location::Nowhere,
            indices: indices.unwrap_or(Indices::NOT_KEPT),
            excluded: self.excluded,
            channels: self.config.channels.each_ref().map(|c| unjudged(c.kind)),
        };
        for ((state, channel), out) in
            self.channels.iter_mut().zip(&self.config.channels).zip(&mut report.channels)
        {
            *out = state.judge(self.config, channel, indices.as_ref());
            report.verdict = report.verdict.max(out.verdict);
            report.location = report.location.with(out);
        }
        self.hop = self.hop.wrapping_add(1);
        self.excluded = Excluded::NONE;
        report
    }

    /// Adds the ring up; `None` with too few valid blocks.
    fn window(&self) -> Option<Indices> {
        let blocks = usize::from(self.config.window_blocks);
        let mut total = Indices::NOT_KEPT;
        S::begin(&mut total);
        let mut valid = 0u32;
        let older = self.ring.len().saturating_sub(blocks);
        let mut offset_ticks = 0.0;
        for (position, block) in self.ring.oldest_ordered().skip(older).enumerate() {
            let age = blocks.saturating_sub(1 + position) as u32;
            if self.valid_blocks.wrapping_shr(age) & 1 == 1 {
                S::fold(&mut total, block, offset_ticks);
                valid += 1;
            }
            offset_ticks += self.config.block_ticks as f32;
        }
        if valid == 0 || (valid as f32) < self.config.min_valid * blocks as f32 {
            return None;
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
            to.u32(self.tick_in_block);
            to.u32(self.valid_in_block);
            to.u16(self.blocks_to_hop);
            to.u32(self.blank_ticks);
            to.u8(u8::from(self.before.is_some()));
            let (r, y) = self.before.unwrap_or((N::ZERO, N::ZERO));
            to.u32(r.to_word());
            to.u32(y.to_word());
            self.excluded.as_array().into_iter().for_each(|n| to.u16(n));
            to.u32(self.hop);
            S::write(&self.open, to);
            self.ring.oldest_ordered().for_each(|block| S::write(block, to));
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
        self.tick_in_block = from.u32()?;
        self.valid_in_block = from.u32()?;
        self.blocks_to_hop = from.u16()?;
        self.blank_ticks = from.u32()?;
        let known = from.u8()? == 1;
        let before = (N::from_word(from.u32()?), N::from_word(from.u32()?));
        self.before = known.then_some(before);
        let mut counts = [0u16; 6];
        for count in &mut counts {
            *count = from.u16()?;
        }
        self.excluded = Excluded::from_array(counts);
        self.hop = from.u32()?;
        self.open = S::read(from)?;
        for _ in 0..blocks {
            self.ring.write(S::read(from)?);
        }
        for channel in &mut self.channels {
            channel.detectors = DetectorStates::read(from)?;
            channel.course = Course::read(from)?;
        }
        let sane = blocks <= B
            && self.tick_in_block < self.config.block_ticks
            && self.valid_in_block <= self.tick_in_block
            && (1..=self.config.hop_blocks).contains(&self.blocks_to_hop)
            && before.0.admissible()
            && before.1.admissible();
        sane.then_some(())
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
    fn judge<N: Number, const C: usize>(
        &mut self,
        config: &Config<N, C>,
        channel: &Channel,
        indices: Option<&Indices>,
    ) -> ChannelReport {
        let mut out = unjudged(channel.kind);
        out.verdict = self.course.verdict();
        if let Some(indices) = indices {
            (out.x, out.value) = channel.kind.coordinates(indices);
            if channel.baseline.learned() {
                self.judge_residual(config, channel, &mut out);
            }
        }
        out.detectors = self.detectors;
        out.side = self.course.side();
        out.fault_curve = self.course.drifted().map(|fit| FaultCurve::of(fit, &channel.baseline));
        out
    }

    fn judge_residual<N: Number, const C: usize>(
        &mut self,
        config: &Config<N, C>,
        channel: &Channel,
        out: &mut ChannelReport,
    ) {
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
        out.verdict = self.course.update(&config.decision, z, out.alarms.side(), out.x, out.value);
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
