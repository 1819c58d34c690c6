//! Numbers that a recording says nothing of: an upper limit that u never comes to, say. Such a number makes a kind no more flexible, so that it costs
//! nothing: Schwarz's half a logarithm of the samples stands for a likelihood that is curved along every number.

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::likelihood::{Cache, Data, rows_at};

/// Change of the objective below which nothing depends on a number.
const NOTHING: f64 = 1e-6;

/// How many numbers of the last candidate may move by their scale to one side, and nothing changes.
pub fn numbers(fit: &Fit, data: &Data) -> usize {
    let hypothesis = &fit.hypothesis;
    let Some(last) = hypothesis.candidates().len().checked_sub(1) else { return 0 };
    let cache = Cache::at(hypothesis, &fit.point, data);
    let is_idle = |place: &usize| {
        let Some(free) = hypothesis.free.get(*place).filter(|free| !matches!(free.target, Target::Onset(_)))
        else {
            return false;
        };
        let sides = [1.0, -1.0].map(|side| {
            let mut point = fit.point.clone();
            if let Some(x) = point.x.get_mut(*place) {
                *x += side;
            }
            point
        });
        let inside = |at: f64| (free.low..=free.high).contains(&at);
        let allowed = sides.into_iter().filter(|point| point.x.get(*place).is_some_and(|x| inside(*x)));
        let moved = rows_at(hypothesis, &allowed.collect::<Vec<_>>(), data, &cache);
        moved.iter().flatten().any(|rows| (rows.objective - fit.objective()).abs() < NOTHING)
    };
    hypothesis.places_of(last).iter().filter(|place| is_idle(place)).count()
}
