//! A one-sided CUSUM's mean run length in closed form, for residuals that are neither normal nor independent.
//!
//! Siegmund's formula with the root of the sum's own cumulants in place of the normal one's:
//! `L = (exp(t b) - 1 - t b)/(D t)`, `D = k - mean`, `b = h + 1.166 Omega`, and t > 0 the root of
//! `-D t + Omega^2 t^2/2 + kappa3 t^3/6 = 0`. With kappa3 = 0 it is the formula of Kim et al. (2007). It serves for the
//! delays that are printed; the thresholds themselves are simulated.

/// A side of a chart: reference value and threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OneSide {
    pub k: f64,
    pub h: f64,
}

/// Mean run length, decisions, where the residual has this mean, long-run variance and third cumulant (seen from this
/// side: its sign changes for the lower one).
pub(super) fn cusum(side: OneSide, mean: f64, long_run_variance: f64, third_cumulant: f64) -> f64 {
    let away = side.k - mean;
    let b = side.h + 1.166 * long_run_variance.sqrt();
    let half = 0.5 * long_run_variance;
    let discriminant = half * half + 2.0 / 3.0 * third_cumulant * away;
    let root = 2.0 * away / (half + discriminant.max(0.0).sqrt());
    let x = root * b;
    if x.abs() < 1e-3 {
        return b * b / long_run_variance;
    }
    (libm::expm1(x.min(600.0)) - x) / (away * root)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::siegmund;

    #[test]
    fn without_skewness_it_is_siegmunds() {
        for h in [3.0, 5.0, 8.0] {
            for mean in [0.0, 0.3, 1.0] {
                let side = |mean: f64| cusum(OneSide { k: 0.5, h }, mean, 1.0, 0.0);
                let own = 1.0 / (1.0 / side(mean) + 1.0 / side(-mean));
                assert!((own / siegmund::two_sided_arl(0.5, h, mean) - 1.0).abs() < 1e-9);
            }
        }
    }
}
