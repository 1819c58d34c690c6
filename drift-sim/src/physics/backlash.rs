//! Play: what reaches the plant stays until u has crossed the gap, then follows at its edge; `width` is the total play
//! between u and what reaches the plant. A recording that begins in the middle of a loop's life does not show where in the gap that was: `place_at_start`,
//! from -1 (u has last come up) to 1 (u has last come down), 0 in the middle.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Starts, any_values, every_plant, grid, shown,
};

pub(super) static KIND: Kind = Kind {
    name: "backlash",
    place: Place::Actuator,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("width", "{u}", Range::NotNegative, |s, _| s.u).rough(),
        Parameter::new("place_at_start", "1", Range::Between(-1.0, 1.0), |_, _| 1.0).rough().or(0.0),
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(Backlash { half: 0.5 * p[0], at_start: 0.5 * p[0] * p[1], position: None }),
    search: Starts::Grid(|s| {
        grid([0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.18, 0.3, 0.5], |part| vec![part * s.u_range, 0.0])
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
    at_start: f64,
    position: Option<f64>,
}

impl Effect for Backlash {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Actuator]
    }

    fn actuator(&mut self, _: f64, u: f64) -> f64 {
        let before = *self.position.get_or_insert(u + self.at_start);
        let after = before.max(u - self.half).min(u + self.half);
        self.position = Some(after);
        after
    }

    fn copy(&self) -> Box<dyn Effect> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gap of 4 in which the plant's side lies 1 above u: u moves by 3 before it takes it along.
    #[test]
    fn what_lay_elsewhere_in_the_gap_stays_until_u_has_crossed_the_rest_of_it() {
        let mut play = Backlash { half: 2.0, at_start: 1.0, position: None };
        let reached: Vec<f64> = (0..6).map(|u| play.actuator(0.0, f64::from(u))).collect();
        assert_eq!(reached, [1.0, 1.0, 1.0, 1.0, 2.0, 3.0]);
    }
}
