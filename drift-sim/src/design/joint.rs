//! Several detectors at once: their false-alarm rates add, `1/L = sum of 1/L_i`.
//!
//! Right for detectors that alarm independently; detectors on the same residual tend to alarm together, so that
//! the truth is a little longer: the sum errs on the careful side.

use crate::{Error, Result};

use super::check;

/// The run length of all detectors together, from each one's; infinite for none.
pub fn joint_arl(arls: &[f64]) -> f64 {
    1.0 / arls.iter().map(|l| 1.0 / l).sum::<f64>()
}

/// What each detector's in-control run length must be so that together they have `arl0` decisions: detector i takes
/// `weights[i]/sum` of the false alarms.
///
/// # Errors
/// `arl0` is not above 1 and up to [`super::LARGEST_ARL0`]; there is no weight, or one is not a positive number.
pub fn share_arl0(arl0: f64, weights: &[f64]) -> Result<Vec<f64>> {
    check::arl0(arl0)?;
    let sum: f64 = weights.iter().sum();
    if weights.is_empty() || !weights.iter().all(|w| *w > 0.0 && w.is_finite()) || !sum.is_finite() {
        return Err(Error::new("the shares of the false alarms can't be used").allowed("positive numbers"));
    }
    Ok(weights.iter().map(|w| arl0 * sum / w).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shared_out_adds_up_again() {
        let shares = share_arl0(1000.0, &[1.0, 2.0, 5.0]).unwrap();
        assert!((joint_arl(&shares) - 1000.0).abs() < 1e-9);
        assert!((shares[0] - 8000.0).abs() < 1e-9, "an eighth of the false alarms");
        assert!(share_arl0(1000.0, &[1.0, -1.0]).is_err());
        assert!(share_arl0(f64::NAN, &[1.0]).is_err());
    }
}
