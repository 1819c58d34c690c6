//! The step of a quantised y.

/// The coarsest grid that all values lie on: the smallest difference between distinct values, if all other differences
/// are multiples of it. `None` where there is none.
pub fn step(y: &[f64]) -> Option<f64> {
    let mut values: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    // Many distinct values for few samples: not a grid that matters.
    if values.len() < 2 || values.len() * 4 > y.len() {
        return None;
    }
    let size = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let differences: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 1e-9 * size).collect();
    let smallest = differences.iter().copied().fold(f64::INFINITY, f64::min);
    let mut step = smallest;
    for _ in 0..3 {
        // The mean over all differences is far more exact than the smallest alone.
        let (mut sum, mut count) = (0.0, 0.0);
        for d in &differences {
            let multiple = (d / step).round();
            if (d / step - multiple).abs() > 0.02 * multiple.max(1.0) {
                return None;
            }
            sum += d;
            count += multiple;
        }
        step = sum / count;
    }
    step.is_finite().then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_found_behind_rounded_text() {
        let y: Vec<f64> = (0..5000)
            .map(|i| ((libm::sin(0.01 * f64::from(i)) / 0.0371).round() * 0.0371 * 1e6).round() / 1e6)
            .collect();
        assert!((step(&y).unwrap() / 0.0371 - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_smooth_signal_has_none() {
        let y: Vec<f64> = (0..5000).map(|i| libm::sin(0.01 * f64::from(i))).collect();
        assert_eq!(step(&y), None);
    }
}
