//! Play: what reaches the plant stays until u has crossed the gap, then follows at its edge; `width` is the total play
//! between u and what reaches the plant. A recording that begins in the middle of a loop's life does not show where in the gap that was: `place_at_start`,
//! from -1 (u has last come up) to 1 (u has last come down), 0 in the middle.

use super::{
    Begins, Effect, Family, Hook, Kind, Parameter, Place, Range, Scales, Start, Starts, Term, any_values,
    every_plant, grid, shown, stiction,
};

pub(super) static KIND: Kind = Kind {
    name: "backlash",
    place: Place::Actuator,
    begins: Begins::Start,
    parameters: &[
        Parameter::new("width", "{u}", Range::NotNegative, |s, _| s.u).rough(),
        Parameter::new("place_at_start", "1", Range::Between(-1.0, 1.0), |_, _| 1.0)
            .rough()
            .or(0.0)
            .state_up_to(|_| 1.0),
    ],
    applies: every_plant,
    consistent: any_values,
    effect: |p, _| Box::new(Backlash { half: 0.5 * p[0], at_start: 0.5 * p[0] * p[1], position: None }),
    search: Starts::GridLike { points, like },
    family: Some(Family::Play),
    excitation: "Reversals of u.",
    ties: &["stiction", "dead_zone"],
    experiment: "Ramp the reference slowly one way, then reverse: stiction jumps also one way, backlash only loses motion at the reversal.",
    says: |p, units| format!("Between u and the plant there is a play of {}.", shown(p[0], &units.u)),
};

fn points(s: &Scales) -> Vec<Start> {
    grid([0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.18, 0.3, 0.5], |part| vec![part * s.u_range, 0.0])
}

/// The play of which the plant's side is as far behind u on the mean as the stem of a valve that sticks.
fn like(term: &Term) -> Option<Vec<f64>> {
    let [band, jump, stem, _] = term.parameters.as_slice() else { return None };
    let half = stiction::lag(*band, *jump);
    (term.kind.name == "stiction" && half > 0.0).then(|| vec![2.0 * half, (stem / half).clamp(-1.0, 1.0)])
}

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

    /// The plant's side of a play is behind u, once u goes one way, by half of it; a stem by its band just before a jump, and by that less the jump after it.
    #[test]
    fn a_valve_s_play_is_as_far_behind_on_the_mean() {
        let valve = Term::new("stiction", &[("stick_band", 2.0), ("slip_jump", 0.4), ("stem_at_start", 0.9)])
            .unwrap();
        assert_eq!(like(&valve), Some(vec![0.5 * (2.0 + 1.6) * 2.0, 0.5]));
        assert_eq!(like(&Term::new("backlash", &[("width", 2.0)]).unwrap()), None);
        let slips_all_the_way = Term::new("stiction", &[("stick_band", 0.0), ("slip_jump", 0.0)]).unwrap();
        assert_eq!(like(&slips_all_the_way), None);
    }

    /// A gap of 4 in which the plant's side lies 1 above u: u moves by 3 before it takes it along.
    #[test]
    fn what_lay_elsewhere_in_the_gap_stays_until_u_has_crossed_the_rest_of_it() {
        let mut play = Backlash { half: 2.0, at_start: 1.0, position: None };
        let reached: Vec<f64> = (0..6).map(|u| play.actuator(0.0, f64::from(u))).collect();
        assert_eq!(reached, [1.0, 1.0, 1.0, 1.0, 2.0, 3.0]);
    }
}
