//! Commissioning with a measured operating point: its weight is learnt in place too.

use super::{Commissioning, LineFit, NotReady, Owner, Reader, StateError, Writer, learned};
use crate::channel::{Baseline, Channel, ChannelKind, ChannelReport};
use crate::config::Config;
use crate::detector::Detectors;
use crate::index::IndicesAt;
use crate::number::Number;
use crate::operating_point::OperatingPoint;
use crate::point_fit::{POINT_FIT_BYTES, PointFit};
use crate::report::{Report, WindowStatus};

/// Stands where a monitor's saved state has its index set.
const COMMISSIONING_AT_TAG: u8 = 0x81;

/// As [`Commissioning`], from the reports of a monitor of [`crate::FullAt`]: kinds of channels that can depend on the operating
/// point ([`crate::ChannelMeaning::remembers`]) learn its weight as well. 28 bytes a channel more.
///
/// The point must vary while it is learnt, and not with x alone.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CommissioningAt<const C: usize> {
    learning: Commissioning<C>,
    points: [PointFit; C],
    /// A window came with a point: from then on all do.
    at: bool,
}

impl<const C: usize> CommissioningAt<C> {
    /// Bytes that [`CommissioningAt::save`] needs.
    pub const STATE_BYTES: usize = Commissioning::<C>::STATE_BYTES + C * POINT_FIT_BYTES + 1;

    /// Nothing learnt yet.
    pub const fn new() -> Self {
        Self { learning: Commissioning::new(), points: [PointFit::EMPTY; C], at: false }
    }

    /// Adds one healthy decision; windows with too few valid ticks are passed over.
    pub fn learn<X, D, F>(&mut self, report: &Report<C, IndicesAt, X, ChannelReport<D, F>>) {
        if report.status == WindowStatus::Valid {
            let channels = report.channels.iter().map(|channel| (channel.x, channel.value));
            self.learn_window(channels, report.indices.operating_point);
        }
    }

    /// Adds one healthy window by its coordinates, (x, value) of each channel in order, and the point's mean; what is not
    /// finite is passed over. Where no window has a point, none is learnt.
    pub fn learn_window(&mut self, channels: impl Iterator<Item = (f32, f32)>, point: f32) {
        let first = self.learning.fits.iter().all(|fit| fit.windows() == 0);
        self.at |= first && point.is_finite();
        if self.at != point.is_finite() {
            return;
        }
        for (i, (x, value)) in (0..C).zip(channels) {
            let place = self.learning.fits.get(i).zip(self.points.get_mut(i));
            let Some((line, fit)) = place.filter(|_| x.is_finite() && value.is_finite()) else { continue };
            let (windows, before) = (line.windows(), *fit);
            if !self.at || fit.add(line, x, value, point) {
                self.learning.learn_channel(i, x, value);
            }
            // What the line passes over the point passes over as well.
            if self.learning.fits.get(i).is_some_and(|line| line.windows() == windows) {
                *fit = before;
            }
        }
    }

    /// Windows learnt from, the least of the channels.
    pub fn windows(&self) -> u32 {
        self.learning.windows()
    }

    /// The relation of a channel of this kind at this place; without a point where none was learnt, or the kind does not
    /// depend on it.
    ///
    /// # Errors
    /// Fewer than [`Commissioning::LEAST_WINDOWS`] windows, an index that does not scatter, a point that stands still.
    pub fn relation(&self, place: usize, kind: ChannelKind) -> Result<(Baseline, OperatingPoint), NotReady> {
        let channel = place as u8;
        let (Some(line), Some(fit), Some(range)) =
            (self.learning.fits.get(place), self.points.get(place), self.learning.range.get(place))
        else {
            return Err(NotReady::NoScatter { channel });
        };
        let windows = line.windows();
        if windows < Commissioning::<C>::LEAST_WINDOWS {
            return Err(NotReady::TooFewWindows { windows, needed: Commissioning::<C>::LEAST_WINDOWS });
        }
        let depends = self.at && kind.remembers();
        let variance = if depends { fit.residual_variance(windows) } else { line.residual_variance() };
        let rounding = 1e-6 * line.value_mean();
        if variance <= rounding * rounding {
            return Err(NotReady::NoScatter { channel });
        }
        if !depends {
            return Ok((learned(line, *range, (line.b1(), line.b0()), variance), OperatingPoint::NONE));
        }
        if !fit.varies(windows) {
            return Err(NotReady::PointStandsStill { channel });
        }
        Ok((learned(line, *range, fit.slope_and_intercept(line), variance), fit.operating_point(line)))
    }

    /// Channels with what was learnt, all with the same detectors.
    ///
    /// # Errors
    /// As [`CommissioningAt::relation`].
    pub fn channels(&self, kinds: [ChannelKind; C], detectors: Detectors) -> Result<[Channel; C], NotReady> {
        let mut channels = kinds.map(Channel::unlearned);
        for (place, channel) in (0..C).zip(&mut channels) {
            (channel.baseline, channel.operating_point) = self.relation(place, channel.kind)?;
            channel.detectors = detectors;
        }
        Ok(channels)
    }

    /// As [`Commissioning::save`].
    ///
    /// # Errors
    /// [`StateError::BufferTooSmall`].
    pub fn save<N: Number>(&self, config: &Config<N, C>, into: &mut [u8]) -> Result<usize, StateError> {
        Writer::envelope(into, Self::owner(config), |to| {
            self.learning.write(to);
            self.points.iter().for_each(|fit| fit.write(to));
            to.u8(u8::from(self.at));
        })
    }

    /// As [`Commissioning::restore`].
    ///
    /// # Errors
    /// As [`Commissioning::restore`].
    pub fn restore<N: Number>(&mut self, config: &Config<N, C>, from: &[u8]) -> Result<(), StateError> {
        let mut payload = Reader::open(from, Self::owner(config))?;
        let restored = Self::read(&mut payload).filter(|_| payload.is_empty());
        *self = restored.ok_or(StateError::Impossible)?;
        Ok(())
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let mut read = Self { learning: Commissioning::read(from)?, ..Self::new() };
        for fit in &mut read.points {
            *fit = PointFit::read(from)?;
        }
        read.at = match from.u8()? {
            0 => false,
            1 => true,
            _ => return None,
        };
        let windows = |fit: &LineFit| if read.at { fit.windows() } else { 0 };
        let possible =
            read.learning.fits.iter().zip(&read.points).all(|(line, fit)| fit.possible(windows(line)));
        possible.then_some(read)
    }

    fn owner<N: Number>(config: &Config<N, C>) -> Owner {
        Owner { set: COMMISSIONING_AT_TAG, ..Commissioning::<C>::owner(config) }
    }
}

impl<const C: usize> Default for CommissioningAt<C> {
    fn default() -> Self {
        Self::new()
    }
}
