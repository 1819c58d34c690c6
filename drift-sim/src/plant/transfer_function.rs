//! A transfer function `num(s)/den(s)*exp(-delay_s*s)` from `u + offset` to y, coefficients from the highest power of s
//! down.

use super::number::put;
use super::{Number, Role, StateSpace};

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
    /// The coefficients that are not zero (but for the first of the denominator, which only scales the others), the dead time and the
    /// offset where there are any.
    pub(super) fn numbers(&self) -> Vec<Number> {
        let mut plant = self.clone();
        let names = self.names();
        plant
            .slots()
            .into_iter()
            .zip(names)
            .map(|(slot, (name, role))| Number::new(name, *slot, role))
            .collect()
    }

    pub(super) fn with_numbers(&self, values: &[f64]) -> Self {
        let mut plant = self.clone();
        put(values, plant.slots());
        plant
    }

    fn names(&self) -> Vec<(String, Role)> {
        let of = |what: &str, coefficients: &[f64], role, held: Option<usize>| -> Vec<(String, Role)> {
            let free = |(i, c): &(usize, &f64)| **c != 0.0 && Some(*i) != held;
            let numbered = coefficients.iter().enumerate().filter(free);
            numbered.map(|(i, _)| (format!("{what}[{i}]"), role)).collect()
        };
        let mut names = of("num", &self.num, Role::Gain, None);
        names.extend(of("den", &self.den, Role::Shape, Some(self.held())));
        names.extend((self.delay_s > 0.0).then(|| ("delay_s".to_owned(), Role::Delay)));
        names.push(("offset".to_owned(), Role::Offset));
        names
    }

    /// The coefficient of den that is no number of its own, for it only scales all the others: the last, so that num is the gain; the first where the plant
    /// integrates.
    fn held(&self) -> usize {
        match self.den.last() {
            Some(last) if *last != 0.0 => self.den.len() - 1,
            _ => 0,
        }
    }

    fn slots(&mut self) -> Vec<&mut f64> {
        let held = self.held();
        let nonzero = |c: &&mut f64| **c != 0.0;
        let mut slots: Vec<&mut f64> = self.num.iter_mut().filter(nonzero).collect();
        let den = self.den.iter_mut().enumerate().filter(|(i, c)| *i != held && **c != 0.0);
        slots.extend(den.map(|(_, c)| c));
        slots.extend(Some(&mut self.delay_s).filter(|delay| **delay > 0.0));
        slots.push(&mut self.offset);
        slots
    }

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
