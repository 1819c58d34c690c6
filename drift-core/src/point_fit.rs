//! What a measured operating point adds to a line learnt in place: `value = b0 + b1*x + weight*point`.
//!
//! The line's own prediction errors, of the value and of the point, carry what x does not explain; the weight is their
//! regression on each other (Frisch & Waugh 1933), one window at a time and without a sum that could cancel.

use crate::line_fit::LineFit;
use crate::operating_point::OperatingPoint;
use crate::store::{Reader, Writer};

/// Saved bytes of one fit.
pub(crate) const POINT_FIT_BYTES: usize = 28;

/// The point's part of one channel's relation. Constant memory.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct PointFit {
    mean: f32,
    /// Sum of the products of the deviations of x and the point.
    x_point_ss: f32,
    /// Sum of squares of the point that x does not explain, and of its products with the value.
    ss: f32,
    value_ss: f32,
    residual_ss: f32,
    min: f32,
    max: f32,
}

impl PointFit {
    pub(crate) const EMPTY: Self = Self {
        mean: 0.0,
        x_point_ss: 0.0,
        ss: 0.0,
        value_ss: 0.0,
        residual_ss: 0.0,
        min: f32::MAX,
        max: f32::MIN,
    };

    /// Adds a window that `line` has not learnt yet; false, and nothing learnt, where a sum would overflow.
    pub(crate) fn add(&mut self, line: &LineFit, x: f32, value: f32, point: f32) -> bool {
        let mut next = *self;
        let (dx, from_mean) = (x - line.x_mean(), point - next.mean);
        if let Some((error, variance)) = line.prediction_error(x, value) {
            let point_error = if line.x_varies() { from_mean - next.per_x(line) * dx } else { from_mean };
            next.learn_weight(line.windows(), point_error, error, variance);
        }
        next.mean += from_mean / line.windows().saturating_add(1) as f32;
        next.x_point_ss += dx * (point - next.mean);
        next.min = if point < next.min { point } else { next.min };
        next.max = if point > next.max { point } else { next.max };
        let finite = next.finite();
        if finite {
            *self = next;
        }
        finite
    }

    fn learn_weight(&mut self, windows: u32, point_error: f32, error: f32, variance: f32) {
        if self.varies(windows) {
            let error = error - self.weight() * point_error;
            self.residual_ss += error * error / (variance + point_error * (point_error / self.ss));
        } else if point_error.abs() <= 1e-6 * self.mean.abs() {
            // The point stands still so far: the line alone.
            self.residual_ss += error * error / variance;
        }
        self.ss += point_error * (point_error / variance);
        self.value_ss += point_error * (error / variance);
    }

    /// The point has varied beyond its own rounding, apart from x.
    pub(crate) fn varies(&self, windows: u32) -> bool {
        let rounding = 1e-6 * self.mean;
        self.ss > windows as f32 * rounding * rounding
    }

    fn weight(&self) -> f32 {
        self.value_ss / self.ss
    }

    fn per_x(&self, line: &LineFit) -> f32 {
        if line.x_varies() { self.x_point_ss / line.x_ss() } else { 0.0 }
    }

    /// What it adds to the line.
    pub(crate) fn operating_point(&self, line: &LineFit) -> OperatingPoint {
        OperatingPoint {
            weight: self.weight(),
            mean: self.mean,
            per_x: self.per_x(line),
            ss: self.ss,
            min: self.min,
            max: self.max,
        }
    }

    /// Slope and intercept of the line beside the point.
    pub(crate) fn slope_and_intercept(&self, line: &LineFit) -> (f32, f32) {
        let b1 = line.b1() - self.weight() * self.per_x(line);
        (b1, line.value_mean() - b1 * line.x_mean() - self.weight() * self.mean)
    }

    /// Residual variance with n - 3 degrees of freedom; zero below four windows.
    pub(crate) fn residual_variance(&self, windows: u32) -> f32 {
        if windows < 4 { 0.0 } else { self.residual_ss / windows.saturating_sub(3) as f32 }
    }

    fn words(&self) -> [f32; 7] {
        [self.mean, self.x_point_ss, self.ss, self.value_ss, self.residual_ss, self.min, self.max]
    }

    fn finite(&self) -> bool {
        self.words().iter().all(|w| w.is_finite())
    }

    pub(crate) fn possible(&self, windows: u32) -> bool {
        self.finite() && self.ss >= 0.0 && self.residual_ss >= 0.0 && (windows == 0 || self.min <= self.max)
    }

    pub(crate) fn write(&self, to: &mut Writer<'_>) {
        self.words().into_iter().for_each(|w| to.f32(w));
    }

    pub(crate) fn read(from: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            mean: from.f32()?,
            x_point_ss: from.f32()?,
            ss: from.f32()?,
            value_ss: from.f32()?,
            residual_ss: from.f32()?,
            min: from.f32()?,
            max: from.f32()?,
        })
    }
}
