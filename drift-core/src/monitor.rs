//! The monitor: one sample in per tick, one report out per decision.
//!
//! Per tick a few sums grow; at the end of a block they are added to the window, and at a decision the window is
//! judged. Nothing is ever subtracted, so nothing accumulates: after 1e8 ticks the indices are as exact as after the
//! first window. Within a block of floats, strips of [`STRIP_TICKS`] ticks are summed apart and then joined with a carry,
//! so that a long block does not round more than a short one.

mod channel_state;
mod decide;
mod saved_state;
mod state;
mod strips;
mod whole;

pub use self::state::State;
pub use self::whole::{FullMonitor, Monitor, PairMonitor};

use self::channel_state::ChannelState;
use self::state::Link;
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

/// Apart and cold: the tick path only asks whether, not why.
#[cold]
fn refusal<N: Number>(r: N, y: N, u: N, point: &[N]) -> Exclusion {
    if r.non_finite() || y.non_finite() || u.non_finite() || point.iter().any(|p| p.non_finite()) {
        Exclusion::NonFinite
    } else {
        Exclusion::OutOfRange
    }
}
