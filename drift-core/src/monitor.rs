//! The monitor: one sample in per tick, one report out per decision.
//!
//! Per tick a few sums grow; at the end of a block they are added to the window, and at a decision the window is
//! judged. Nothing is ever subtracted, so nothing accumulates: after 1e8 ticks the indices are as exact as after the
//! first window. Within a block of floats, strips of [`STRIP_TICKS`] ticks are summed apart and then joined with a carry,
//! so that a long block does not round more than a short one.

mod channel_state;
mod decide;
mod saved_state;
mod strips;
mod whole;

pub use self::whole::{FullMonitor, Monitor, PairMonitor};

use self::channel_state::ChannelState;
use crate::blanking::{BlankingKind, BlankingState};
use crate::channel::ChannelReport;
use crate::config::{Config, ConfigError};
use crate::course::{Curve, Verdict};
use crate::detector::DetectorSet;
use crate::index_set::{IndexSet, Row, Step};
use crate::number::Number;
use crate::options::Options;
use crate::report::{Report, WindowStatus};
use crate::sample::{Exclusion, Exclusions, Input};
use crate::trace::Trace;
use crate::window::{Blocks, WindowKind};

/// Ticks of floats that are summed before they are joined to the block, a power of two. A constant signal rounds the
/// same way at every addition: 32 of them are off by 6e-7 at worst.
pub const STRIP_TICKS: u16 = 32;

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

/// What a monitor with these parts reports.
pub type ReportOf<N, S, O, const C: usize> = Report<
    C,
    <S as IndexSet<N>>::Indices,
    <O as Options>::Excluded,
    ChannelReport<<<O as Options>::Detectors as DetectorSet>::Shown, <<O as Options>::Curve as Curve>::Shown>,
>;

/// A checked configuration: what a monitor is, apart from what it remembers. May be a `static` in flash; one plan can
/// serve many loops.
///
/// ```
/// use drift_core::{
///     Baseline, Channel, ChannelKind, Config, ConfigError, Cusum, Detectors, Iae, Index, Pair, Plan, Smallest,
/// };
/// const CUSUM: Detectors = Detectors { cusum: Some(Cusum::new(0.5, 5.07)), ..Detectors::NONE };
/// const PAIR: Channel =
///     Channel::new(ChannelKind::EnergyError(Index::Iae), Baseline::known(0.0, 1.0, 0.1), CUSUM);
/// /// Checked by the compiler.
/// static PLAN: Plan<f32, Pair<Iae>, Smallest> = match Plan::<f32, _, _>::new(Config::new(0.001, 250, 12, [PAIR])) {
///     Ok(plan) => plan,
///     Err(_) => panic!("an impossible configuration"),
/// };
/// let mut state = PLAN.start();
/// let decisions = (0..9_000).filter(|_| PLAN.tick(&mut state, 1.0, 0.0, 1.0).is_some()).count();
/// assert_eq!(decisions, 3);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Plan<N: Number, S: IndexSet<N>, O: Options, const C: usize = 1> {
    config: Config<N, C>,
    /// u is in control strictly between these.
    u_above: N,
    u_below: N,
    /// A larger change of r is a step.
    step: N,
    parts: core::marker::PhantomData<fn() -> (S, O)>,
}

/// What a monitor remembers. What every tick touches comes first: a Cortex-M0 reaches no further in one instruction.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct State<N: Number, S: IndexSet<N>, O: Options, const C: usize = 1> {
    /// First of all: two readings that lie at the state's own address are stored by one instruction.
    trace: S::Trace,
    /// The open strip.
    sums: S::Sums,
    // The order of these two: from the first place of a word a host's compiler loads the whole word, which waits until the half that
    // the tick before wrote has left the store buffer. On a controller the other order is the shorter code.
    /// The tick of the block that needs a closer look than the usual one: the last of a strip or, unless the readings
    /// before are known, the next. Counted from 0.
    #[cfg(target_pointer_width = "64")]
    look_at: u16,
    tick_in_block: u16,
    /// As above.
    #[cfg(not(target_pointer_width = "64"))]
    look_at: u16,
    blanking: <O::Blanking as BlankingKind>::State<N>,
    peaks: S::Peaks,
    /// The operating point of the tick, held until the next one.
    point: S::Point,
    /// Ticks left out of the open block so far.
    left_out: u16,
    blocks_to_hop: u16,
    /// The open block's strips.
    joined: S::Joined,
    /// The closed blocks.
    window: <O::Window as WindowKind>::Blocks<S::Closed, S::Placed>,
    channels: [ChannelState<O>; C],
    report: ReportOf<N, S, O, C>,
    link: Link,
    /// The report's count of ticks left out is that of the last decision.
    counted: bool,
}

macro_rules! plan_of {
    ($number:ty) => {
        impl<S: IndexSet<$number>, O: Options, const C: usize> Plan<$number, S, O, C> {
            /// Checks a configuration.
            ///
            /// # Errors
            /// The first field that is impossible for this set and these options.
            pub const fn new(config: Config<$number, C>) -> Result<Self, ConfigError> {
                if let Err(error) = config.check::<S, O>() {
                    return Err(error);
                }
                let (mut u_above, mut u_below) = (<$number as Number>::LOWEST, <$number as Number>::HIGHEST);
                let mut step = <$number as Number>::HIGHEST;
                if let Some(limits) = &config.saturation {
                    let most = <$number as Number>::LIMIT;
                    let (low, high) = (limits.u_min, limits.u_max);
                    // So put that a NaN is refused.
                    if !(low >= -most && low < high && high <= most) {
                        return Err(ConfigError::InvertedRange("saturation"));
                    }
                    (u_above, u_below) = (low, high);
                }
                if let Some(blanking) = &config.blanking {
                    step = blanking.reference_step;
                    if !(step >= <$number as Number>::ZERO && step <= <$number as Number>::LIMIT) {
                        return Err(ConfigError::OutOfRange("blanking.reference_step"));
                    }
                }
                Ok(Self { config, u_above, u_below, step, parts: core::marker::PhantomData })
            }
        }
    };
}
plan_of!(f32);
plan_of!(i32);

impl<N: Number, S: IndexSet<N>, O: Options, const C: usize> Plan<N, S, O, C> {
    /// The configuration.
    pub const fn config(&self) -> &Config<N, C> {
        &self.config
    }

    /// The state of a monitor that has seen nothing yet.
    pub fn start(&self) -> State<N, S, O, C> {
        let mut state = State {
            sums: S::NO_SUMS,
            peaks: S::NO_PEAKS,
            // Not admissible: no tick counts before the operating point is told.
            point: S::Point::filled(N::LOWEST),
            joined: S::NO_STRIPS,
            window: Blocks::none(),
            trace: S::Trace::START,
            blanking: BlankingState::START,
            channels: Self::FRESH,
            report: Report {
                hop: u32::MAX,
                status: WindowStatus::TooFewValid,
                verdict: Verdict::Healthy,
                indices: S::NO_INDICES,
                excluded: O::Excluded::NONE,
                channels: Self::UNJUDGED,
            },
            tick_in_block: 0,
            look_at: 0,
            left_out: 0,
            blocks_to_hop: self.first_hop(),
            link: Link::None,
            counted: false,
        };
        // Written in place: an array that is mapped would be copied.
        for ((state, report), channel) in
            state.channels.iter_mut().zip(&mut state.report.channels).zip(&self.config.channels)
        {
            state.acknowledge(channel);
            report.kind = channel.kind;
            (report.x, report.value, report.residual, report.z) = (f32::NAN, f32::NAN, f32::NAN, f32::NAN);
        }
        state
    }

    // Constants of zeros, which are cleared in place and not copied.
    const FRESH: [ChannelState<O>; C] = [ChannelState::FRESH; C];
    const UNJUDGED: [channel_state::Out<O>; C] = [channel_state::unjudged::<O>(); C];

    /// Together with a state of its own.
    pub fn into_monitor(self) -> Monitor<N, S, O, C> {
        Monitor { state: self.start(), plan: self }
    }

    /// One tick of the closed loop. `Some` once per hop, from the first full window on.
    ///
    /// Besides a hop: adds and compares only, no division, no square root, the same work every tick.
    #[inline(always)]
    pub fn tick<'s>(
        &self,
        state: &'s mut State<N, S, O, C>,
        r: N,
        y: N,
        u: N,
    ) -> Option<&'s ReportOf<N, S, O, C>> {
        // A few comparisons on most ticks; whatever else they can lead to is one call apart.
        if state.tick_in_block != state.look_at
            && N::surely_admissible(r, y, u)
            && state.point_known()
            && self.undisturbed(&state.blanking, r, u)
        {
            let tick = u32::from(state.tick_in_block);
            state.tick_in_block = state.tick_in_block.wrapping_add(1);
            let (r_before, y_before) = state.trace.before();
            state.trace.remember(r, y);
            state.blanking.remember(r);
            let step = Step { r, y, u, r_before, y_before };
            S::add(&mut state.sums, &mut state.peaks, tick, &step, &state.point);
            return None;
        }
        self.rare_tick(state, r, y, u)
    }

    /// Neither at a limit nor at a step of the reference.
    #[inline(always)]
    fn undisturbed(&self, blanking: &<O::Blanking as BlankingKind>::State<N>, r: N, u: N) -> bool {
        self.in_control(u) && (!O::Blanking::LINKED || self.is_held(blanking.r_before(), r))
    }

    /// u is not at a limit.
    #[inline(always)]
    fn in_control(&self, u: N) -> bool {
        !O::LIMITS || (u > self.u_above && u < self.u_below)
    }

    /// From one reference to the next there is no step.
    #[inline(always)]
    fn is_held(&self, before: N, r: N) -> bool {
        r.minus(before).magnitude() <= self.step
    }

    /// A tick that ends a strip, or has to be looked at more closely.
    #[inline(never)]
    fn rare_tick<'s>(
        &self,
        state: &'s mut State<N, S, O, C>,
        r: N,
        y: N,
        u: N,
    ) -> Option<&'s ReportOf<N, S, O, C>> {
        // Most often a strip ends, and nothing else is rare.
        let usual = state.link == Link::Tick
            && state.blanking.ticks() == 0
            && N::surely_admissible(r, y, u)
            && state.point_known();
        let step = if usual && self.undisturbed(&state.blanking, r, u) {
            let (r_before, y_before) = state.trace.before();
            state.trace.remember(r, y);
            state.blanking.remember(r);
            Ok(Step { r, y, u, r_before, y_before })
        } else {
            self.admit(state, r, y, u)
        };
        match step {
            Ok(step) => {
                let tick = u32::from(state.tick_in_block);
                S::add(&mut state.sums, &mut state.peaks, tick, &step, &state.point);
            }
            Err(why) => state.leave_out(why),
        }
        self.advance(state)
    }

    /// One tick of any kind.
    pub fn tick_input<'s>(
        &self,
        state: &'s mut State<N, S, O, C>,
        input: Input<N>,
    ) -> Option<&'s ReportOf<N, S, O, C>> {
        match input {
            // The longer way, which is right for every tick: the short one is for the caller's own code.
            Input::Sample { r, y, u } => self.rare_tick(state, r, y, u),
            Input::Manual => self.tick_without(state, Exclusion::Manual),
            Input::Missing => self.tick_without(state, Exclusion::Missing),
        }
    }

    #[inline(never)]
    fn tick_without<'s>(
        &self,
        state: &'s mut State<N, S, O, C>,
        why: Exclusion,
    ) -> Option<&'s ReportOf<N, S, O, C>> {
        state.miss();
        if why == Exclusion::Manual {
            // The loop closes again anywhere: a step across the gap is none of its own.
            state.link = Link::None;
        }
        state.leave_out(why);
        self.advance(state)
    }

    /// Forgets the open window, for a gap of unknown length; detectors and courses stay.
    pub fn restart_window(&self, state: &mut State<N, S, O, C>) {
        state.window = Blocks::none();
        state.clear_sums();
        state.start_block();
        state.tick_in_block = 0;
        state.look_at = 0;
        state.blocks_to_hop = self.first_hop();
        state.link = Link::None;
        state.blanking.set(0);
        state.report.excluded = O::Excluded::NONE;
        state.counted = false;
    }

    /// Forgets alarms and courses, for a fault that was seen to; the window stays.
    pub fn acknowledge(&self, state: &mut State<N, S, O, C>) {
        for (state, channel) in state.channels.iter_mut().zip(&self.config.channels) {
            state.acknowledge(channel);
        }
    }

    #[inline(always)]
    fn admit(&self, state: &mut State<N, S, O, C>, r: N, y: N, u: N) -> Result<Step<N>, Exclusion> {
        if !(r.admissible() && y.admissible() && u.admissible() && state.point_known()) {
            state.miss();
            return Err(refusal(r, y, u, state.point.as_ref()));
        }
        let link = state.link;
        state.link = Link::Tick;
        let (mut r_before, mut y_before) = state.trace.before();
        state.trace.remember(r, y);
        if O::Blanking::LINKED
            && let Some(blanking) = &self.config.blanking
        {
            let before = if link == Link::None { r } else { state.blanking.r_before() };
            state.blanking.remember(r);
            if r.minus(before).magnitude() > blanking.reference_step {
                state.blanking.set(blanking.ticks);
            }
            let ticks = state.blanking.ticks();
            if ticks > 0 {
                state.blanking.set(ticks.wrapping_sub(1));
                return Err(Exclusion::Blanked);
            }
        }
        if O::LIMITS && !(u > self.u_above && u < self.u_below) {
            return Err(Exclusion::Saturated);
        }
        if link != Link::Tick {
            (r_before, y_before) = (r, y);
            state.trace.unpair();
        }
        Ok(Step { r, y, u, r_before, y_before })
    }

    /// To the next tick, which may begin a strip or a block.
    fn advance<'s>(&self, state: &'s mut State<N, S, O, C>) -> Option<&'s ReportOf<N, S, O, C>> {
        let mut tick = u32::from(state.tick_in_block).wrapping_add(1);
        let closes = tick >= self.config.block_ticks;
        if closes {
            tick = 0;
        } else if !N::EXACT && tick & u32::from(STRIP_TICKS - 1) == 0 {
            state.join_strip();
        }
        state.tick_in_block = tick as u16;
        let followed = state.link == Link::Tick && state.blanking.ticks() == 0;
        state.look_at = if followed { self.strip_end(tick) } else { tick as u16 };
        if closes { self.close_block(state) } else { None }
    }

    /// The last tick of a strip that begins at `tick`, or holds it.
    fn strip_end(&self, tick: u32) -> u16 {
        let block_end = self.config.block_ticks.wrapping_sub(1);
        let end = tick | u32::from(STRIP_TICKS - 1);
        // No block is longer than a u16 counts.
        (if N::EXACT || end > block_end { block_end } else { end }) as u16
    }

    /// Blocks to the first decision: whole hops, and a whole window.
    fn first_hop(&self) -> u16 {
        let (hop, window) = (self.config.hop_blocks, self.config.window_blocks);
        if !O::Window::SLIDES || hop == 0 {
            return window;
        }
        hop.saturating_mul(window.div_ceil(hop))
    }
}

impl<N: Number, S: IndexSet<N, Point = [N; 1]>, O: Options, const C: usize> Plan<N, S, O, C> {
    /// One tick, and the operating point at it.
    #[inline(always)]
    pub fn tick_at<'s>(
        &self,
        state: &'s mut State<N, S, O, C>,
        r: N,
        y: N,
        u: N,
        operating_point: N,
    ) -> Option<&'s ReportOf<N, S, O, C>> {
        state.point = [operating_point];
        self.tick(state, r, y, u)
    }

    /// The operating point from now on, for one that is measured less often than the loop ticks. Ticks before the first
    /// are left out, and so are those at which it is not finite or beyond [`Number::LIMIT`].
    pub fn operating_point(&self, state: &mut State<N, S, O, C>, operating_point: N) {
        state.point = [operating_point];
    }
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
    fn point_known(&self) -> bool {
        self.point.as_ref().iter().all(|point| point.admissible())
    }

    /// A tick without a usable sample: time passes.
    fn miss(&mut self) {
        if self.link == Link::Tick {
            self.link = Link::Gap;
        }
        self.blanking.set(self.blanking.ticks().saturating_sub(1));
    }

    fn leave_out(&mut self, why: Exclusion) {
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

    fn join_strip(&mut self) {
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

    fn clear_sums(&mut self) {
        self.sums = S::NO_SUMS;
        self.joined = S::NO_STRIPS;
    }

    fn start_block(&mut self) {
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

/// Apart and cold: the tick path only asks whether, not why.
#[cold]
fn refusal<N: Number>(r: N, y: N, u: N, point: &[N]) -> Exclusion {
    if r.non_finite() || y.non_finite() || u.non_finite() || point.iter().any(|p| p.non_finite()) {
        Exclusion::NonFinite
    } else {
        Exclusion::OutOfRange
    }
}
