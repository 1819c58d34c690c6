//! Motion that goes one way only: dry friction and a load that stays are one force there, and no number of samples tells how much of it is which.

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Hypothesis;
use crate::estimate::likelihood::Data;
use crate::estimate::measure::{positions, shows_speed};
use crate::estimate::signals::{Signals, held};
use crate::physics::Family;

/// Part of the way forth that the way back is at most: what swings back a little when it stops holds too few samples to tell the two forces apart. A mass that stops at a step
/// of its reference swings back by 0.0014 of its way, and a motor whose load and friction are told turns back by 0.014.
const BACK: f64 = 0.005;
/// Deviations of the sensor's noise that y turns by at least, for it to be the mass that turned.
const TURNS: f64 = 6.0;

/// The friction that is a load there.
pub const FRICTION: &str = "coulomb_friction";

/// Whether a fit has dry friction in it and the recordings move one way only.
pub fn hides_a_load(fit: &Fit, data: &Data) -> bool {
    let has_friction =
        fit.hypothesis.model.physics.iter().any(|term| term.kind.family == Some(Family::Friction));
    has_friction && way_of(&fit.hypothesis, data).is_some()
}

/// The sign of the way that the recordings of a loop lead; `None` where they lead both.
pub fn way_of(hypothesis: &Hypothesis, data: &Data) -> Option<f64> {
    one_way(&data.recordings, shows_speed(&hypothesis.model.plant), hypothesis.scales.noise)
}

/// The sign of the way of these recordings, if hardly any of it leads back.
fn one_way(recordings: &[Signals], is_speed: bool, noise: f64) -> Option<f64> {
    let (mut forth, mut back) = (0.0, 0.0);
    for signals in recordings {
        let y = held(&signals.y);
        let ts = signals.sample_time_s;
        // The integral of noise wanders by its deviation times the square root of the samples.
        let wanders = if is_speed { ts * libm::sqrt(y.len() as f64) } else { 1.0 };
        let turns = TURNS * noise * wanders;
        let way = positions(y, is_speed, ts);
        let Some(mut at) = way.first().copied() else { continue };
        for x in way {
            let next = at.clamp(x - turns, x + turns);
            if next > at {
                forth += next - at
            } else {
                back += at - next
            }
            at = next;
        }
    }
    (f64::min(forth, back) <= BACK * f64::max(forth, back)).then_some((forth - back).signum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals(y: impl Fn(f64) -> f64) -> Signals {
        // Noise that needs no generator: a fast wave of deviation 0.01.
        let noisy = |n: usize| y(0.01 * n as f64) + 0.014 * libm::sin(2.1 * n as f64);
        let y: Vec<f64> = (0..2000).map(noisy).collect();
        Signals { sample_time_s: 0.01, u: y.clone(), r: y.clone(), y, ..Signals::default() }
    }

    /// From 0 to 1 with a lag, whose noise at rest turns thousands of times.
    #[test]
    fn a_step_without_overshoot_goes_one_way() {
        let step = signals(|t| 1.0 - libm::exp(-t));
        assert_eq!(one_way(std::slice::from_ref(&step), false, 0.01), Some(1.0));
        assert_eq!(one_way(&[step.clone(), step], false, 0.01), Some(1.0));
    }

    #[test]
    fn a_step_that_overshoots_by_a_third_and_one_back_do_not() {
        let swings = signals(|t| 1.0 + 0.33 * libm::exp(-(t - 2.0) * (t - 2.0)) - libm::exp(-3.0 * t));
        assert_eq!(one_way(&[swings], false, 0.01), None);
        let (there, back) = (signals(|t| 1.0 - libm::exp(-t)), signals(|t| libm::exp(-t)));
        assert_eq!(one_way(&[there, back], false, 0.01), None);
    }

    /// A motor that turns one way at varying speed, and one that turns back.
    #[test]
    fn a_speed_that_keeps_its_sign_goes_one_way() {
        assert_eq!(one_way(&[signals(|t| 2.0 + libm::sin(t))], true, 0.01), Some(1.0));
        assert_eq!(one_way(&[signals(|t| -2.0 + libm::sin(t))], true, 0.01), Some(-1.0));
        assert_eq!(one_way(&[signals(libm::sin)], true, 0.01), None);
    }
}
