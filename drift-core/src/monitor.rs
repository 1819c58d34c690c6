//! The monitor: one sample in per tick, one report out per decision.
//!
//! Per tick a few sums grow; at the end of a block they enter a ring of closed blocks, and at a decision the ring
//! is added up anew. Nothing is ever subtracted, so nothing accumulates: after 1e8 ticks the indices are as exact
//! as after the first window.

use crate::channel::{Channel, ChannelKind, ChannelReport, FaultCurve};
use crate::config::{Blanking, Config, ConfigError};
use crate::course::{Course, Decision, Verdict};
use crate::detector::DetectorStates;
use crate::index::Indices;
use crate::index_set::{Full, IndexSet, Pair, Scale, Step};
use crate::number::Number;
use crate::report::{Location, Report, WindowStatus};
use crate::ring::Ring;
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
    // In the order in which the tick path meets them: short offsets are shorter instructions.
    config: &'c Config<N, C>,
    open: S::Block,
    /// Ticks until the open block closes.
    ticks_left: u16,
    /// Of the open block's ticks, those without a valid sample.
    passed: u16,
    blocks_to_hop: u16,
    /// What a tick must look at besides the limits of its number.
    checks: Checks,
    r_before: N,
    y_before: S::YBefore,
    blank_ticks: u32,
    excluded: Excluded,
    hop: u32,
    channels: [ChannelState; C],
    ring: Ring<S::Block, B>,
}

/// Bits, zero on most ticks of a loop without limits and blanking: one comparison on the tick path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Checks(u8);

impl Checks {
    /// No reading before this one: after a start, manual mode, a restarted window.
    const FIRST: u8 = 1;
    const SATURATION: u8 = 2;
    const BLANKING: u8 = 4;

    fn of<N, const C: usize>(config: &Config<N, C>) -> Self {
        let saturation = if config.saturation.is_some() { Self::SATURATION } else { 0 };
        let blanking = if config.blanking.is_some() { Self::BLANKING } else { 0 };
        Self(Self::FIRST | saturation | blanking)
    }
    fn has(self, bit: u8) -> bool {
        self.0 & bit != 0
    }
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
        Ok(Self::start(config))
    }

    /// For a valid configuration.
    fn start(config: &'c Config<N, C>) -> Self {
        Self {
            config,
            open: S::EMPTY,
            ticks_left: config.block_ticks as u16,
            passed: 0,
            blocks_to_hop: config.hop_blocks,
            checks: Checks::of(config),
            r_before: N::ZERO,
            y_before: S::YBefore::default(),
            blank_ticks: 0,
            excluded: Excluded::NONE,
            hop: 0,
            channels: config.channels.each_ref().map(ChannelState::start),
            ring: Ring::new(),
        }
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
        let left = self.ticks_left.wrapping_sub(1);
        if self.checks == Checks(0) && left != 0 && N::surely_admissible(r, y, u) {
            self.ticks_left = left;
            self.add(r, y, u);
            return None;
        }
        self.rare_tick(r, y, u)
    }

    /// A tick that closes its block, or has to be looked at more closely.
    #[inline(never)]
    fn rare_tick(&mut self, r: N, y: N, u: N) -> Option<Report<C>> {
        match self.examine(r, y, u) {
            None => self.add(r, y, u),
            Some(why) => self.pass(why),
        }
        self.advance()
    }

    #[inline(always)]
    fn add(&mut self, r: N, y: N, u: N) {
        let step = Step { r, y, u, r_before: self.r_before, y_before: S::y_before(&self.y_before) };
        if S::USES_BEFORE {
            self.remember(r, y);
        }
        S::add(&mut self.open, &step);
    }

    /// One tick of any kind.
    pub fn tick_input(&mut self, input: Input<N>) -> Option<Report<C>> {
        match input {
            Input::Sample { r, y, u } => return self.tick(r, y, u),
            Input::Manual => {
                // The loop reopens anywhere: a step across the gap is none of its own.
                self.checks.0 |= Checks::FIRST;
                self.pass(Exclusion::Manual);
            }
            Input::Missing => self.pass(Exclusion::Missing),
        }
        self.advance()
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
        self.ring = Ring::new();
        self.start_block();
        self.blocks_to_hop = self.config.hop_blocks;
        self.checks.0 |= Checks::FIRST;
        self.blank_ticks = 0;
        self.excluded = Excluded::NONE;
    }

    /// Forgets alarms and courses, for a fault that was seen to; the window stays.
    pub fn acknowledge(&mut self) {
        for (state, channel) in self.channels.iter_mut().zip(&self.config.channels) {
            *state = ChannelState::start(channel);
        }
    }

    /// Why a sample does not enter the sums, if so.
    fn examine(&mut self, r: N, y: N, u: N) -> Option<Exclusion> {
        if !(r.admissible() && y.admissible() && u.admissible()) {
            let non_finite = r.non_finite() || y.non_finite() || u.non_finite();
            return Some(if non_finite { Exclusion::NonFinite } else { Exclusion::OutOfRange });
        }
        if self.checks.has(Checks::FIRST) {
            self.checks.0 &= !Checks::FIRST;
            self.remember(r, y);
        }
        let why = match (&self.config.blanking, &self.config.saturation) {
            (Some(blanking), _) if self.blanked(blanking, r) => Exclusion::Blanked,
            (_, Some(limits)) if u >= limits.u_max || u <= limits.u_min => Exclusion::Saturated,
            _ => {
                // A set that uses the readings before still needs them for this tick.
                if !S::USES_BEFORE {
                    self.r_before = r;
                }
                return None;
            }
        };
        self.remember(r, y);
        Some(why)
    }

    fn blanked(&mut self, blanking: &Blanking<N>, r: N) -> bool {
        if r.minus(self.r_before).magnitude() > blanking.reference_step {
            self.blank_ticks = blanking.ticks;
        }
        let blanked = self.blank_ticks > 0;
        self.blank_ticks -= u32::from(blanked);
        blanked
    }

    #[inline(always)]
    fn remember(&mut self, r: N, y: N) {
        self.r_before = r;
        S::remember_y(&mut self.y_before, y);
    }

    /// A tick without a valid sample.
    fn pass(&mut self, why: Exclusion) {
        self.excluded.count(why);
        self.passed = self.passed.saturating_add(1);
        S::pass(&mut self.open);
    }

    fn advance(&mut self) -> Option<Report<C>> {
        self.ticks_left = self.ticks_left.wrapping_sub(1);
        if self.ticks_left == 0 { self.close_block() } else { None }
    }

    fn start_block(&mut self) {
        self.open = S::EMPTY;
        self.ticks_left = self.config.block_ticks as u16;
        self.passed = 0;
    }

    #[inline(never)]
    fn close_block(&mut self) -> Option<Report<C>> {
        if self.passed > 0 {
            self.make_up();
        }
        self.ring.write(self.open, self.config.window_blocks);
        self.start_block();
        self.blocks_to_hop = self.blocks_to_hop.saturating_sub(1);
        if self.blocks_to_hop > 0 {
            return None;
        }
        self.blocks_to_hop = self.config.hop_blocks;
        if self.ring.len() < usize::from(self.config.window_blocks) {
            return None;
        }
        Some(self.decide())
    }

    /// What a block lacks is made up in proportion; a block that lacks too much does not count.
    #[cold]
    fn make_up(&mut self) {
        let whole = self.config.block_ticks;
        let valid = whole.saturating_sub(u32::from(self.passed));
        if valid as f32 >= self.config.min_valid * whole as f32 {
            S::extrapolate(&mut self.open, valid, whole);
        } else {
            self.open = S::INVALID;
        }
    }

    #[inline(always)]
    fn decide(&mut self) -> Report<C> {
        let (indices, valid) = self.window();
        let (states, config) = (&mut self.channels, self.config);
        let mut report = Report {
            hop: self.hop,
            status: if valid { WindowStatus::Valid } else { WindowStatus::TooFewValid },
            verdict: Verdict::Healthy,
            location: Location::Nowhere,
            channels: core::array::from_fn(|i| match (states.get_mut(i), config.channels.get(i)) {
                (Some(state), Some(channel)) => state.judge(&config.decision, channel, &indices, valid),
                _ => ChannelReport::NONE,
            }),
            indices,
            excluded: self.excluded,
        };
        for channel in &report.channels {
            report.verdict = report.verdict.max(channel.verdict);
            report.location = report.location.with(channel);
        }
        self.hop = self.hop.wrapping_add(1);
        self.excluded = Excluded::NONE;
        report
    }

    /// Adds the ring up; false, and nothing kept, with too few valid blocks.
    #[inline(always)]
    fn window(&self) -> (Indices, bool) {
        let (blocks, block_ticks) = (self.config.window_blocks as f32, self.config.block_ticks as f32);
        let (mut total, mut valid, mut end_ticks) = (S::NO_BLOCK, 0.0, 0.0);
        self.ring.for_each(|block| {
            end_ticks += block_ticks;
            if S::is_valid(block) {
                S::fold(&mut total, block, end_ticks);
                valid += 1.0;
            }
        });
        let mut indices = Indices::NOT_KEPT;
        let enough = valid > 0.0 && valid >= self.config.min_valid * blocks;
        if enough {
            let by = Scale {
                tick_s: self.config.sample_time_s,
                y_unit: self.config.y_unit,
                u_unit: self.config.u_unit,
                per_tick: 1.0 / (valid * block_ticks),
                fill: blocks / valid,
            };
            S::scale(&total, &by, &mut indices);
        }
        (indices, enough)
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
            to.u16(self.ticks_left);
            to.u16(self.passed);
            to.u16(self.blocks_to_hop);
            to.u8(u8::from(self.checks.has(Checks::FIRST)));
            to.u32(self.blank_ticks);
            to.u32(self.r_before.to_word());
            to.u32(S::y_before(&self.y_before).to_word());
            self.excluded.as_array().into_iter().for_each(|n| to.u16(n));
            to.u32(self.hop);
            S::write(&self.open, to);
            self.ring.for_each(|block| S::write(block, to));
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
        let mut restored = Self::start(self.config);
        restored.read(&mut payload).ok_or(StateError::Impossible)?;
        if !payload.is_empty() {
            return Err(StateError::Impossible);
        }
        *self = restored;
        Ok(())
    }

    fn read(&mut self, from: &mut Reader<'_>) -> Option<()> {
        let blocks = usize::from(from.u16()?);
        self.ticks_left = from.u16()?;
        self.passed = from.u16()?;
        self.blocks_to_hop = from.u16()?;
        if from.u8()? == 0 {
            self.checks.0 &= !Checks::FIRST;
        }
        self.blank_ticks = from.u32()?;
        let before = (N::from_word(from.u32()?), N::from_word(from.u32()?));
        self.remember(before.0, before.1);
        let mut counts = [0u16; 6];
        for count in &mut counts {
            *count = from.u16()?;
        }
        self.excluded = Excluded::from_array(counts);
        self.hop = from.u32()?;
        self.open = S::read(from)?;
        for _ in 0..blocks {
            self.ring.write(S::read(from)?, self.config.window_blocks);
        }
        for channel in &mut self.channels {
            channel.detectors = DetectorStates::read(from)?;
            channel.course = Course::read(from)?;
        }
        let sane = blocks <= usize::from(self.config.window_blocks)
            && self.ticks_left > 0
            && u32::from(self.ticks_left) + u32::from(self.passed) <= self.config.block_ticks
            && (1..=self.config.hop_blocks).contains(&self.blocks_to_hop)
            && before.0.admissible()
            && before.1.admissible();
        sane.then_some(())
    }
}

impl ChannelState {
    fn start(channel: &Channel) -> Self {
        Self { detectors: channel.detectors.start(), course: Course::HEALTHY }
    }

    /// Feeds a valid window's residual to the detectors and the course; how the channel stands after it.
    #[inline(never)]
    fn judge(
        &mut self,
        decision: &Decision,
        channel: &Channel,
        indices: &Indices,
        valid: bool,
    ) -> ChannelReport {
        let baseline = &channel.baseline;
        let mut out = ChannelReport { kind: channel.kind, ..ChannelReport::NONE };
        let mut ended = None;
        if valid {
            (out.x, out.value) = channel.kind.coordinates(indices);
            let residual = baseline.residual(out.x, out.value);
            let z = baseline.standardise(out.x, residual);
            // Not learnt yet, or a unit that makes an index overflow: neither must poison the detectors.
            if baseline.learned() && z.is_finite() {
                (out.residual, out.z) = (residual, z);
                out.extrapolated = out.x < baseline.x_min || out.x > baseline.x_max;
                out.alarms = channel.detectors.update(&mut self.detectors, z);
                ended = self.course.update(decision, z, out.alarms.side(), out.x, out.value);
            }
        }
        out.detectors = self.detectors;
        out.verdict = ended.unwrap_or(self.course.verdict());
        out.side = self.course.side();
        out.fault_curve = self.course.drifted().map(|(line, windows)| FaultCurve::of(line, windows, baseline));
        out
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
