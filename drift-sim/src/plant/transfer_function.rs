//! A transfer function `num(s)/den(s)*exp(-delay_s*s)` from `u + offset` to y, coefficients from the highest power of s
//! down.

use super::StateSpace;

/// Coefficients and dead time.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    /// Numerator, highest power first; not longer than `den`.
    pub num: Vec<f64>,
    /// Denominator, highest power first; the first is not zero.
    pub den: Vec<f64>,
    /// Dead time in seconds, >= 0.
    pub delay_s: f64,
    /// Drive at u = 0, in the unit of u: what u must be less of this for the plant to rest at y = 0.
    pub offset: f64,
}

impl TransferFunction {
    /// The controllable canonical form.
    pub(super) fn state_space(&self) -> StateSpace {
        let order = self.den.len().saturating_sub(1);
        let lead = self.den.first().copied().unwrap_or(1.0);
        let den: Vec<f64> = self.den.iter().map(|c| c / lead).collect();
        let mut num = vec![0.0; (order + 1).saturating_sub(self.num.len())];
        num.extend(self.num.iter().map(|c| c / lead));
        let d = num.first().copied().unwrap_or(0.0);
        // State i is the i-th derivative of the auxiliary output; the last row holds the denominator.
        let a = (0..order)
            .map(|row| {
                let shifted = |column| if column == row + 1 { 1.0 } else { 0.0 };
                (0..order)
                    .map(|column| if row + 1 == order { -den[order - column] } else { shifted(column) })
                    .collect()
            })
            .collect();
        let b = (0..order).map(|row| if row + 1 == order { 1.0 } else { 0.0 }).collect();
        let c = (0..order).map(|i| num[order - i] - den[order - i] * d).collect();
        StateSpace { a, b, c, d }
    }
}
