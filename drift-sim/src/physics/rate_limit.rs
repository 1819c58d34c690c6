//! An actuator that can't move faster than `limit_per_s`: what reaches the plant follows u at most at that rate.

use super::{
    Begins, Effect, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "rate_limit",
    place: Place::Actuator,
    begins: Begins::Start,
    parameters: &[Parameter::new("limit_per_s", "{u}/s", Range::Positive, |s, _| s.u_slew)
        .rough()
        .limiting()],
    applies: every_plant,
    consistent: any_values,
    effect: |p, context| Box::new(RateLimit { most: p[0] * context.substep_s, position: None }),
    search: Starts::Grid(|s| {
        grid([0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.6, 1.0], |part| vec![part * s.u_slew])
    }),
    family: None,
    excitation: "Steps of u of different sizes.",
    ties: &["unmodelled_lag", "saturation"],
    experiment: "Double the step: a rate limit keeps the slope, a lag keeps the time.",
    says: |p, units| format!("The actuator moves at most {}.", shown(p[0], &units.unit("{u}/s"))),
};

#[derive(Clone)]
struct RateLimit {
    most: f64,
    position: Option<f64>,
}

impl Effect for RateLimit {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Filter]
    }

    fn filter(&mut self, w: f64) -> f64 {
        let before = *self.position.get_or_insert(w);
        let after = before + (w - before).clamp(-self.most, self.most);
        self.position = Some(after);
        let travel = after - before;
        // A straight ramp that ends inside the sub-step leaves the mean above the half.
        let moving = if self.most > 0.0 { travel.abs() / self.most } else { 1.0 };
        after - 0.5 * travel * moving
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
