//! On-device commissioning: learns the baseline from healthy windows in place, and says what a baseline from so
//! few windows can honestly promise.

mod at;
mod back;

pub use at::CommissioningAt;
pub use back::{LearntOrder, MemoryCommissioning, Order, OrderAt};

use crate::channel::{Baseline, ChannelKind, ChannelReport};
use crate::config::Config;
use crate::detector::Cusum;
use crate::line_fit::{FIT_BYTES, LineFit};
use crate::math;
use crate::number::Number;
use crate::report::{Report, WindowStatus};
use crate::store::{CHECKSUM_BYTES, HEADER_BYTES, Owner, Reader, StateError, Writer};

/// Learns the baselines of `C` channels from the reports of a monitor whose channels are
/// [`crate::Channel::unlearned`] (or of any other: only the coordinates are read).
///
/// Feed it decisions on windows that do not overlap, while the loop is known to be healthy.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Commissioning<const C: usize> {
    fits: [LineFit; C],
    range: [(f32, f32); C],
}

/// Stands where a monitor's saved state has its index set.
const COMMISSIONING_TAG: u8 = 0x80;

/// Why there is no baseline yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NotReady {
    /// Fewer windows than a baseline needs.
    TooFewWindows {
        /// Healthy windows learnt from so far.
        windows: u32,
        /// Windows needed at least.
        needed: u32,
    },
    /// A channel's index does not scatter beyond its own rounding: the loop stands still, or a sensor is stuck. A
    /// standard deviation of zero would silence the channel for ever.
    NoScatter {
        /// The channel's place in the configuration, from 0.
        channel: u8,
    },
    /// The operating point stands still, or goes with x alone: what it costs can't be learnt.
    PointStandsStill {
        /// The channel's place in the configuration, from 0.
        channel: u8,
    },
}

impl core::fmt::Display for NotReady {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooFewWindows { windows, needed } => {
                write!(f, "{windows} healthy windows so far, at least {needed} are needed")
            }
            Self::NoScatter { channel } => {
                write!(
                    f,
                    "the index of channel {channel} does not scatter: the loop must move while it is learnt"
                )
            }
            Self::PointStandsStill { channel } => {
                write!(
                    f,
                    "the operating point of channel {channel} stands still: it must vary while it is learnt"
                )
            }
        }
    }
}

impl core::error::Error for NotReady {}

impl<const C: usize> Commissioning<C> {
    /// Below this a standard deviation means nothing.
    pub const LEAST_WINDOWS: u32 = 25;

    /// Bytes that [`Commissioning::save`] needs.
    pub const STATE_BYTES: usize = HEADER_BYTES + C * (FIT_BYTES + 8) + CHECKSUM_BYTES;

    /// Nothing learnt yet.
    pub const fn new() -> Self {
        Self { fits: [LineFit::EMPTY; C], range: [(f32::MAX, f32::MIN); C] }
    }

    /// Adds one healthy decision; windows with too few valid ticks are passed over.
    pub fn learn<I, X, D, F>(&mut self, report: &Report<C, I, X, ChannelReport<D, F>>) {
        if report.status == WindowStatus::Valid {
            self.learn_window(report.channels.iter().map(|channel| (channel.x, channel.value)));
        }
    }

    /// Adds one healthy window by its coordinates, (x, value) of each channel in order; what is not finite is passed
    /// over.
    pub fn learn_window(&mut self, channels: impl Iterator<Item = (f32, f32)>) {
        for (i, (x, value)) in (0..C).zip(channels) {
            if x.is_finite() && value.is_finite() {
                self.learn_channel(i, x, value);
            }
        }
    }

    fn learn_channel(&mut self, place: usize, x: f32, value: f32) {
        if let Some((fit, range)) = self.fits.get_mut(place).zip(self.range.get_mut(place)) {
            fit.add(x, value);
            // `f32::min` would call fminf, which a C firmware may not link.
            *range = (if x < range.0 { x } else { range.0 }, if x > range.1 { x } else { range.1 });
        }
    }

    /// Windows learnt from, the least of the channels.
    pub fn windows(&self) -> u32 {
        self.fits.iter().map(LineFit::windows).min().unwrap_or(0)
    }

    /// The baselines. Put them into a [`crate::Config`] with detectors and start a new monitor.
    ///
    /// # Errors
    /// Fewer than [`Commissioning::LEAST_WINDOWS`] windows, or a channel whose index does not scatter.
    pub fn baselines(&self) -> Result<[Baseline; C], NotReady> {
        self.baselines_of(C)
    }

    /// The baselines of the first `channels` channels alone; the others stay unlearnt.
    ///
    /// # Errors
    /// As [`Commissioning::baselines`].
    pub fn baselines_of(&self, channels: usize) -> Result<[Baseline; C], NotReady> {
        let windows = self.fits.iter().take(channels).map(LineFit::windows).min().unwrap_or(0);
        if windows < Self::LEAST_WINDOWS {
            return Err(NotReady::TooFewWindows { windows, needed: Self::LEAST_WINDOWS });
        }
        let mut baselines = [Baseline::UNLEARNED; C];
        for (channel, ((out, fit), range)) in
            baselines.iter_mut().zip(&self.fits).zip(&self.range).take(channels).enumerate()
        {
            if !fit.scatters() {
                return Err(NotReady::NoScatter { channel: channel as u8 });
            }
            *out = learned(fit, *range, (fit.b1(), fit.b0()), fit.residual_variance());
        }
        Ok(baselines)
    }

    /// Channels with the learnt baselines, all with the same detectors.
    ///
    /// # Errors
    /// As [`Commissioning::baselines`].
    pub fn channels(
        &self,
        kinds: [ChannelKind; C],
        detectors: crate::detector::Detectors,
    ) -> Result<[crate::channel::Channel; C], NotReady> {
        let baselines = self.baselines()?;
        let mut channels = kinds.map(crate::channel::Channel::unlearned);
        for (channel, baseline) in channels.iter_mut().zip(baselines) {
            channel.baseline = baseline;
            channel.detectors = detectors;
        }
        Ok(channels)
    }

    /// Writes what was learnt, in the same envelope as [`crate::Monitor::save`]; `config` is that of the monitor
    /// whose reports were learnt from. Returns the bytes used.
    ///
    /// # Errors
    /// [`StateError::BufferTooSmall`].
    pub fn save<N: Number>(&self, config: &Config<N, C>, into: &mut [u8]) -> Result<usize, StateError> {
        Writer::envelope(into, Self::owner(config), |to| self.write(to))
    }

    fn write(&self, to: &mut Writer<'_>) {
        for (fit, range) in self.fits.iter().zip(&self.range) {
            fit.write(to);
            to.f32(range.0);
            to.f32(range.1);
        }
    }

    /// Takes up what was saved, all of it or none.
    ///
    /// # Errors
    /// As [`crate::Monitor::restore`].
    pub fn restore<N: Number>(&mut self, config: &Config<N, C>, from: &[u8]) -> Result<(), StateError> {
        let mut payload = Reader::open(from, Self::owner(config))?;
        let restored = Self::read(&mut payload).filter(|_| payload.is_empty());
        *self = restored.ok_or(StateError::Impossible)?;
        Ok(())
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let mut read = Self::new();
        for (fit, range) in read.fits.iter_mut().zip(&mut read.range) {
            *fit = LineFit::read(from).filter(LineFit::possible)?;
            *range = (from.f32()?, from.f32()?);
            if fit.windows() > 0 && range.0 > range.1 {
                return None;
            }
        }
        Some(read)
    }

    fn owner<N: Number>(config: &Config<N, C>) -> Owner {
        Owner {
            number: N::TAG,
            set: COMMISSIONING_TAG,
            capacity: 0,
            channels: C as u16,
            fingerprint: config.fingerprint(),
        }
    }

    /// The mean run length to a false alarm (decisions) that nine of ten devices with this many windows keep.
    pub fn honest_arl0(&self, cusum: &Cusum) -> f32 {
        honest_arl0(cusum, self.windows())
    }
}

impl<const C: usize> Default for Commissioning<C> {
    fn default() -> Self {
        Self::new()
    }
}

/// The baseline of a fit; slope and intercept, and the residual variance, are those of the whole relation.
fn learned(fit: &LineFit, range: (f32, f32), (b1, b0): (f32, f32), variance: f32) -> Baseline {
    Baseline {
        b0,
        b1,
        sigma: math::sqrt(variance),
        windows: fit.windows() as f32,
        x_mean: fit.x_mean(),
        // Without a slope there is no leverage to account for.
        x_ss: if fit.b1() == 0.0 { 0.0 } else { fit.x_ss() },
        x_min: range.0,
        x_max: range.1,
    }
}

/// The two-sided CUSUM's in-control mean run length, decisions, that 90 % of baselines learnt from `windows`
/// independent windows keep; for independent Gaussian residuals and without head start.
///
/// Siegmund's closed form (1985) at a standard deviation underestimated by `0.883/sqrt(m)` and a mean off by
/// `1.257/sqrt(m)`: these two numbers reproduce the simulated 10 % quantiles for m = 25 to 1000 within 1 %.
pub fn honest_arl0(cusum: &Cusum, windows: u32) -> f32 {
    if windows < Commissioning::<1>::LEAST_WINDOWS {
        return 0.0;
    }
    let per_root = 1.0 / math::sqrt(windows as f32);
    let (ratio, offset) = (1.0 - 0.883 * per_root, 1.257 * per_root);
    let (k, h) = (cusum.k * ratio, cusum.h * ratio);
    let (high, low) = (siegmund(offset - k, h), siegmund(-offset - k, h));
    1.0 / (1.0 / high + 1.0 / low)
}

/// One-sided mean run length for a drift of `d` per decision (Siegmund 1985).
fn siegmund(d: f32, h: f32) -> f32 {
    let b = h + 1.166;
    let x = -2.0 * d * b;
    if x.abs() < 0.01 {
        // The limit of the formula as d goes to zero.
        return b * b * (1.0 + x / 3.0);
    }
    (math::exp(x) - 1.0 - x) / (2.0 * d * d)
}
