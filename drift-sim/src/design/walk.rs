//! A random walk with standard normal steps (plus a mean) between two boundaries: what every CUSUM and every SPRT on
//! normal data is. Its expectations are solved from the integral equation
//!
//! `V(s) = c(s) + V(0) P(s + X <= lower) + integral from lower to upper of V(t) f(t - s) dt`
//!
//! by Nystroem's method on Gauss-Legendre panels (Goel & Wu 1971; Vance 1986). The second term is there if the walk
//! restarts when it falls out at the bottom; otherwise it ends there.
//!
//! The linear system is solved by censoring one state after the other (Grassmann, Taksar & Heyman 1985): it only adds,
//! multiplies and divides positive numbers, the diagonal being the sum of all ways out. So a run length of 1e12 has as many correct
//! digits as one of 10, where LU would lose twelve of them.

use super::normal;
use super::quadrature::{self, Node};

/// Steps are N(mean, 1) between `lower` and `upper`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Walk {
    pub lower: f64,
    pub upper: f64,
    pub mean: f64,
    /// After a fall to `lower` or below it goes on from 0; otherwise it ends there.
    pub restarts: bool,
}

/// Nodes a panel, and the widest panel in standard deviations of a step: doubling the nodes
/// changes nothing in the twelfth digit, as a test shows.
pub(crate) const NODES: usize = 32;
const WIDEST_PANEL: f64 = 5.0;

/// The walk on quadrature nodes. State 0 is the origin, where it starts and restarts; states 1.. are
/// the nodes.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    walk: Walk,
    pub nodes: Vec<Node>,
}

/// The part of a row of weights that isn't nothing.
#[derive(Debug, Clone)]
pub(crate) struct Band {
    first: usize,
    weights: Vec<f64>,
}

impl Band {
    pub(crate) fn dot(&self, mass: &[f64]) -> f64 {
        self.weights.iter().zip(mass.iter().skip(self.first)).map(|(w, m)| w * m).sum()
    }

    /// What moves out of each node, from what moves into each. With these the sums of all nodes grow side by side, each in the
    /// same order as one by one, which is several times as fast.
    pub(crate) fn out_of_nodes(into: &[Self]) -> Vec<Self> {
        let mut out = vec![Self { first: 0, weights: Vec::new() }; into.len()];
        for (to, band) in into.iter().enumerate() {
            for (out, weight) in out.iter_mut().skip(band.first).zip(&band.weights) {
                if out.weights.is_empty() {
                    out.first = to;
                }
                out.weights.resize(to - out.first, 0.0);
                out.weights.push(*weight);
            }
        }
        out
    }

    /// Adds what moves of this mass.
    pub(crate) fn spread(&self, mass: f64, sums: &mut [f64]) {
        for (sum, weight) in sums.iter_mut().skip(self.first).zip(&self.weights) {
            *sum += weight * mass;
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.weights.len()
    }
}

/// A solved expectation, which can be evaluated at any start.
pub(crate) struct Expectation<'a> {
    chain: &'a Chain,
    at_origin: f64,
    at_nodes: Vec<f64>,
}

impl Walk {
    pub(crate) fn discretise(self) -> Chain {
        self.discretise_with(NODES)
    }

    pub(crate) fn discretise_with(self, nodes_a_panel: usize) -> Chain {
        let rule = quadrature::gauss_legendre(nodes_a_panel);
        Chain { walk: self, nodes: quadrature::panels(&rule, self.lower, self.upper, WIDEST_PANEL) }
    }

    /// P(a step from `s` leaves at the top).
    pub(crate) fn leaves_up(&self, s: f64) -> f64 {
        normal::above(self.upper - s - self.mean)
    }

    /// P(a step from `s` falls to the bottom).
    pub(crate) fn falls(&self, s: f64) -> f64 {
        normal::below(self.lower - s - self.mean)
    }
}

impl Chain {
    /// Expected number of steps until the walk ends.
    pub(crate) fn steps(&self) -> Expectation<'_> {
        self.expected(|_| 1.0)
    }

    /// Probability that the walk ends at the top.
    pub(crate) fn ends_up(&self) -> Expectation<'_> {
        let walk = self.walk;
        self.expected(move |s| walk.leaves_up(s))
    }

    fn expected(&self, cost: impl Fn(f64) -> f64) -> Expectation<'_> {
        let states: Vec<f64> = std::iter::once(0.0).chain(self.nodes.iter().map(|n| n.at)).collect();
        let mut costs: Vec<f64> = states.iter().map(|&s| cost(s)).collect();
        let (mut exits, mut rows) = (Vec::new(), Vec::new());
        for &s in &states {
            let (up, down) = (self.walk.leaves_up(s), self.walk.falls(s));
            let (exit, restart) = if self.walk.restarts { (up, down) } else { (up + down, 0.0) };
            exits.push(exit);
            rows.push(std::iter::once(restart).chain(self.moves(s)).collect::<Vec<f64>>());
        }
        let values = censor(&mut rows, &mut exits, &mut costs);
        let mut values = values.into_iter();
        let at_origin = values.next().unwrap_or(f64::NAN);
        Expectation { chain: self, at_origin, at_nodes: values.collect() }
    }

    pub(crate) fn walk(&self) -> Walk {
        self.walk
    }

    /// The same nodes under another law of the steps.
    pub(crate) fn at(&self, walk: Walk) -> Self {
        Self { walk, nodes: self.nodes.clone() }
    }

    /// For each node, what moves into it from the nodes that are at most `reach` from where such a step comes from.
    pub(crate) fn moves_into_nodes(&self, reach: f64) -> Vec<Band> {
        let into = |to: &Node| {
            let from = to.at - self.walk.mean;
            let first = self.nodes.partition_point(|n| n.at < from - reach);
            let near = self.nodes.iter().skip(first).take_while(|n| n.at <= from + reach);
            Band { first, weights: near.map(|n| to.weight * normal::density(from - n.at)).collect() }
        };
        self.nodes.iter().map(into).collect()
    }

    /// Probability weight of a step from `s` to each node.
    pub(crate) fn moves(&self, s: f64) -> impl Iterator<Item = f64> + '_ {
        let from = s + self.walk.mean;
        self.nodes.iter().map(move |node| node.weight * normal::density(node.at - from))
    }
}

impl Expectation<'_> {
    /// The expectation from state `s`, whose own cost is `cost`: the integral equation, read off.
    pub(crate) fn from(&self, s: f64, cost: f64) -> f64 {
        let restart = if self.chain.walk.restarts { self.chain.walk.falls(s) * self.at_origin } else { 0.0 };
        let inside: f64 = self.chain.moves(s).zip(&self.at_nodes).map(|(p, v)| p * v).sum();
        cost + restart + inside
    }

    /// The expectation from the origin.
    pub(crate) fn at_origin(&self) -> f64 {
        self.at_origin
    }
}

/// Expected total cost from each state of an absorbing chain: `rows` are the moves, `exits` the probabilities to end. The diagonal of `rows`
/// is not read: staying is what is neither a move nor the end.
pub(super) fn censor(rows: &mut [Vec<f64>], exits: &mut [f64], costs: &mut [f64]) -> Vec<f64> {
    let count = rows.len();
    let mut ways_out = vec![1.0; count];
    for last in (0..count).rev() {
        let (before, from_last) = rows.split_at_mut(last);
        let row = &from_last[0][..last];
        let out = exits[last] + row.iter().sum::<f64>();
        ways_out[last] = out;
        for (i, other) in before.iter_mut().enumerate() {
            // From state i, each visit to the last state is a detour that ends in one of its ways out.
            let visits = other[last] / out;
            if visits > 0.0 {
                other[..last].iter_mut().zip(row).for_each(|(p, onward)| *p += visits * onward);
                exits[i] += visits * exits[last];
                costs[i] += visits * costs[last];
            }
        }
    }
    let mut values = vec![0.0; count];
    for i in 0..count {
        let onward: f64 = rows[i][..i].iter().zip(&values[..i]).map(|(p, v)| p * v).sum();
        values[i] = (costs[i] + onward) / ways_out[i];
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cusum(h: f64, mean: f64) -> Walk {
        Walk { lower: 0.0, upper: h, mean, restarts: true }
    }

    #[test]
    fn doubling_the_nodes_changes_nothing_in_the_twelfth_digit() {
        for h in [0.01, 0.5, 3.0, 5.0, 5.001, 8.0, 27.0, 60.0] {
            for mean in [-1.5, -0.5, -0.05, 0.0, 0.5, 4.0] {
                let coarse = cusum(h, mean).discretise().steps().at_origin();
                let fine = cusum(h, mean).discretise_with(2 * NODES).steps().at_origin();
                assert!(
                    coarse.is_finite() && (coarse / fine - 1.0).abs() < 1e-12,
                    "{h} {mean}: {coarse} {fine}"
                );
            }
        }
    }
}
