//! Running least squares of a straight line: the baseline learnt in place (equation 6) and the curve after an
//! alarm (equations 8 and 9).
//!
//! Means and centred sums are updated (Welford 1962), so that large E_u do not cancel: nothing is subtracted that
//! was summed before.

use crate::store::{Reader, Writer};

/// The fitted line without its scatter; whoever holds it counts the windows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Line {
    pub x_mean: f32,
    pub value_mean: f32,
    pub x_ss: f32,
    x_value_ss: f32,
}

impl Line {
    pub const EMPTY: Self = Self { x_mean: 0.0, value_mean: 0.0, x_ss: 0.0, x_value_ss: 0.0 };

    /// Adds a window, the `count`th; the value's distance from the mean before it and after it.
    pub fn add(&mut self, count: u32, x: f32, value: f32) -> (f32, f32) {
        let weight = 1.0 / count as f32;
        let (dx, before) = (x - self.x_mean, value - self.value_mean);
        self.x_mean += dx * weight;
        self.value_mean += before * weight;
        let after = value - self.value_mean;
        self.x_ss += dx * (x - self.x_mean);
        self.x_value_ss += dx * after;
        (before, after)
    }

    pub fn b1(&self, count: u32) -> f32 {
        let rounding = 1e-6 * self.x_mean;
        if self.x_ss > count as f32 * rounding * rounding { self.x_value_ss / self.x_ss } else { 0.0 }
    }

    pub fn write(&self, to: &mut Writer<'_>) {
        [self.x_mean, self.value_mean, self.x_ss, self.x_value_ss].into_iter().for_each(|w| to.f32(w));
    }

    pub fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            x_mean: from.f32()?,
            value_mean: from.f32()?,
            x_ss: from.f32()?,
            x_value_ss: from.f32()?,
        })
    }
}

/// `value = b0 + b1*x`, learnt one window at a time. Constant memory, one division per window.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LineFit {
    windows: u32,
    line: Line,
    value_ss: f32,
}

impl LineFit {
    /// No window yet.
    pub const EMPTY: Self = Self { windows: 0, line: Line::EMPTY, value_ss: 0.0 };

    /// Adds a window. At `u32::MAX` windows it stops learning.
    pub fn add(&mut self, x: f32, value: f32) {
        if self.windows == u32::MAX {
            return;
        }
        self.windows += 1;
        let (before, after) = self.line.add(self.windows, x, value);
        self.value_ss += before * after;
    }

    /// Windows so far.
    pub const fn windows(&self) -> u32 {
        self.windows
    }

    /// Mean of x.
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

    /// Intercept.
    pub fn b0(&self) -> f32 {
        self.line.value_mean - self.b1() * self.line.x_mean
    }

    /// Residual variance with n - 2 degrees of freedom; zero below three windows. The part of the scatter below
    /// about 1e-6 of the value's own is lost to rounding.
    pub fn residual_variance(&self) -> f32 {
        if self.windows < 3 {
            return 0.0;
        }
        let ss = self.value_ss - self.b1() * self.line.x_value_ss;
        if ss > 0.0 { ss / (self.windows - 2) as f32 } else { 0.0 }
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
