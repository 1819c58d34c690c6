//! A load that is there from the start of a recording, beside what is named. Every fit has one free, with a prior that it is small. On a stated plant it is a load that the loop file
//! lacks, or an offset that it has wrong, and is named like any other term: where it pays for its number and gains on what nothing has seen.

use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::likelihood::Data;
use crate::physics::Kind;

use super::decide::{cost_of_numbers, independent_share};
use super::found::Choice;
use super::interval;
use super::one_way::{self, FRICTION};
use super::prove::gained;

/// The kind that it is named as.
pub const KIND: &str = "load_step";
/// What does the same to y where the plant keeps its level.
const ALIKE: &str = "sensor_bias";
/// Steps of the fit without it.
const REFIT_STEPS: usize = 10;

/// What speaks for the load that stays of a fit; `None` where nothing is stated of the plant, where it gains less than `least` or nothing for sure on the unseen
/// samples, where its interval reaches zero, or where dry friction is the same on a way that leads only forth.
pub fn judged(best: &Fit, data: &Data, least: f64) -> Option<Choice> {
    let hypothesis = &best.hypothesis;
    let place = hypothesis.place(Target::ConstantLoad).filter(|_| hypothesis.level.is_none())?;
    if one_way::hides_a_load(best, data) {
        return None;
    }
    let mut point = best.point.clone();
    *point.x.get_mut(place)? = 0.0;
    let mut without = Fit::at(hypothesis, &point, data)?;
    without.descend(data, REFIT_STEPS, &[place]);
    // What the data say: that it is unlikely before they are seen is another matter.
    let share = independent_share(best);
    let risen = without.objective() - best.objective() + prior_row(best);
    let gain = 0.5 * share * risen - cost_of_numbers(1.0, share * best.rows.count as f64);
    if gain < least {
        return None;
    }
    let unseen = gained(best, &without, data).filter(|unseen| unseen.is_sure())?;
    if may_be_none(best, place, data) {
        return None;
    }
    let tied = [ALIKE, FRICTION]
        .into_iter()
        .zip([hypothesis.model.plant.keeps_its_level(), may_be_friction(best, place, data)]);
    let tied = tied.filter_map(|(kind, is_alike)| is_alike.then_some(kind)).collect();
    Some(Choice { tied, gain, unseen: Some(unseen), among: 0 })
}

/// Whether dry friction would be the same: the load takes from the drive of a mass that moves one way only.
fn may_be_friction(best: &Fit, place: usize, data: &Data) -> bool {
    let applies = Kind::named(FRICTION).is_ok_and(|kind| (kind.applies)(&best.hypothesis.model.plant));
    let load = best.point.x.get(place).copied().unwrap_or(0.0);
    applies && one_way::way_of(&best.hypothesis, data).is_some_and(|way| way * load > 0.0)
}

/// Whether the load's interval reaches zero: the other numbers take it up, further off than the fit without it went.
fn may_be_none(best: &Fit, place: usize, data: &Data) -> bool {
    let widths = interval::half_widths(best, data);
    let (free, x) = (best.hypothesis.free.get(place), best.point.x.get(place));
    let load = free.zip(x).map_or(0.0, |(free, x)| free.value(*x));
    widths.get(place).is_none_or(|width| *width >= load.abs())
}

/// What the prior of the load that stays adds to a fit's objective.
pub fn prior_row(fit: &Fit) -> f64 {
    let hypothesis = &fit.hypothesis;
    let row = hypothesis.place(Target::ConstantLoad).and_then(|i| hypothesis.prior_rows(&fit.point).nth(i));
    row.map_or(0.0, |row| row * row)
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::*;
    use crate::control_loop::Loop;
    use crate::estimate::noise::sequence;
    use crate::estimate::signals::Signals;
    use crate::likelihood_search::options::Options;
    use crate::likelihood_search::{self, nominal};

    const SAMPLES: usize = 3_000;
    const LOAD: f64 = 0.3;

    /// A motor, written out: `0.1 speed' = u - 0.5 speed - 0.3`, u held over each sample, and a sensor with white noise.
    fn motor(u: impl Fn(usize) -> f64) -> Signals {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let noise = sequence(SAMPLES, 0.01, 0.0, &mut random);
        let u: Vec<f64> = (0..SAMPLES).map(u).collect();
        let mut speed = (u[0] - LOAD) / 0.5;
        let mut y: Vec<f64> = Vec::new();
        for (u, noise) in u.iter().zip(noise) {
            y.push(speed + noise);
            speed += (1.0 - libm::exp(-0.01 * 0.5 / 0.1)) * ((u - LOAD) / 0.5 - speed);
        }
        Signals { sample_time_s: 0.01, r: u.clone(), y, u, ..Signals::default() }
    }

    /// Whether the load of a motor that is stated with 0.8 of its friction may be none, and what it is.
    fn fitted(recording: Signals) -> (bool, f64) {
        let text = "[loop]\nsample_time_s = 0.01\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"servo\"\noutput = \"speed\"\ninertia = 0.1\nviscous = 0.4\nactuator_gain = 1.0\n";
        let model = Loop::parse(text, "a motor").unwrap();
        let recordings = vec![recording];
        let hypothesis = likelihood_search::hypothesis(&model, &recordings, &Options::default());
        let data = Data::new(&hypothesis, recordings, vec![SAMPLES]);
        let fit = nominal::fit(&hypothesis, &data).unwrap();
        let place = fit.hypothesis.place(Target::ConstantLoad).unwrap();
        let load = fit.hypothesis.realise(&fit.point).unwrap().constant_load;
        (may_be_none(&fit, place, &data), load)
    }

    /// Turning both ways tells the load from the viscous friction.
    #[test]
    fn a_load_that_the_motion_tells_is_one() {
        let (may_be_none, load) = fitted(motor(|n| if n / 400 % 2 == 0 { 1.0 } else { -0.6 }));
        assert!(!may_be_none);
        assert!((load - LOAD).abs() < 0.01, "{load}");
    }

    /// At one speed the viscous friction takes up all of it.
    #[test]
    fn a_load_at_one_speed_may_be_none() {
        let (may_be_none, load) = fitted(motor(|_| 1.0));
        assert!(may_be_none, "{load}");
    }
}
