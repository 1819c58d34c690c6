//! The step of a quantised y.

/// A grid of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Distance of neighbours, in the unit of y.
    pub step: f64,
    /// Half width of its interval: what the text's own rounding leaves open over the whole range.
    pub half_width: f64,
}

/// The coarsest grid that all values lie on: the smallest difference between distinct values, if all other differences
/// are multiples of it. `None` where there is none.
pub fn grid(y: &[f64]) -> Option<Grid> {
    let mut values: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    // Many distinct values for few samples: not a grid that matters.
    if values.len() < 2 || values.len() * 4 > y.len() {
        return None;
    }
    let size = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let between = values.iter().zip(values.iter().skip(1)).map(|(a, b)| b - a);
    let differences: Vec<f64> = between.filter(|d| *d > 1e-9 * size).collect();
    let mut step = differences.iter().copied().fold(f64::INFINITY, f64::min);
    let mut half_width = 0.0;
    for _ in 0..3 {
        // The mean over all differences is far more exact than the smallest alone.
        let (mut sum, mut count, mut worst) = (0.0, 0.0, 1e-9 * size);
        for d in &differences {
            let multiple = (d / step).round();
            if (d / step - multiple).abs() > 0.02 * multiple.max(1.0) {
                return None;
            }
            worst = f64::max(worst, (d - multiple * step).abs());
            sum += d;
            count += multiple;
        }
        step = sum / count;
        half_width = 2.0 * worst / count;
    }
    step.is_finite().then_some(Grid { step, half_width })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_found_behind_rounded_text() {
        let y: Vec<f64> = (0..5000)
            .map(|i| ((libm::sin(0.01 * f64::from(i)) / 0.0371).round() * 0.0371 * 1e6).round() / 1e6)
            .collect();
        assert!((grid(&y).unwrap().step / 0.0371 - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_smooth_signal_has_none() {
        let y: Vec<f64> = (0..5000).map(|i| libm::sin(0.01 * f64::from(i))).collect();
        assert_eq!(grid(&y), None);
    }
}
