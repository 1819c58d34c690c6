//! Any linear plant with one input and one output: `dx/dt = a x + b u`, `y = c x + d u`, u held over a sample
//! (the paper's eq. 10-12 are one).

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
    /// The number of states.
    pub fn order(&self) -> usize {
        self.b.len()
    }
}
