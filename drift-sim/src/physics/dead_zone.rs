//! A dead zone: nothing reaches the plant while `|u| <= half_width`; outside, u less the half width.

use super::{
    Begins, Effect, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "dead_zone",
    place: Place::Actuator,
    begins: Begins::Start,
    parameters: &[Parameter::new("half_width", "{u}", Range::NotNegative, |s, _| s.u).rough()],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(DeadZone { half_width: p[0] }),
    search: Starts::Grid(|s| {
        grid([0.01, 0.02, 0.04, 0.07, 0.12, 0.2, 0.3, 0.4, 0.48], |part| vec![part * s.u_range])
    }),
    family: None,
    excitation: "u that passes through zero.",
    ties: &["backlash", "coulomb_friction"],
    experiment: "Sweep u slowly through zero, up and down: a dead zone has one curve, backlash has two.",
    says: |p, units| {
        format!("Nothing reaches the plant while u is within {} of zero.", shown(p[0], &units.u))
    },
};

#[derive(Clone)]
struct DeadZone {
    half_width: f64,
}

impl Effect for DeadZone {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Actuator]
    }

    fn actuator(&mut self, _: f64, u: f64) -> f64 {
        u - u.clamp(-self.half_width, self.half_width)
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
