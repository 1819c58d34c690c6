//! The paper's loop and [`drift_core::Monitor`] on it: the simulator makes (r, y, u), the monitor the windows.

use drift_core::{
    Baseline, Channel, ChannelKind, Config, Detectors, Everything, Full, Index, Indices, Monitor, Report,
};

use super::settings::{BLOCK_TICKS, HOP_BLOCKS, SAMPLE_TIME_S, WINDOW_BLOCKS};
use crate::control_loop::Loop;
use crate::physics::Term;
use crate::reference::Reference;
use crate::simulate::Simulation;
use crate::{Error, Result};

/// The paper's injected fault: `mu(t) + sigma(t)*N(0, 1)` added to the measured y, both growing from zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drift {
    /// The mean's value after `ramp_s`.
    pub mu_max: f64,
    /// The standard deviation's value after `ramp_s`.
    pub sigma_end: f64,
    /// How long both take to get there, s.
    pub ramp_s: f64,
    /// When they begin, s.
    pub onset_s: f64,
    /// What the mean does then.
    pub after: AfterRamp,
}

/// What a drift's mean does once it has reached mu_max.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AfterRamp {
    /// It stays there.
    Holds,
    /// It goes on growing at the same rate.
    GoesOn,
}

impl Drift {
    /// Both reached at the end of a run of this length.
    pub fn over(mu_max: f64, sigma_end: f64, run_s: f64) -> Self {
        Self { mu_max, sigma_end, ramp_s: run_s, onset_s: 0.0, after: AfterRamp::GoesOn }
    }

    /// The paper's loop with this fault.
    pub fn in_loop(&self) -> Result<Loop> {
        if self.mu_max == 0.0 && self.sigma_end == 0.0 {
            return Ok(Loop::paper());
        }
        let ramp = |sign: f64, sigma_end: f64| {
            let rate = sign * self.mu_max / self.ramp_s;
            Term::new(
                "sensor_drift",
                &[("rate_per_s", rate), ("noise_growth_per_s", sigma_end / self.ramp_s)],
            )
        };
        let model = Loop::paper().with(ramp(1.0, self.sigma_end)?.from_s(self.onset_s));
        Ok(match self.after {
            AfterRamp::GoesOn => model,
            // A ramp down on top of the one up.
            AfterRamp::Holds => model.with(ramp(-1.0, 0.0)?.from_s(self.onset_s + self.ramp_s)),
        })
    }
}

/// Which y the monitor sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sees {
    /// The measured one, as any monitor does.
    Measured,
    /// The one before the fault is added: only a simulation can.
    True,
}

/// One window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    pub end_s: f64,
    pub indices: Indices,
}

/// The windows of the paper, with one channel.
pub(super) const fn config(channel: Channel) -> Config<f32, 1> {
    Config::new(SAMPLE_TIME_S as f32, BLOCK_TICKS, WINDOW_BLOCKS, [channel]).with_hop(HOP_BLOCKS)
}

/// The paper's channel, J_e against E_u.
pub(super) const fn pair(index: Index, baseline: Baseline, detectors: Detectors) -> Channel {
    Channel::new(ChannelKind::EnergyError(index), baseline, detectors)
}

static LEARNING: Config<f32, 1> = config(pair(Index::Iae, Baseline::UNLEARNED, Detectors::NONE));

/// A run of the loop under the monitor.
pub(super) struct Stream {
    simulation: Simulation,
    reference: Reference,
    monitor: Monitor<f32, Full, Everything<{ WINDOW_BLOCKS as usize }>, 1>,
    sees: Sees,
    tick: u64,
}

impl Stream {
    /// Windows only: nothing is judged.
    pub fn learning(drift: &Drift, seed: u64) -> Result<Self> {
        Self::of(&LEARNING, &drift.in_loop()?, seed, Sees::Measured)
    }

    /// The same of a loop that differs from the paper's.
    pub fn learning_of(model: &Loop, seed: u64) -> Result<Self> {
        Self::of(&LEARNING, model, seed, Sees::Measured)
    }
}

impl Stream {
    pub fn new(config: &Config<f32, 1>, drift: &Drift, seed: u64, sees: Sees) -> Result<Self> {
        Self::of(config, &drift.in_loop()?, seed, sees)
    }

    fn of(config: &Config<f32, 1>, model: &Loop, seed: u64, sees: Sees) -> Result<Self> {
        let monitor = Monitor::new(*config).map_err(|e| Error::new(format!("the monitor refuses: {e}")))?;
        let simulation = Simulation::new(model, seed)?;
        Ok(Self { simulation, reference: Reference::paper(seed), monitor, sees, tick: 0 })
    }

    /// Runs on to the next decision; gives the time in s with it.
    pub fn next_report(&mut self) -> (f64, Report<1>) {
        loop {
            let r = self.reference.next().unwrap_or(0.0);
            let step = self.simulation.step(r, &[]);
            self.tick += 1;
            let y = if self.sees == Sees::Measured { step.y } else { step.true_y };
            if let Some(report) = self.monitor.tick(r as f32, y as f32, step.u as f32) {
                return (self.tick as f64 * SAMPLE_TIME_S, *report);
            }
        }
    }

    pub fn next_window(&mut self) -> Window {
        let (end_s, report) = self.next_report();
        Window { end_s, indices: report.indices }
    }

    /// All windows that end within so many seconds.
    pub fn windows_within(mut self, run_s: f64) -> Vec<Window> {
        let ticks = (run_s / SAMPLE_TIME_S).round() as u64;
        (0..windows_in(ticks)).map(|_| self.next_window()).collect()
    }
}

/// How many windows end within so many ticks.
pub(super) fn windows_in(ticks: u64) -> usize {
    let (window, hop) =
        (u64::from(BLOCK_TICKS) * u64::from(WINDOW_BLOCKS), u64::from(BLOCK_TICKS) * u64::from(HOP_BLOCKS));
    if ticks < window { 0 } else { ((ticks - window) / hop + 1) as usize }
}

/// What (E_u, J_e) a window is on the energy-error plane.
pub(super) fn energy_error(windows: &[Window], index: Index) -> Vec<(f64, f64)> {
    coordinates(windows, ChannelKind::EnergyError(index))
}

/// (x, value) of a channel, window by window.
pub(super) fn coordinates(windows: &[Window], kind: ChannelKind) -> Vec<(f64, f64)> {
    let of = |window: &Window| {
        let (x, value) = kind.coordinates(&window.indices);
        (f64::from(x), f64::from(value))
    };
    windows.iter().map(of).collect()
}
