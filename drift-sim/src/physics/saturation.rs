//! A limit between u and the plant that the controller does not know of: u is clipped to `[lower, upper]`.

use std::cmp::Ordering;

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
        let at_both_ends = s.u_lower.iter().flat_map(|lower| s.u_upper.iter().map(|upper| (*lower, *upper)));
        starts.extend(grid(at_both_ends, |(lower, upper)| vec![lower, upper]));
        starts.retain(|start| start.parameters[0] < start.parameters[1]);
        // The ends of u may be a good part of its samples.
        starts.sort_by(|a, b| a.parameters.partial_cmp(&b.parameters).unwrap_or(Ordering::Equal));
        starts.dedup();
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

#[cfg(test)]
mod tests {
    use super::KIND;
    use crate::physics::Scales;

    /// A valve's u from 0 to 100 %, most of it between 20 and 60: limits on both sides are tried, the lower below the upper, each pair once.
    #[test]
    fn limits_on_both_sides_of_what_u_does_are_tried_once() {
        let levels = Scales {
            u_lowest: 0.0,
            u_highest: 100.0,
            u_most: 100.0,
            u_sizes: vec![100.0, 60.0],
            u_upper: vec![90.0, 60.0, 40.0],
            u_lower: vec![10.0, 20.0, 50.0],
            ..Scales::default()
        };
        let starts = KIND.search.points(&levels).unwrap();
        let count =
            |lower: f64, upper: f64| starts.iter().filter(|start| start.parameters == [lower, upper]).count();
        for (lower, upper) in [(20.0, 60.0), (10.0, 40.0), (0.0, 60.0), (20.0, 100.0), (-60.0, 60.0)] {
            assert_eq!(count(lower, upper), 1, "{lower} {upper}");
        }
        assert_eq!(count(50.0, 40.0), 0);
    }
}
