//! Play: what reaches the plant stays until u has crossed the gap, then follows at its edge; `width` is the total play
//! between u and what reaches the plant. It begins in the middle of the gap.

use super::signature::singles;
use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Signature, Starts, any_values, every_plant,
    grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "backlash",
    place: Place::Actuator,
    begins: Begins::Start,
    parameters: &[Parameter::new("width", "{u}", Range::NotNegative, |s, _| s.u).rough()],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(Backlash { half: 0.5 * p[0], position: None }),
    starts: |s| singles(Signature::or_fractions(s.hysteresis, s.u_scale)),
    search: Starts::Grid(|s| {
        grid([0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.18, 0.3, 0.5], |part| vec![part * s.u_range])
    }),
    family: Some(Family::Play),
    excitation: "Reversals of u.",
    ties: &["stiction", "dead_zone"],
    experiment: "Ramp the reference slowly one way, then reverse: stiction jumps also one way, backlash only loses motion at the reversal.",
    says: |p, units| format!("Between u and the plant there is a play of {}.", shown(p[0], &units.u)),
};

#[derive(Clone)]
struct Backlash {
    half: f64,
    position: Option<f64>,
}

impl Effect for Backlash {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Actuator]
    }

    fn actuator(&mut self, _: f64, u: f64) -> f64 {
        let before = *self.position.get_or_insert(u);
        let after = before.max(u - self.half).min(u + self.half);
        self.position = Some(after);
        after
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}
