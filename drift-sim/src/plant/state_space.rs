//! Any linear plant with one input and one output: `dx/dt = a x + b u`, `y = c x + d u`, u held over a sample
//! (the paper's eq. 10-12 are one).

use super::{Number, Role};

/// Whether two magnitudes are one number.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b
}

/// Matrices in continuous time.
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    /// n rows of n numbers.
    pub a: Vec<Vec<f64>>,
    /// n numbers: how u drives the states.
    pub b: Vec<f64>,
    /// n numbers: how y is made of the states.
    pub c: Vec<f64>,
    /// Feedthrough. y is sampled just before u changes, so the u in it is the one held until then.
    pub d: f64,
}

impl StateSpace {
    /// The magnitudes in `a`, and the gain.
    pub(super) fn numbers(&self) -> Vec<Number> {
        let magnitudes = self.magnitudes().into_iter().enumerate();
        let numbers = magnitudes.map(|(i, value)| Number::new(format!("a{}", i + 1), value, Role::Shape));
        numbers.chain([Number::new("gain", 1.0, Role::Gain)]).collect()
    }

    pub(super) fn with_numbers(&self, values: &[f64]) -> Self {
        let mut plant = self.clone();
        let magnitudes = self.magnitudes();
        for (before, after) in magnitudes.iter().zip(values) {
            let entries = plant.a.iter_mut().zip(&self.a).flat_map(|(row, own)| row.iter_mut().zip(own));
            for (entry, own) in entries.filter(|(_, own)| same(own.abs(), *before)) {
                *entry = after * own.signum();
            }
        }
        if let Some(gain) = values.get(magnitudes.len()) {
            plant.b.iter_mut().for_each(|b| *b *= gain);
            plant.d *= gain;
        }
        plant
    }

    /// The different magnitudes in `a`, each once: entries of equal magnitude are one number of the physics (the two damping entries
    /// and the two frequency entries of an oscillator, say) and move together.
    fn magnitudes(&self) -> Vec<f64> {
        let mut found: Vec<f64> = Vec::new();
        for value in self.a.iter().flatten().map(|v| v.abs()).filter(|v| *v > 0.0) {
            if !found.iter().any(|other| same(*other, value)) {
                found.push(value);
            }
        }
        found
    }

    /// The number of states.
    pub fn order(&self) -> usize {
        self.b.len()
    }

    /// dy/dt under a held drive: its part of each state, `c a`, and of the drive, `c b`.
    pub fn rate_of_output(&self) -> (Vec<f64>, f64) {
        let column = |j: usize| self.a.iter().map(move |row| row.get(j).copied().unwrap_or(0.0));
        let with_c = |x: &mut dyn Iterator<Item = f64>| x.zip(&self.c).map(|(x, c)| x * c).sum::<f64>();
        let states = (0..self.order()).map(|j| with_c(&mut column(j))).collect();
        (states, with_c(&mut self.b.iter().copied()))
    }
}
