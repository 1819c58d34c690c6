//! The exact step of a linear plant while its input is held: `x(t+h) = phi x(t) + gamma q`, with both from one
//! matrix exponential, `exp([[a, b], [0, 0]] h) = [[phi, gamma], [0, 1]]` (Van Loan).

use nalgebra::DMatrix;

use super::StateSpace;
use crate::{Error, Result};

/// A plant's step over one span of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// n rows of n numbers, row by row.
    pub phi: Vec<f64>,
    /// n numbers: what a held input adds to the states over one step.
    pub gamma: Vec<f64>,
}

/// Discretises over `h` seconds.
///
/// # Errors
/// The numbers are so large that the exponential can't be computed.
pub fn discretise(plant: &StateSpace, h: f64) -> Result<Held> {
    let n = plant.order();
    let at = |row: usize, column: usize| match (plant.a.get(row), plant.b.get(row)) {
        (Some(a), Some(b)) => h * a.get(column).copied().unwrap_or(*b),
        _ => 0.0,
    };
    let scaled = DMatrix::from_fn(n + 1, n + 1, at);
    let size = scaled.iter().fold(0.0, |sum: f64, v| sum + v.abs());
    let refused = || {
        Error::new("the plant's numbers times the sample time are too large for its matrix exponential")
            .allowed("a sample time on the scale of the plant's time constants")
    };
    if size.is_nan() || size > 1e5 {
        return Err(refused());
    }
    let exponential = scaled.exp();
    if exponential.iter().any(|v| !v.is_finite()) {
        return Err(refused());
    }
    let phi =
        (0..n).flat_map(|row| (0..n).map(move |column| (row, column))).map(|at| exponential[at]).collect();
    Ok(Held { phi, gamma: (0..n).map(|row| exponential[(row, n)]).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Plant, TransferFunction};

    /// Eq. 13 of the paper, from its eq. 11 at 1 ms.
    #[test]
    fn the_papers_plant_has_the_papers_eigenvalues() {
        let (sigma, omega, lambda) = (-0.2, 2.0, -0.5);
        let a = vec![vec![sigma, omega, 0.0], vec![-omega, sigma, 0.0], vec![0.0, 0.0, lambda]];
        let plant = StateSpace { a, b: vec![1.0, 0.0, 0.0], c: vec![1.0, 0.0, 0.0], d: 0.0 };
        let held = discretise(&plant, 0.001).unwrap();
        let eigenvalues = DMatrix::from_row_slice(3, 3, &held.phi).complex_eigenvalues();
        for (re, im) in [(0.9998, 0.0020), (0.9998, -0.0020), (0.9995, 0.0)] {
            let near = eigenvalues.iter().any(|v| (v.re - re).abs() < 5e-5 && (v.im - im).abs() < 5e-5);
            assert!(near, "{eigenvalues}");
        }
    }

    #[test]
    fn a_double_integrator_has_its_closed_form() {
        let plant = Plant::TransferFunction(TransferFunction {
            num: vec![3.0],
            den: vec![1.0, 0.0, 0.0],
            delay_s: 0.0,
            offset: 0.0,
        });
        let plant = plant.linear().unwrap().unwrap();
        let held = discretise(&plant, 0.1).unwrap();
        for (got, want) in held.phi.iter().zip([1.0, 0.1, 0.0, 1.0]) {
            assert!((got - want).abs() < 1e-15);
        }
        for (got, want) in held.gamma.iter().zip([0.005, 0.1]) {
            assert!((got - want).abs() < 1e-15);
        }
        assert_eq!(plant.c, [3.0, 0.0]);
    }

    /// (2 s^2 + 1)/(s^2 + 3 s + 5) at s = 0 and at infinity.
    #[test]
    fn a_proper_transfer_function_keeps_its_gain_and_feedthrough() {
        let (num, den) = (vec![2.0, 0.0, 1.0], vec![1.0, 3.0, 5.0]);
        let plant = TransferFunction { num, den, delay_s: 0.0, offset: 0.0 };
        let plant = plant.state_space();
        assert_eq!(plant.d, 2.0);
        let a = DMatrix::from_fn(2, 2, |row, column| plant.a[row][column]);
        let b = DMatrix::from_column_slice(2, 1, &plant.b);
        let c = DMatrix::from_row_slice(1, 2, &plant.c);
        let gain = plant.d - (c * a.try_inverse().unwrap() * b)[(0, 0)];
        assert!((gain - 0.2).abs() < 1e-12, "{gain}");
    }

    #[test]
    fn absurd_numbers_are_refused_not_looped_over() {
        let plant = StateSpace { a: vec![vec![1e300]], b: vec![1.0], c: vec![1.0], d: 0.0 };
        assert!(discretise(&plant, 1e3).is_err());
    }
}
