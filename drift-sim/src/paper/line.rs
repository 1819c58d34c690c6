//! The line `J_e = b0 + b1 E_u` by ordinary least squares (equations 4 and 6), with its intervals and bands as any
//! statistics package gives them: they take the windows as independent, which overlapping ones are not.

use drift_core::Baseline;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::settings::CONFIDENCE;
use crate::{Error, Result};

/// A fitted line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Intercept, units of J_e.
    pub b0: f64,
    /// Slope, units of J_e per unit of E_u.
    pub b1: f64,
    /// 95 % confidence interval of the intercept.
    pub b0_ci95: (f64, f64),
    /// 95 % confidence interval of the slope.
    pub b1_ci95: (f64, f64),
    /// Share of the variance that the line explains.
    pub r2: f64,
    /// The same, for the two degrees of freedom.
    pub adj_r2: f64,
    /// Standard deviation of the residuals with n - 2 degrees of freedom, units of J_e.
    pub rmse: f64,
    /// Windows.
    pub n: usize,
    /// Correlation of a window's residual with the next one's.
    pub lag1: f64,
    /// Mean of x.
    pub x_mean: f64,
    /// Sum of squared deviations of x.
    pub x_ss: f64,
    /// Student's quantile of the intervals.
    pub t: f64,
}

impl Line {
    /// Fits (E_u, J_e), window by window in their order.
    ///
    /// # Errors
    /// Fewer than three windows, or all at one x.
    pub fn fit(points: &[(f64, f64)]) -> Result<Self> {
        let n = points.len() as f64;
        let x_mean = points.iter().map(|p| p.0).sum::<f64>() / n;
        let y_mean = points.iter().map(|p| p.1).sum::<f64>() / n;
        let x_ss: f64 = points.iter().map(|p| (p.0 - x_mean) * (p.0 - x_mean)).sum();
        let y_ss: f64 = points.iter().map(|p| (p.1 - y_mean) * (p.1 - y_mean)).sum();
        let xy_ss: f64 = points.iter().map(|p| (p.0 - x_mean) * (p.1 - y_mean)).sum();
        if points.len() < 3 || !(x_ss > 0.0 && y_ss > 0.0) {
            return Err(Error::new(format!("no line through {} windows", points.len()))
                .allowed("at least three windows, not all alike"));
        }
        let b1 = xy_ss / x_ss;
        let b0 = y_mean - b1 * x_mean;
        let residuals: Vec<f64> = points.iter().map(|(x, y)| y - (b0 + b1 * x)).collect();
        let sse: f64 = residuals.iter().map(|r| r * r).sum();
        let rmse = (sse / (n - 2.0)).sqrt();
        let r2 = 1.0 - sse / y_ss;
        let t = student(CONFIDENCE, n - 2.0)?;
        let (b0_half, b1_half) =
            (t * rmse * (1.0 / n + x_mean * x_mean / x_ss).sqrt(), t * rmse / x_ss.sqrt());
        Ok(Self {
            b0,
            b1,
            b0_ci95: (b0 - b0_half, b0 + b0_half),
            b1_ci95: (b1 - b1_half, b1 + b1_half),
            r2,
            adj_r2: 1.0 - (1.0 - r2) * (n - 1.0) / (n - 2.0),
            rmse,
            n: points.len(),
            lag1: lag1(&residuals),
            x_mean,
            x_ss,
            t,
        })
    }

    /// The line at x.
    pub fn at(&self, x: f64) -> f64 {
        self.b0 + self.b1 * x
    }

    /// Half the width of the confidence band of the mean at x.
    pub fn confidence_half(&self, x: f64) -> f64 {
        self.t * self.rmse * self.leverage(x).sqrt()
    }

    /// Half the width of the prediction band for one window at x.
    pub fn prediction_half(&self, x: f64) -> f64 {
        self.t * self.rmse * (1.0 + self.leverage(x)).sqrt()
    }

    fn leverage(&self, x: f64) -> f64 {
        1.0 / self.n as f64 + (x - self.x_mean) * (x - self.x_mean) / self.x_ss
    }

    /// For the monitor, with the line's own uncertainty: |z| > t is then outside the prediction band.
    pub fn baseline(&self) -> Baseline {
        Baseline {
            windows: self.n as f32,
            x_mean: self.x_mean as f32,
            x_ss: self.x_ss as f32,
            ..self.known_baseline()
        }
    }

    /// For the monitor, taken as exactly known.
    pub fn known_baseline(&self) -> Baseline {
        Baseline::known(self.b0 as f32, self.b1 as f32, self.rmse as f32)
    }
}

/// The two-sided quantile of Student's distribution.
fn student(confidence: f64, freedom: f64) -> Result<f64> {
    let law = StudentsT::new(0.0, 1.0, freedom)
        .map_err(|e| Error::new(format!("{freedom} degrees of freedom: {e}")))?;
    Ok(law.inverse_cdf(0.5 + 0.5 * confidence))
}

/// Correlation of a series with itself one step later.
pub(super) fn lag1(series: &[f64]) -> f64 {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    let products: f64 = series.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    let squares: f64 = series.iter().map(|v| (v - mean) * (v - mean)).sum();
    products / squares
}
