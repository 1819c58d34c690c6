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
        let numbers =
            magnitudes.map(|(i, (value, _))| Number::new(format!("a{}", i + 1), value, Role::Shape));
        numbers.chain([Number::new("gain", 1.0, Role::Gain)]).collect()
    }

    pub(super) fn with_numbers(&self, values: &[f64]) -> Self {
        let mut plant = self.clone();
        let magnitudes = self.magnitudes();
        for ((_, entries), value) in magnitudes.iter().zip(values) {
            for (i, j) in entries {
                if let Some(entry) = plant.a.get_mut(*i).and_then(|row| row.get_mut(*j)) {
                    *entry = libm::copysign(*value, *entry);
                }
            }
        }
        if let Some(gain) = values.get(magnitudes.len()) {
            plant.b.iter_mut().for_each(|b| *b *= gain);
            plant.d *= gain;
        }
        plant
    }

    /// The magnitudes in `a` with the entries that have them. Those beside the diagonal that are equal are one number (the two frequency entries of
    /// an oscillator, say): of two states that drive each other y shows their product alone. Each on the diagonal is one of its own: a plant's zero
    /// need not lie above its poles, though it was stated so.
    fn magnitudes(&self) -> Vec<(f64, Vec<(usize, usize)>)> {
        let mut found: Vec<(f64, Vec<(usize, usize)>)> = Vec::new();
        let rows = self.a.iter().enumerate();
        let entries = rows.flat_map(|(i, row)| row.iter().enumerate().map(move |(j, value)| (i, j, value)));
        for (i, j, value) in entries.map(|(i, j, value)| (i, j, value.abs())).filter(|entry| entry.2 > 0.0) {
            let is_one = |(other, entries): &&mut (f64, Vec<(usize, usize)>)| {
                i != j && same(*other, value) && entries.iter().all(|(i, j)| i != j)
            };
            match found.iter_mut().find(is_one) {
                Some((_, entries)) => entries.push((i, j)),
                None => found.push((value, vec![(i, j)])),
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

#[cfg(test)]
mod tests {
    use super::StateSpace;

    #[test]
    fn an_oscillator_has_a_damping_of_each_state_and_one_frequency() {
        let plant = StateSpace {
            a: vec![vec![-0.2, 2.0], vec![-2.0, -0.2]],
            b: vec![1.0, 0.0],
            c: vec![1.0, 0.0],
            d: 0.0,
        };
        let numbers: Vec<f64> = plant.numbers().iter().map(|number| number.value).collect();
        assert_eq!(numbers, [0.2, 2.0, 0.2, 1.0]);
        // The second damping is the zero of y(s)/u(s); the poles need not lie below it.
        let moved = plant.with_numbers(&[0.2, 3.0, 0.5, 2.0]);
        assert_eq!(moved.a, [[-0.2, 3.0], [-3.0, -0.5]]);
        assert_eq!(moved.b, [2.0, 0.0]);
    }
}
