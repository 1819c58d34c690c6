//! Run length under a linear drift: the mean at decision n is `(n - 1)*slope` sigmas (Gan 1992).
//!
//! The density of the statistic is carried forward on the nodes with the mean of that decision, and the probabilities of no alarm
//! yet are summed. A step with mean mu differs from one with mean 0 by the factor `exp(mu x - mu^2/2)`, x being how far it
//! moves, which splits into one factor of where it starts and one of where it ends: the matrix stays the same.

use super::walk::{Band, Chain, Walk};

/// The sum stops when what is left can't change its last digit.
const NEGLIGIBLE: f64 = 1e-17;

/// Average run length from `start`; `chain` is the chart at mean 0.
pub(crate) fn average(chain: &Chain, start: f64, slope: f64) -> f64 {
    let moves = chain.moves_into_nodes(f64::INFINITY);
    let walk_at = |n: f64| Walk { mean: chain.walk().mean + (n - 1.0) * slope, ..chain.walk() };
    let mut mass: Vec<f64> = chain.at(walk_at(1.0)).moves(start).collect();
    let mut at_origin = walk_at(1.0).falls(start);
    let (mut average, mut n) = (1.0, 1.0);
    loop {
        let surviving = at_origin + mass.iter().sum::<f64>();
        average += surviving;
        if surviving < NEGLIGIBLE * average || !surviving.is_finite() {
            return average;
        }
        n += 1.0;
        let walk = walk_at(n);
        let falls: f64 = chain.nodes.iter().zip(&mass).map(|(node, m)| m * walk.falls(node.at)).sum();
        let next = stepped(chain, &moves, &mass, (n - 1.0) * slope);
        let from_origin: Vec<f64> = chain.at(walk).moves(0.0).collect();
        mass = next.iter().zip(&from_origin).map(|(m, o)| m + at_origin * o).collect();
        at_origin = at_origin * walk.falls(0.0) + falls;
    }
}

/// What the nodes' mass becomes by one step whose mean is `mu` above the matrix's.
fn stepped(chain: &Chain, moves: &[Band], mass: &[f64], mu: f64) -> Vec<f64> {
    let widest = chain.walk().upper - chain.walk().lower;
    if mu > 10.0 || mu * widest > 300.0 {
        // The factors would leave the range of numbers: the plain way, for the few steps so far out.
        let direct = chain.at(Walk { mean: chain.walk().mean + mu, ..chain.walk() });
        return direct.moves_into_nodes(f64::INFINITY).iter().map(|into| into.dot(mass)).collect();
    }
    let tilted: Vec<f64> =
        chain.nodes.iter().zip(mass).map(|(node, m)| m * libm::exp(-mu * node.at)).collect();
    let ends_with = |at: f64| libm::exp(mu * (at - chain.walk().mean) - 0.5 * mu * mu);
    moves.iter().zip(&chain.nodes).map(|(into, node)| into.dot(&tilted) * ends_with(node.at)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::normal;
    use super::*;

    #[test]
    fn the_factored_step_is_the_plain_one() {
        let walk = Walk { lower: 0.0, upper: 8.0, mean: -0.25, restarts: true };
        let chain = walk.discretise();
        let mass: Vec<f64> = chain.nodes.iter().map(|n| n.weight * normal::density(n.at - 1.0)).collect();
        for mu in [0.001, 0.7, 9.0] {
            let fast = stepped(&chain, &chain.moves_into_nodes(f64::INFINITY), &mass, mu);
            let plain = chain.at(Walk { mean: walk.mean + mu, ..walk }).moves_into_nodes(f64::INFINITY);
            for (fast, into) in fast.iter().zip(&plain) {
                let plain = into.dot(&mass);
                assert!((fast - plain).abs() <= 1e-12 * plain.abs() + 1e-300, "{mu}: {fast} {plain}");
            }
        }
    }
}
