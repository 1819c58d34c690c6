//! What can happen to a loop, in stretches of windows, so that every decision and every tick that a monitor can meet
//! comes up: healthy, a disturbance that ends, a drift until it is confirmed, and in the confirmed drift gaps, limits,
//! steps of the reference and manual stretches; then gaps alone.

use drift_core::Input;

use crate::plant::Noise;

/// A stretch of the script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stretch {
    /// On the baseline.
    Healthy,
    /// Away, for three windows, and back: suspect, then a disturbance.
    Disturbance,
    /// Away to stay; confirmed after twenty windows, then with its curve.
    Drift,
    /// Every third tick brings a NaN.
    Gaps,
    /// u stands at a limit at every fifth tick.
    Limits,
    /// Steps of the reference.
    Steps,
    /// Manual stretches.
    Manual,
}

impl Stretch {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Healthy, Self::Disturbance, Self::Drift, Self::Gaps, Self::Limits, Self::Steps, Self::Manual];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Healthy => "healthy",
            Self::Disturbance => "disturbance",
            Self::Drift => "drift",
            Self::Gaps => "gaps",
            Self::Limits => "limits",
            Self::Steps => "steps",
            Self::Manual => "manual",
        }
    }

    /// What the window of this number belongs to; the script has [`WINDOWS`] of them.
    pub const fn of_window(window: u32) -> Self {
        match window {
            0..8 => Self::Healthy,
            8..18 => Self::Disturbance,
            18..46 => Self::Drift,
            46..50 => Self::Gaps,
            50..54 => Self::Limits,
            54..58 => Self::Steps,
            _ => Self::Manual,
        }
    }
}

/// Windows of the whole script.
pub const WINDOWS: u32 = 62;

/// The script, tick by tick.
#[derive(Debug, Clone, Copy)]
pub struct Script {
    noise: Noise,
    tick: u32,
    window_ticks: u32,
}

impl Script {
    /// For windows of so many ticks.
    pub const fn new(window_ticks: u32) -> Self {
        Self { noise: Noise::new(7), tick: 0, window_ticks }
    }

    /// The next tick and the stretch that it belongs to.
    pub fn tick(&mut self) -> (Stretch, Input<f32>) {
        let window_ticks = self.window_ticks.max(1);
        let (window, at) = (self.tick / window_ticks, self.tick % window_ticks);
        self.tick = self.tick.wrapping_add(1);
        let stretch = Stretch::of_window(window);
        let away = (9..12).contains(&window) || window >= 18;
        let (e_size, u_more) = if away { (0.3, 1.0) } else { (0.1, 0.0) };
        let (e, du) = (e_size * self.noise.uniform(), self.noise.uniform());
        let r = if stretch == Stretch::Steps && (at / 400).is_multiple_of(2) { 2.0 } else { 1.0 };
        let (y, u) = (r + e, 1.2 + u_more + du);
        let input = match stretch {
            Stretch::Gaps if at.is_multiple_of(3) => Input::Sample { r, y: f32::NAN, u },
            Stretch::Limits if at.is_multiple_of(5) => Input::Sample { r, y, u: 9.5 },
            Stretch::Manual if (at / 60).is_multiple_of(4) => Input::Manual,
            _ => Input::Sample { r, y, u },
        };
        (stretch, input)
    }

    /// The same in counts of 1/4096; NaN is beyond any count.
    pub fn tick_counts(&mut self) -> (Stretch, Input<i32>) {
        let (stretch, input) = self.tick();
        let count = |x: f32| if x.is_nan() { i32::MAX } else { (x * 4096.0) as i32 };
        let input = match input {
            Input::Sample { r, y, u } => Input::Sample { r: count(r), y: count(y), u: count(u) },
            Input::Manual => Input::Manual,
            Input::Missing => Input::Missing,
        };
        (stretch, input)
    }
}
