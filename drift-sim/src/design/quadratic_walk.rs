//! A walk whose steps are a quadratic in a normal variable: the SPRT for a change of mean and deviation.
//!
//! The step's density has an inverse square root at its extreme, so the integral is taken over the normal variable x itself, and V is a
//! polynomial on panels (collocation at Gauss points): `V(s) = c(s) + integral of V(s + g(x)) phi(x) dx` over the x that keep the
//! walk inside. Where the nearer boundary gets out of reach of one step V has a square-root kink: panels end there, and shrink towards it.

use nalgebra::{DMatrix, DVector};

use super::normal;
use super::quadrature::{self, Node};

/// `square x^2 + linear x + constant`, x standard normal; `square` is not 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    square: f64,
    linear: f64,
    constant: f64,
}

/// Steps between two boundaries, from 0, until the walk leaves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct QuadraticWalk {
    pub step: Step,
    pub lower: f64,
    pub upper: f64,
}

/// Nodes a panel for V, and for the integral over x.
const NODES: usize = 8;
const INTEGRAL_NODES: usize = 16;
/// The widest piece of x in one integral, and where the normal law ends for all purposes.
const WIDEST_PIECE: f64 = 1.5;
const END_OF_NORMAL: f64 = 9.0;
/// Towards a kink each panel is this much smaller than the next, so many times.
const SHRINK: f64 = 0.2;
const SHRINKS: i32 = 7;

impl Step {
    /// The step `(square, linear, constant)` of z when z is N(`mean`, `deviation`^2).
    pub(crate) fn of((square, linear, constant): (f64, f64, f64), mean: f64, deviation: f64) -> Self {
        Self {
            square: square * deviation * deviation,
            linear: (2.0 * square * mean + linear) * deviation,
            constant: (square * mean + linear) * mean + constant,
        }
    }

    fn at(&self, x: f64) -> f64 {
        (self.square * x + self.linear) * x + self.constant
    }

    /// Where it is least or greatest.
    fn vertex(&self) -> f64 {
        -0.5 * self.linear / self.square
    }

    /// How far from the vertex x is where the step equals `level`; 0 beyond the extreme.
    fn reach(&self, level: f64) -> f64 {
        ((level - self.at(self.vertex())) / self.square).max(0.0).sqrt()
    }

    /// P(step > level).
    fn above(&self, level: f64) -> f64 {
        if self.square > 0.0 { self.outside(level) } else { self.inside(level) }
    }

    fn inside(&self, level: f64) -> f64 {
        let reach = self.reach(level);
        let (from, to) = (self.vertex() - reach, self.vertex() + reach);
        if from > 0.0 {
            normal::above(from) - normal::above(to)
        } else {
            normal::below(to) - normal::below(from)
        }
    }

    fn outside(&self, level: f64) -> f64 {
        let reach = self.reach(level);
        normal::below(self.vertex() - reach) + normal::above(self.vertex() + reach)
    }

    fn deviation(&self) -> f64 {
        (2.0 * self.square * self.square + self.linear * self.linear).sqrt()
    }
}

impl QuadraticWalk {
    /// (P(it leaves at the top), expected steps until it leaves), from 0.
    pub(crate) fn outcome(&self) -> (f64, f64) {
        let rule = quadrature::gauss_legendre(NODES);
        let panels: Vec<Panel> =
            self.edges().windows(2).map(|edge| Panel::new(&rule, edge[0], edge[1])).collect();
        let states: Vec<f64> =
            std::iter::once(0.0).chain(panels.iter().flat_map(|p| p.nodes.iter().map(|n| n.at))).collect();
        let count = states.len();
        let inner = quadrature::gauss_legendre(INTEGRAL_NODES);
        let mut matrix = DMatrix::<f64>::identity(count, count);
        for (i, &s) in states.iter().enumerate() {
            for (p, panel) in panels.iter().enumerate() {
                for (j, weight) in self.moves(s, panel, &inner).into_iter().enumerate() {
                    matrix[(i, 1 + p * NODES + j)] -= weight;
                }
            }
        }
        let lu = matrix.lu();
        let solved = |cost: DVector<f64>| lu.solve(&cost).map_or(f64::NAN, |v| v[0]);
        let accepts = DVector::from_iterator(count, states.iter().map(|&s| self.step.above(self.upper - s)));
        (solved(accepts), solved(DVector::from_element(count, 1.0)))
    }

    /// How much a step from `s` gives to each node of a panel.
    fn moves(&self, s: f64, panel: &Panel, inner: &[Node]) -> [f64; NODES] {
        let mut weights = [0.0; NODES];
        let (a, b) = (self.step.reach(panel.from - s), self.step.reach(panel.to - s));
        let (near, far) = (a.min(b), a.max(b));
        let vertex = self.step.vertex();
        for (from, to) in [(vertex + near, vertex + far), (vertex - far, vertex - near)] {
            let (from, to) = (from.max(-END_OF_NORMAL), to.min(END_OF_NORMAL));
            if to > from {
                for x in quadrature::panels(inner, from, to, WIDEST_PIECE) {
                    panel.interpolate(s + self.step.at(x.at), x.weight * normal::density(x.at), &mut weights);
                }
            }
        }
        weights
    }

    /// The panels' edges: no wider than a step's deviation, ending at each kink and shrinking towards the first.
    fn edges(&self) -> Vec<f64> {
        let extreme = self.step.at(self.step.vertex());
        let boundary = if self.step.square > 0.0 { self.lower } else { self.upper };
        let widest = self.step.deviation().max((self.upper - self.lower) / 60.0);
        let mut edges = vec![self.lower, self.upper];
        edges.extend((1..=3).map(|j| boundary - f64::from(j) * extreme));
        let first = boundary - extreme;
        for i in 1..=SHRINKS {
            edges.extend([first - widest * SHRINK.powi(i), first + widest * SHRINK.powi(i)]);
        }
        let smallest = 1e-7 * (self.upper - self.lower);
        edges.retain(|e| (self.lower..=self.upper).contains(e));
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|b, a| *b - *a < smallest);
        let mut fine = vec![self.lower];
        for pair in edges.windows(2) {
            let parts = ((pair[1] - pair[0]) / widest).ceil().max(1.0);
            fine.extend((1..=parts as usize).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / parts));
        }
        fine
    }
}

/// A stretch of the statistic on which V is the polynomial through its values at Gauss points.
struct Panel {
    from: f64,
    to: f64,
    nodes: Vec<Node>,
    /// Barycentric weights.
    barycentric: Vec<f64>,
}

impl Panel {
    fn new(rule: &[Node], from: f64, to: f64) -> Self {
        let others = |j: usize| rule.iter().enumerate().filter(move |(i, _)| *i != j).map(|(_, n)| n.at);
        let barycentric =
            rule.iter().enumerate().map(|(j, node)| 1.0 / others(j).map(|o| node.at - o).product::<f64>());
        Self { from, to, nodes: quadrature::on(rule, from, to).collect(), barycentric: barycentric.collect() }
    }

    /// Adds `share` times the value at `t` of each node's Lagrange polynomial.
    fn interpolate(&self, t: f64, share: f64, weights: &mut [f64; NODES]) {
        let mut terms = [0.0; NODES];
        for ((term, node), b) in terms.iter_mut().zip(&self.nodes).zip(&self.barycentric) {
            let distance = t - node.at;
            // On a node itself the formula is 0/0: a hair beside it the polynomial is the same.
            *term = b / if distance == 0.0 { f64::EPSILON * (self.to - self.from) } else { distance };
        }
        let sum: f64 = terms.iter().sum();
        weights.iter_mut().zip(&terms).for_each(|(w, term)| *w += share * term / sum);
    }
}
