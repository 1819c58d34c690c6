//! Limits of u as a recording shows them: values at an end of its range at which it stays.

use crate::controller::Limits;

/// Samples in a row at an extreme that make it a limit.
const RUN: usize = 3;
/// Of all samples, at least this part stands at a limit.
const SHARE: f64 = 0.002;

/// The limits that u seems to have: an extreme of it, reached often and kept for several samples. A u of few levels has
/// such extremes without a limit; whether one is needed shows when the law is replayed.
pub fn seen(u: &[f64]) -> Limits {
    let extreme = |better: fn(f64, f64) -> f64| u.iter().copied().filter(|u| u.is_finite()).reduce(better);
    let kept = |value: &f64| {
        let is_there = |u: &f64| (u - value).abs() <= 1e-9 * value.abs().max(1e-12);
        let count = u.iter().filter(|u| is_there(u)).count();
        let in_a_row = u.windows(RUN).any(|window| window.iter().all(is_there));
        in_a_row && count as f64 >= SHARE * u.len() as f64 && count < u.len()
    };
    Limits {
        u_min: extreme(f64::min).filter(kept).unwrap_or(f64::NEG_INFINITY),
        u_max: extreme(f64::max).filter(kept).unwrap_or(f64::INFINITY),
    }
}

/// Whether a u is away from both limits, where the law itself shows.
pub fn inside(limits: Limits, u: f64) -> bool {
    let slack = |limit: f64| if limit.is_finite() { 1e-9 * limit.abs() } else { 0.0 };
    u > limits.u_min + slack(limits.u_min) && u < limits.u_max - slack(limits.u_max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extreme_that_is_kept_is_a_limit_and_a_peak_is_none() {
        let clipped: Vec<f64> = (0..1000).map(|n| (10.0 * f64::sin(f64::from(n) / 30.0)).min(7.0)).collect();
        assert_eq!(seen(&clipped), Limits { u_min: f64::NEG_INFINITY, u_max: 7.0 });
        assert!(!inside(seen(&clipped), 7.0) && inside(seen(&clipped), 6.9));
        assert_eq!(seen(&[3.0; 50]), Limits::NONE);
    }
}
