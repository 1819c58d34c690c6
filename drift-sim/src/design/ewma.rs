//! Exact run lengths of the two-sided EWMA (Roberts 1959) by the same integral equation as the CUSUM's (Crowder 1987; tables: Lucas &
//! Saccucci 1990).
//!
//! With `s = mean/lambda` a decision is `s' = (1 - lambda)*s + z`, a walk with unit steps that is drawn to zero, between
//! `+-limit/lambda`.

use super::normal;
use super::quadrature::{self, Node};
use super::root;
use super::walk::{NODES, censor};
use crate::sentences::typed;
use crate::{Error, Result};

/// Widest panel of the quadrature, standard deviations of a step.
const WIDEST_PANEL: f64 = 5.0;
/// Decisions that are followed one by one; beyond, the hazard is constant.
const FOLLOWED: u64 = 400;
/// Largest admissible limit in standard deviations of the average, as in the tables.
pub const LARGEST_L: f64 = 10.0;

/// A two-sided EWMA chart: the average of the standardised residuals, the newest with weight `lambda`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ewma {
    lambda: f64,
    limit: f64,
}

impl Ewma {
    /// `lambda` from 0.01 to 1; alarm where the average's magnitude is above `limit` sigmas.
    ///
    /// # Errors
    /// A number is out of range.
    pub fn new(lambda: f64, limit: f64) -> Result<Self> {
        if !(0.01..=1.0).contains(&lambda) {
            return Err(Error::new(format!("lambda is {}", typed(lambda))).allowed("0.01 to 1"));
        }
        let deviations = limit / spread(lambda);
        if !(deviations > 0.0 && deviations <= LARGEST_L) {
            let most = LARGEST_L * spread(lambda);
            return Err(Error::new(format!("limit is {}", typed(limit)))
                .allowed(format!("above 0, up to {most:.3} for this lambda")));
        }
        Ok(Self { lambda, limit })
    }

    /// The limit as the tables give it, in standard deviations of the average in the long run.
    ///
    /// # Errors
    /// As [`Ewma::new`].
    pub fn with_l(lambda: f64, l: f64) -> Result<Self> {
        Self::new(lambda, l * spread(lambda))
    }

    /// The chart whose mean run length to a false alarm is `arl0` decisions, above 1 to 1e9.
    ///
    /// # Errors
    /// `lambda` or `arl0` is out of range.
    pub fn with_arl0(lambda: f64, arl0: f64) -> Result<Self> {
        if !(arl0 > 1.0 && arl0 <= 1e9) {
            return Err(
                Error::new(format!("arl0 is {}", typed(arl0))).allowed("above 1, up to 1e9 decisions")
            );
        }
        Self::with_l(lambda, 1.0)?;
        let l = root::bracketed_to(
            |l| Self::with_l(lambda, l).map_or(f64::NAN, |e| e.arl(0.0).ln()) - arl0.ln(),
            0.01,
            LARGEST_L,
            1e-10,
        );
        Self::with_l(lambda, l)
    }

    /// Weight of the newest residual.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// Alarm where the average's magnitude is above, sigmas.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// Mean decisions to the alarm when z has this mean and unit deviation.
    pub fn arl(&self, mean: f64) -> f64 {
        let nodes = self.nodes();
        let states: Vec<f64> = std::iter::once(0.0).chain(nodes.iter().map(|n| n.at)).collect();
        let mut exits: Vec<f64> = states.iter().map(|&s| self.leaves(s, mean)).collect();
        let mut costs = vec![1.0; states.len()];
        let mut rows: Vec<Vec<f64>> = states
            .iter()
            .map(|&s| std::iter::once(0.0).chain(self.moves(&nodes, s, mean)).collect())
            .collect();
        censor(&mut rows, &mut exits, &mut costs).first().copied().unwrap_or(f64::NAN)
    }

    /// The probability of an alarm within so many decisions.
    pub fn alarm_within(&self, mean: f64, decisions: u64) -> f64 {
        if decisions == 0 {
            return 0.0;
        }
        let nodes = self.nodes();
        let mut mass: Vec<f64> = self.moves(&nodes, 0.0, mean).collect();
        let rows: Vec<Vec<f64>> = nodes.iter().map(|n| self.moves(&nodes, n.at, mean).collect()).collect();
        let (mut survives, mut hazard) = (mass.iter().sum::<f64>(), 1.0);
        for _ in 1..decisions.min(FOLLOWED) {
            let mut next = vec![0.0; mass.len()];
            for (m, row) in mass.iter().zip(&rows) {
                next.iter_mut().zip(row).for_each(|(to, p)| *to += m * p);
            }
            let left = next.iter().sum::<f64>();
            hazard = 1.0 - left / survives.max(f64::MIN_POSITIVE);
            (mass, survives) = (next, left);
        }
        let beyond = decisions.saturating_sub(FOLLOWED) as f64;
        1.0 - survives * (beyond * (-hazard).ln_1p()).exp()
    }

    fn nodes(&self) -> Vec<Node> {
        let rule = quadrature::gauss_legendre(NODES);
        let edge = self.limit / self.lambda;
        quadrature::panels(&rule, -edge, edge, WIDEST_PANEL)
    }

    fn moves<'a>(&self, nodes: &'a [Node], s: f64, mean: f64) -> impl Iterator<Item = f64> + 'a {
        let from = (1.0 - self.lambda) * s + mean;
        nodes.iter().map(move |node| node.weight * normal::density(node.at - from))
    }

    fn leaves(&self, s: f64, mean: f64) -> f64 {
        let (from, edge) = ((1.0 - self.lambda) * s + mean, self.limit / self.lambda);
        normal::below(-edge - from) + normal::above(edge - from)
    }
}

/// The average's standard deviation in the long run.
fn spread(lambda: f64) -> f64 {
    (lambda / (2.0 - lambda)).sqrt()
}
