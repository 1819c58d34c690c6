//! The control law alone, without a plant: what it makes of a recorded r and y.

use crate::control_loop::Loop;
use crate::controller::Law;
use crate::physics::Place;

use super::terms::Terms;
use super::{Start, nominal};

/// u of each sample as the law makes it of r and y, from this start, its own terms (other gains, a late output) acting as in the
/// loop. The plant need not be known.
pub fn replay_law(model: &Loop, r: &[f64], y: &[f64], start: &Start) -> Vec<f64> {
    let own = model.physics.iter().filter(|term| term.kind.place == Place::Controller).cloned();
    let model = Loop { physics: own.collect(), ..model.clone() };
    let mut terms = Terms::new(&model, 0, model.sample_time_s);
    let mut law = Law::new(&model.controller, model.sample_time_s);
    law.start(start.integrator, start.y, start.velocity, start.u);
    let changes = terms.changes();
    (0u64..)
        .zip(r.iter().zip(y))
        .map(|(tick, (r, y))| {
            if changes.binary_search(&tick).is_ok() {
                law.set_ratio(terms.numbers(tick, nominal(&model)).law_ratio);
            }
            let u = law.step(*r, *y);
            terms.command(tick, u)
        })
        .collect()
}
