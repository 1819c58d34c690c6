//! A limit between u and the plant that the controller does not know of: u is clipped to `[lower, upper]`.

use super::{Begins, Effect, Hook, Kind, Parameter, Place, Range, Starts, every_plant, grid, shown};

pub(super) static KIND: Kind = Kind {
    name: "saturation",
    place: Place::Actuator,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("lower", "{u}", Range::Any, |s, _| s.u).rough().limiting(),
        Parameter::new("upper", "{u}", Range::Any, |s, _| s.u).rough().limiting(),
    ],
    applies: every_plant,
    consistent,
    effect: |p, _| Box::new(Saturation { lower: p[0], upper: p[1] }),
    search: Starts::Grid(|s| {
        let shares = [0.97, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1];
        let both = s.u_sizes.iter().copied().chain(shares.map(|part| part * s.u_most));
        let mut starts = grid(both, |limit| vec![-limit, limit]);
        starts.extend(grid(s.u_upper.iter().copied(), |limit| vec![s.u_lowest, limit]));
        starts.extend(grid(s.u_lower.iter().copied(), |limit| vec![limit, s.u_highest]));
        starts.retain(|start| start.parameters[0] < start.parameters[1]);
        starts
    }),
    family: None,
    excitation: "u beyond the limit.",
    ties: &["rate_limit", "nonlinear_gain"],
    experiment: "Step the reference by different sizes: beyond a limit the response no longer grows with the step.",
    says: |p, units| {
        format!(
            "What reaches the plant is limited to {} .. {}.",
            shown(p[0], &units.u),
            shown(p[1], &units.u)
        )
    },
};

fn consistent(p: &[f64]) -> Result<(), &'static str> {
    if p[0] < p[1] { Ok(()) } else { Err("lower must be below upper") }
}
#[derive(Clone)]
struct Saturation {
    lower: f64,
    upper: f64,
}

impl Effect for Saturation {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Actuator]
    }

    fn actuator(&mut self, _: f64, u: f64) -> f64 {
        u.max(self.lower).min(self.upper)
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
