//! The healthy line of one channel, `value = b0 + b1*x` (equation 6), by ordinary least squares, and how well it is known.
//!
//! The plain confidence intervals assume independent residuals of equal variance. The `_hac` ones do not (Newey & West
//! 1987): they are what to believe where neighbouring windows are correlated or the scatter changes with x. The bands are the plain ones.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::{Error, Result};

/// Level of all intervals and bands.
const LEVEL: f64 = 0.95;

/// A line fitted by least squares, `value = b0 + b1*x`, with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Windows that it was fitted to.
    pub n: usize,
    /// Intercept, value units.
    pub b0: f64,
    /// Slope, value units per x unit; 0 where x does not vary.
    pub b1: f64,
    /// Whether x varied: otherwise the line is the mean value.
    pub has_slope: bool,
    /// 95 % confidence interval of b0, independent residuals assumed.
    pub b0_ci95: [f64; 2],
    /// 95 % confidence interval of b1, independent residuals assumed.
    pub b1_ci95: [f64; 2],
    /// 95 % confidence interval of b0, autocorrelation and unequal variance allowed for (Newey and West 1987).
    pub b0_ci95_hac: [f64; 2],
    /// 95 % confidence interval of b1, the same.
    pub b1_ci95_hac: [f64; 2],
    /// Share of the value's variance that the line explains; 0 where the value does not vary.
    pub r2: f64,
    /// The same, adjusted for the number of coefficients.
    pub adj_r2: f64,
    /// Root of the residual variance, value units (n - 2 degrees of freedom, n - 1 without a slope).
    pub rmse: f64,
    /// Mean of x, x units.
    pub x_mean: f64,
    /// Sum of squared deviations of x.
    pub x_ss: f64,
    /// Smallest and largest x.
    pub x_range: [f64; 2],
    /// Value minus line, in the order of the data.
    pub residuals: Vec<f64>,
    t: f64,
}

/// Fits a line; `reach` is how many neighbours a residual may be correlated with beyond Newey & West's rule
/// `4 (n/100)^(2/9)`, which overlapping windows need.
///
/// # Errors
/// Fewer than three points, unequal lengths, a number that is not finite.
pub fn fit(x: &[f64], value: &[f64], reach: usize) -> Result<Fit> {
    let n = x.len();
    if n != value.len() || n < 3 || !x.iter().chain(value).all(|v| v.is_finite()) {
        return Err(Error::new(format!("no line through {n} and {} points", value.len()))
            .allowed("3 or more pairs of finite numbers"));
    }
    let count = n as f64;
    let mean = |of: &[f64]| of.iter().sum::<f64>() / count;
    let (x_mean, value_mean) = (mean(x), mean(value));
    let cross = |a: &[f64], a_mean: f64, b: &[f64], b_mean: f64| {
        a.iter().zip(b).map(|(a, b)| (a - a_mean) * (b - b_mean)).sum::<f64>()
    };
    let x_ss = cross(x, x_mean, x, x_mean);
    let x_range = x.iter().fold([f64::MAX, f64::MIN], |[lo, hi], &x| [lo.min(x), hi.max(x)]);
    // x comes from f32: what varies less than that rounds does not vary.
    let rounding = 1e-6 * x_range[0].abs().max(x_range[1].abs());
    let has_slope = x_ss > count * rounding * rounding;
    let b1 = if has_slope { cross(x, x_mean, value, value_mean) / x_ss } else { 0.0 };
    let b0 = value_mean - b1 * x_mean;
    let residuals: Vec<f64> = x.iter().zip(value).map(|(x, v)| v - value_mean - b1 * (x - x_mean)).collect();
    let coefficients = if has_slope { 2.0 } else { 1.0 };
    let freedom = count - coefficients;
    let rss: f64 = residuals.iter().map(|e| e * e).sum();
    let total = cross(value, value_mean, value, value_mean);
    let rmse = (rss / freedom).sqrt();
    let r2 = if total > 0.0 { 1.0 - rss / total } else { 0.0 };
    let t = quantile(freedom);
    let interval = |at: f64, error: f64| [at - t * error, at + t * error];
    let slope_variance = if has_slope { 1.0 / x_ss } else { 0.0 };
    let b0_error = rmse * (1.0 / count + x_mean * x_mean * slope_variance).sqrt();
    let [hac_b0, hac_b1] = newey_west(x, &residuals, x_mean, x_ss, has_slope, reach);
    Ok(Fit {
        n,
        b0,
        b1,
        has_slope,
        b0_ci95: interval(b0, b0_error),
        b1_ci95: interval(b1, rmse * slope_variance.sqrt()),
        b0_ci95_hac: interval(b0, hac_b0),
        b1_ci95_hac: interval(b1, hac_b1),
        r2,
        adj_r2: 1.0 - (1.0 - r2) * (count - 1.0) / freedom,
        rmse,
        x_mean,
        x_ss: if has_slope { x_ss } else { 0.0 },
        x_range,
        residuals,
        t,
    })
}

impl Fit {
    /// The line at x.
    pub fn at(&self, x: f64) -> f64 {
        self.b0 + self.b1 * x
    }

    /// Where the line itself lies at x, with 95 % confidence.
    pub fn confidence_band(&self, x: f64) -> [f64; 2] {
        self.band(x, 0.0)
    }

    /// Where 95 % of further windows at x lie.
    pub fn prediction_band(&self, x: f64) -> [f64; 2] {
        self.band(x, 1.0)
    }

    /// The wider of the two intervals of b0.
    pub fn b0_ci95_wide(&self) -> [f64; 2] {
        wider(self.b0_ci95, self.b0_ci95_hac)
    }

    /// The wider of the two intervals of b1.
    pub fn b1_ci95_wide(&self) -> [f64; 2] {
        wider(self.b1_ci95, self.b1_ci95_hac)
    }

    fn band(&self, x: f64, own: f64) -> [f64; 2] {
        let from_mean = x - self.x_mean;
        let leverage = if self.x_ss > 0.0 { from_mean * from_mean / self.x_ss } else { 0.0 };
        let half = self.t * self.rmse * (own + 1.0 / self.n as f64 + leverage).sqrt();
        [self.at(x) - half, self.at(x) + half]
    }
}

fn wider(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    if a[1] - a[0] >= b[1] - b[0] { a } else { b }
}

fn quantile(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.5 + 0.5 * LEVEL))
}

/// Standard errors of b0 and b1 with Bartlett weights, and the small-sample factor n/(n - 2).
fn newey_west(
    x: &[f64],
    residuals: &[f64],
    x_mean: f64,
    x_ss: f64,
    has_slope: bool,
    reach: usize,
) -> [f64; 2] {
    let n = residuals.len() as f64;
    let lags = ((4.0 * (n / 100.0).powf(2.0 / 9.0)) as usize).max(reach).min(residuals.len() / 4);
    // The influence of each residual on the mean level and on the slope.
    let level: Vec<f64> = residuals.iter().map(|e| e / n).collect();
    let slope: Vec<f64> = if has_slope {
        x.iter().zip(residuals).map(|(x, e)| (x - x_mean) / x_ss * e).collect()
    } else {
        vec![0.0; residuals.len()]
    };
    let b0: Vec<f64> = level.iter().zip(&slope).map(|(l, s)| l - x_mean * s).collect();
    let error = |influence: &[f64]| {
        let product = |lag: usize| influence.iter().zip(&influence[lag..]).map(|(a, b)| a * b).sum::<f64>();
        let weighted = |lag: usize| 2.0 * (1.0 - lag as f64 / (lags + 1) as f64) * product(lag);
        let variance = product(0) + (1..=lags).map(weighted).sum::<f64>();
        (variance.max(0.0) * n / (n - 2.0)).sqrt()
    };
    [error(&b0), error(&slope)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Anscombe's first quartet (1973): published line 3.00 + 0.500 x, R^2 0.667, standard errors 1.125 and 0.118.
    #[test]
    fn anscombe() {
        let x = [10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0];
        let y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68];
        let fit = fit(&x, &y, 0).unwrap();
        assert_relative_eq!(fit.b0, 3.000_090_9, epsilon = 1e-6);
        assert_relative_eq!(fit.b1, 0.500_090_9, epsilon = 1e-6);
        assert_relative_eq!(fit.r2, 0.666_542_5, epsilon = 1e-6);
        assert_relative_eq!(fit.adj_r2, 0.629_491_6, epsilon = 1e-6);
        assert_relative_eq!(fit.rmse, 1.236_603, epsilon = 1e-6);
        // t of 9 degrees of freedom at 97.5 %: 2.262157.
        assert_relative_eq!(fit.b0_ci95[1] - fit.b0, 2.262_157 * 1.124_747, epsilon = 1e-5);
        assert_relative_eq!(fit.b1_ci95[1] - fit.b1, 2.262_157 * 0.117_905_5, epsilon = 1e-5);
        // At the mean of x (9) the line is known to rmse/sqrt(n).
        let [low, high] = fit.confidence_band(9.0);
        assert_relative_eq!(high - low, 2.0 * 2.262_157 * 1.236_603 / 11f64.sqrt(), epsilon = 1e-5);
        let [low, high] = fit.prediction_band(9.0);
        assert_relative_eq!(high - low, 2.0 * 2.262_157 * 1.236_603 * (12f64 / 11.0).sqrt(), epsilon = 1e-5);
    }

    #[test]
    fn a_constant_x_has_no_slope_and_says_so() {
        let fit = fit(&[5e6; 4], &[1.0, 2.0, 3.0, 2.0], 0).unwrap();
        assert!(!fit.has_slope);
        assert_eq!((fit.b0, fit.b1, fit.b1_ci95, fit.x_ss), (2.0, 0.0, [0.0, 0.0], 0.0));
        assert_relative_eq!(fit.rmse, (2.0f64 / 3.0).sqrt());
    }

    /// Each residual four times over: the mean is known half as well as the plain interval believes.
    #[test]
    fn correlated_residuals_widen_the_interval() {
        use rand_chacha::rand_core::{Rng, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let value: Vec<f64> = (0..1000).flat_map(|_| [f64::from(random.next_u32()); 4]).collect();
        let x = vec![1.0; value.len()];
        let fit = fit(&x, &value, 60).unwrap();
        let ratio = (fit.b0_ci95_hac[1] - fit.b0) / (fit.b0_ci95[1] - fit.b0);
        assert!((1.7..2.2).contains(&ratio), "{ratio}");
    }

    #[test]
    fn impossible_data_is_an_error() {
        assert!(fit(&[1.0, 2.0], &[1.0, 2.0], 0).is_err());
        assert!(fit(&[1.0, 2.0, f64::NAN], &[1.0, 2.0, 3.0], 0).is_err());
    }
}
