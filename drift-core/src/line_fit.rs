//! Running least squares of a straight line: the baseline learnt in place (equation 6) and the curve after an
//! alarm (equations 8 and 9).
//!
//! Means and centred sums are updated (Welford 1962), so that large E_u do not cancel: nothing is subtracted that
//! was summed before.

use crate::store::{Reader, Writer};

/// Saved bytes of one fit.
pub(crate) const FIT_BYTES: usize = 24;
/// Saved bytes of a line alone.
pub(crate) const LINE_BYTES: usize = 16;
/// Beyond this the next window's weight is lost to rounding.
const MOST_WINDOWS: u32 = 1 << 24;

/// `value = b0 + b1*x`, learnt one window at a time. Constant memory.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LineFit {
    windows: u32,
    line: Line,
    residual_ss: f32,
}

/// The line alone, for one who counts the windows anyhow and does not ask for their scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Line {
    x_mean: f32,
    value_mean: f32,
    x_ss: f32,
    x_value_ss: f32,
}

impl Line {
    pub(crate) const EMPTY: Self = Self { x_mean: 0.0, value_mean: 0.0, x_ss: 0.0, x_value_ss: 0.0 };

    /// Adds a window as the `windows`th. What would overflow is passed over.
    pub(crate) fn add(&mut self, windows: u32, x: f32, value: f32) {
        let mut next = *self;
        next.learn(windows, x, value);
        // A mean that is not finite makes its sum so.
        if next.x_ss.is_finite() && next.x_value_ss.is_finite() {
            *self = next;
        }
    }

    fn learn(&mut self, windows: u32, x: f32, value: f32) {
        let (dx, dv) = (x - self.x_mean, value - self.value_mean);
        let weight = 1.0 / windows as f32;
        self.x_mean += dx * weight;
        self.value_mean += dv * weight;
        self.x_ss += dx * (x - self.x_mean);
        self.x_value_ss += dx * (value - self.value_mean);
    }

    const fn words(&self) -> [f32; 4] {
        [self.x_mean, self.value_mean, self.x_ss, self.x_value_ss]
    }

    fn finite(&self) -> bool {
        self.words().iter().all(|w| w.is_finite())
    }

    fn x_varies(&self, windows: u32) -> bool {
        let rounding = 1e-6 * self.x_mean;
        self.x_ss > windows as f32 * rounding * rounding
    }

    pub(crate) const fn x_mean(&self) -> f32 {
        self.x_mean
    }

    pub(crate) const fn value_mean(&self) -> f32 {
        self.value_mean
    }

    pub(crate) const fn x_ss(&self) -> f32 {
        self.x_ss
    }

    /// Slope; zero while x has not varied beyond its own rounding.
    pub(crate) fn b1(&self, windows: u32) -> f32 {
        if self.x_varies(windows) { self.x_value_ss / self.x_ss } else { 0.0 }
    }

    pub(crate) fn possible(&self) -> bool {
        self.finite() && self.x_ss >= 0.0
    }

    pub(crate) fn write(&self, to: &mut Writer<'_>) {
        self.words().into_iter().for_each(|w| to.f32(w));
    }

    pub(crate) fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            x_mean: from.f32()?,
            value_mean: from.f32()?,
            x_ss: from.f32()?,
            x_value_ss: from.f32()?,
        })
    }
}

impl LineFit {
    /// No window yet.
    pub const EMPTY: Self = Self { windows: 0, line: Line::EMPTY, residual_ss: 0.0 };

    /// Adds a window. What would overflow is passed over; at 2^24 windows it stops learning.
    pub fn add(&mut self, x: f32, value: f32) {
        let mut next = *self;
        // What a window adds to the residual sum of squares: `SS_v - b1*S_xv` would cancel where the line explains
        // nearly everything.
        if let Some((error, variance)) = next.prediction_error(x, value) {
            next.residual_ss += error * error / variance;
        }
        next.windows = next.windows.saturating_add(1);
        next.line.learn(next.windows, x, value);
        if next.windows <= MOST_WINDOWS && next.finite() {
            *self = next;
        }
    }

    /// A window's distance from the line so far, and the variance of such a distance in units of sigma squared (Brown, Durbin &
    /// Evans 1975). None of the first window and of the first other x: the line goes right through.
    pub(crate) fn prediction_error(&self, x: f32, value: f32) -> Option<(f32, f32)> {
        if self.windows == 0 {
            return None;
        }
        let (dx, mut error) = (x - self.line.x_mean, value - self.line.value_mean);
        let mut variance = 1.0 + 1.0 / self.windows as f32;
        if self.x_varies() {
            error -= self.line.x_value_ss / self.line.x_ss * dx;
            variance += dx * (dx / self.line.x_ss);
        } else if dx.abs() > 1e-6 * self.line.x_mean.abs() {
            return None;
        }
        Some((error, variance))
    }

    /// x has varied beyond its own rounding.
    pub(crate) fn x_varies(&self) -> bool {
        self.line.x_varies(self.windows)
    }

    fn finite(&self) -> bool {
        self.line.finite() && self.residual_ss.is_finite()
    }

    pub(crate) fn possible(&self) -> bool {
        self.windows <= MOST_WINDOWS && self.finite() && self.line.x_ss >= 0.0 && self.residual_ss >= 0.0
    }

    /// Windows learnt from so far.
    pub const fn windows(&self) -> u32 {
        self.windows
    }

    /// Mean of x, x units.
    pub const fn x_mean(&self) -> f32 {
        self.line.x_mean
    }

    /// Mean of the value.
    pub const fn value_mean(&self) -> f32 {
        self.line.value_mean
    }

    /// Sum of squared deviations of x.
    pub const fn x_ss(&self) -> f32 {
        self.line.x_ss
    }

    /// Slope; zero while x has not varied beyond its own rounding.
    pub fn b1(&self) -> f32 {
        self.line.b1(self.windows)
    }

    /// Intercept, value units: where the line meets x = 0.
    pub fn b0(&self) -> f32 {
        self.line.value_mean - self.b1() * self.line.x_mean
    }

    /// Residual variance with n - 2 degrees of freedom; zero below three windows. Scatter below about 1e-6 of the
    /// value itself is lost to rounding.
    pub fn residual_variance(&self) -> f32 {
        if self.windows < 3 {
            return 0.0;
        }
        self.residual_ss / self.windows.saturating_sub(2) as f32
    }

    /// Whether the values scatter around the line beyond their own rounding.
    pub(crate) fn scatters(&self) -> bool {
        let rounding = 1e-6 * self.line.value_mean;
        self.residual_variance() > rounding * rounding
    }

    pub(crate) fn write(&self, to: &mut Writer<'_>) {
        to.u32(self.windows);
        self.line.write(to);
        to.f32(self.residual_ss);
    }

    pub(crate) fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self { windows: from.u32()?, line: Line::read(from)?, residual_ss: from.f32()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the closed form of least squares in f64, on a line like the paper's (E_u in tens of thousands).
    #[test]
    fn learns_the_paper_like_line() {
        let mut fit = LineFit::EMPTY;
        let (mut sx, mut sv, mut sxx, mut sxv) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        let n = 400;
        for i in 0..n {
            let x = 14_000.0 + 90.0 * (i as f32) + 1000.0 * ((i * 37 % 101) as f32 - 50.0);
            let value = 0.175 + 1.26e-5 * x + 0.01 * ((i * 53 % 89) as f32 / 89.0 - 0.5);
            fit.add(x, value);
            let (x, value) = (f64::from(x), f64::from(value));
            sx += x;
            sv += value;
            sxx += x * x;
            sxv += x * value;
        }
        let n = f64::from(n);
        let b1 = (sxv - sx * sv / n) / (sxx - sx * sx / n);
        let b0 = (sv - b1 * sx) / n;
        assert!((f64::from(fit.b1()) / b1 - 1.0).abs() < 1e-4, "{} {b1}", fit.b1());
        assert!((f64::from(fit.b0()) / b0 - 1.0).abs() < 1e-4, "{} {b0}", fit.b0());
    }

    #[test]
    fn a_constant_x_gives_the_mean_and_no_slope() {
        let mut fit = LineFit::EMPTY;
        for value in [1.0, 2.0, 3.0] {
            fit.add(5e6, value);
        }
        assert_eq!((fit.b0(), fit.b1()), (2.0, 0.0));
        assert!((fit.residual_variance() - 2.0).abs() < 1e-6);
    }
}
