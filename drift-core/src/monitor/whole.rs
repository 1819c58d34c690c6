//! A plan and its state in one place.

use super::{Plan, ReportOf, State};
use crate::config::{Config, ConfigError};
use crate::course::Verdict;
use crate::index_set::{Full, IndexSet, Pair};
use crate::number::Number;
use crate::options::{Everything, Options};
use crate::sample::Input;

/// A plan and its state in one place. `N`: the samples' number; `S`: what is summed; `O`: what it can do; `C`: channels.
///
/// Rounding: within 1e-6 relative of a direct sum for `f32` blocks of any length in windows of up to 16 blocks (1.5e-6
/// for 64), however long it runs; sums of counts are exact.
#[derive(Debug, Clone, Copy)]
pub struct Monitor<N: Number, S: IndexSet<N>, O: Options, const C: usize = 1> {
    pub(super) plan: Plan<N, S, O, C>,
    pub(super) state: State<N, S, O, C>,
}

/// The paper's pair in one channel, everything else at run time; windows of up to `B` blocks.
pub type PairMonitor<N, J, const B: usize> = Monitor<N, Pair<J>, Everything<B>, 1>;

/// All indices, three channels, everything else at run time; windows of up to `B` blocks.
pub type FullMonitor<N, const B: usize> = Monitor<N, Full, Everything<B>, 3>;

impl<N: Number, S: IndexSet<N>, O: Options, const C: usize> Monitor<N, S, O, C> {
    /// A monitor that has seen nothing yet.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn new(config: Config<N, C>) -> Result<Self, ConfigError> {
        N::plan(config).map(Plan::into_monitor)
    }

    /// The configuration that it was started with.
    pub const fn config(&self) -> &Config<N, C> {
        self.plan.config()
    }

    /// What it remembers.
    pub const fn state(&self) -> &State<N, S, O, C> {
        &self.state
    }

    /// As [`Plan::tick`].
    #[inline(always)]
    pub fn tick(&mut self, r: N, y: N, u: N) -> Option<&ReportOf<N, S, O, C>> {
        self.plan.tick(&mut self.state, r, y, u)
    }

    /// As [`Plan::tick_input`].
    pub fn tick_input(&mut self, input: Input<N>) -> Option<&ReportOf<N, S, O, C>> {
        self.plan.tick_input(&mut self.state, input)
    }

    /// As [`Plan::ticks`].
    pub fn ticks(&mut self, r: &[N], y: &[N], u: &[N], each: impl FnMut(&ReportOf<N, S, O, C>)) {
        self.plan.ticks(&mut self.state, (r, y, u), each);
    }

    /// As [`State::verdict`].
    pub fn verdict(&self) -> Verdict {
        self.state.verdict()
    }

    /// Where the operating point is held from tick to tick; `None` where the set keeps none. For callers to whom the set is
    /// not known; others have [`Monitor::operating_point`].
    pub fn operating_point_place(&mut self) -> Option<&mut N> {
        self.state.point.as_mut().first_mut()
    }

    /// As [`Plan::restart_window`].
    pub fn restart_window(&mut self) {
        self.plan.restart_window(&mut self.state);
    }

    /// As [`Plan::acknowledge`].
    pub fn acknowledge(&mut self) {
        self.plan.acknowledge(&mut self.state);
    }
}

impl<N: Number, S: IndexSet<N, Point = [N; 1]>, O: Options, const C: usize> Monitor<N, S, O, C> {
    /// As [`Plan::tick_at`].
    #[inline(always)]
    pub fn tick_at(&mut self, r: N, y: N, u: N, operating_point: N) -> Option<&ReportOf<N, S, O, C>> {
        self.plan.tick_at(&mut self.state, r, y, u, operating_point)
    }

    /// As [`Plan::operating_point`].
    pub fn operating_point(&mut self, operating_point: N) {
        self.plan.operating_point(&mut self.state, operating_point);
    }
}
