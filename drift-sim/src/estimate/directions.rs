//! Orthonormal directions, and what is left of a column beside them.

use super::inner_product::dot;

/// Part of a column's squares that must be left beside those before it for it to be a direction of its own.
const LEAST_LEFT: f64 = 1e-10;

/// Orthonormal directions of what columns of one length span.
pub fn orthonormal(columns: impl Iterator<Item = impl AsRef<[f64]>>) -> Vec<Vec<f64>> {
    let mut directions: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let column = column.as_ref();
        let size = dot(column, column);
        let mut left = column.to_vec();
        // Twice: the first time leaves what is rounded.
        take_out(&directions, &mut left);
        take_out(&directions, &mut left);
        let norm = dot(&left, &left);
        if norm > LEAST_LEFT * size && norm > 0.0 {
            let factor = 1.0 / libm::sqrt(norm);
            left.iter_mut().for_each(|x| *x *= factor);
            directions.push(left);
        }
    }
    directions
}

/// Takes out of a column what lies in orthonormal directions.
pub fn take_out(directions: &[Vec<f64>], x: &mut [f64]) {
    for direction in directions {
        let along = dot(direction, x);
        x.iter_mut().zip(direction).for_each(|(x, d)| *x -= along * d);
    }
}

/// What is left of it.
pub fn without(directions: &[Vec<f64>], mut x: Vec<f64>) -> Vec<f64> {
    take_out(directions, &mut x);
    x
}
