//! Gauss-Legendre quadrature, on one interval and on a row of panels.

use std::f64::consts::PI;

/// A point and its weight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub at: f64,
    pub weight: f64,
}

/// The `count`-point rule on [-1, 1], in ascending order: exact for polynomials up to degree `2 count - 1`.
/// Newton's iteration on the Legendre polynomial, from Tricomi's starting values.
pub(crate) fn gauss_legendre(count: usize) -> Vec<Node> {
    let n = count as f64;
    let node = |i: usize| {
        let mut x = -(PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (value, derivative) = legendre(count, x);
            slope = derivative;
            let step = value / derivative;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        Node { at: x, weight: 2.0 / ((1.0 - x * x) * slope * slope) }
    };
    (0..count).map(node).collect()
}

/// The Legendre polynomial of degree `n` and its derivative at `x`, by the three-term recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut value) = (0.0, 1.0);
    for i in 0..n {
        let i = i as f64;
        (previous, value) = (value, ((2.0 * i + 1.0) * x * value - i * previous) / (i + 1.0));
    }
    (value, n as f64 * (x * value - previous) / (x * x - 1.0))
}

/// The rule moved to [`from`, `to`].
pub(crate) fn on(rule: &[Node], from: f64, to: f64) -> impl Iterator<Item = Node> + '_ {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    rule.iter().map(move |node| Node { at: middle + half * node.at, weight: half * node.weight })
}

/// [`from`, `to`] in equal panels no wider than `widest`, the rule on each.
pub(crate) fn panels(rule: &[Node], from: f64, to: f64, widest: f64) -> Vec<Node> {
    let count = ((to - from) / widest).ceil().max(1.0) as usize;
    let edge = |i: usize| from + (to - from) * i as f64 / count as f64;
    (0..count).flat_map(|i| on(rule, edge(i), edge(i + 1))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_a_polynomial_of_degree_2n_minus_1_exactly() {
        for n in [1, 2, 5, 16, 32, 64] {
            let degree = 2 * n as i32 - 1;
            let integral: f64 = on(&gauss_legendre(n), 0.0, 1.0).map(|p| p.weight * p.at.powi(degree)).sum();
            assert!((integral * f64::from(degree + 1) - 1.0).abs() < 1e-13, "{n} points: {integral}");
        }
    }
}
