//! Numbers that a recording says nothing of: an upper limit that u never comes to, say. Such a number makes a kind no more flexible, so that it costs
//! nothing: Schwarz's half a logarithm of the samples stands for a likelihood that is curved along every number.

use crate::control_loop::Loop;
use crate::estimate::fit::Fit;
use crate::estimate::hypothesis::Target;
use crate::estimate::innovations::SETTLING;
use crate::estimate::likelihood::{Cache, Data, rows_at};
use crate::estimate::linear_part::effect;
use crate::physics::Hook;
use crate::simulate::actuated;

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

/// Whether the last candidate does anything to u once the filter has settled, and leaves something of it. A limit that only the first samples exceed explains how a recording begins, which
/// nobody knows, and nothing else; one that u is beyond all the time cuts the loop, and explains that y does what it likes: at rest beside waves one was named for a spring (`tests/cases/run 9324`).
/// True of what acts elsewhere.
pub fn acts(fit: &Fit, data: &Data) -> bool {
    let Some(realised) = fit.hypothesis.realise(&fit.point) else { return false };
    let Some(last) = realised.model.physics.last().cloned() else { return true };
    if effect(&realised.model, &last).hooks() != [Hook::Actuator] {
        return true;
    }
    let limits = last.kind.parameters.iter().any(|parameter| parameter.limits);
    let alone = Loop { physics: vec![last], ..realised.model };
    let (mut changes, mut leaves) = (false, !limits);
    for (signals, fitted) in data.recordings.iter().zip(&data.fitted) {
        let u = signals.u.get(..*fitted).unwrap_or(&signals.u);
        let left = actuated(&alone, u);
        changes |= left.iter().zip(u).skip(SETTLING).any(|(left, u)| left != u);
        leaves |= left.iter().zip(left.iter().skip(1)).skip(SETTLING).any(|(now, next)| now != next);
    }
    changes && leaves
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::signals::Signals;
    use crate::likelihood_search::hypothesis;
    use crate::likelihood_search::options::Options;
    use crate::physics::Term;

    /// u goes from -0.5 to 1 and back.
    #[test]
    fn a_limit_that_u_never_comes_to_is_idle() {
        let text = "[loop]\nsample_time_s = 0.1\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"first-order\"\ngain = 2.0\ntime_constant_s = 0.5";
        let model = Loop::parse(text, "a loop").unwrap();
        let u: Vec<f64> = (0..600).map(|n| if n / 50 % 2 == 0 { 1.0 } else { -0.5 }).collect();
        let y: Vec<f64> = u.iter().zip(0..).map(|(u, n)| 2.0 * u + 0.01 * f64::sin(n as f64 * 0.7)).collect();
        let recordings = vec![Signals { sample_time_s: 0.1, r: y.clone(), y, u, ..Signals::default() }];
        let nominal = hypothesis(&model, &recordings, &Options::default());
        let data = Data::new(&nominal, recordings, vec![600]);
        let limited = |lower: f64, upper: f64| {
            let limited =
                nominal.with(Term::new("saturation", &[("lower", lower), ("upper", upper)]).unwrap());
            Fit::at(&limited, &limited.own_point(), &data).unwrap()
        };
        for (lower, upper, idle) in [(-2.0, 0.8, 1), (-0.3, 3.0, 1), (-0.3, 0.8, 0), (-2.0, 3.0, 2)] {
            let fit = limited(lower, upper);
            assert_eq!(numbers(&fit, &data), idle, "{lower} .. {upper}");
            assert_eq!(acts(&fit, &data), idle < 2, "{lower} .. {upper}");
        }
        // u is beyond the upper one all the time.
        assert!(!acts(&limited(-2.0, -0.7), &data));
    }

    /// A kick of u at the beginning, as a step of the set-point makes it: a limit that it exceeds is none.
    #[test]
    fn a_limit_that_only_the_first_samples_exceed_does_nothing() {
        let text = "[loop]\nsample_time_s = 0.1\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"first-order\"\ngain = 2.0\ntime_constant_s = 0.5";
        let model = Loop::parse(text, "a loop").unwrap();
        let u: Vec<f64> = (0..600).map(|n| if n < 3 { -9.0 } else { f64::sin(f64::from(n) * 0.1) }).collect();
        let recordings =
            vec![Signals { sample_time_s: 0.1, r: u.clone(), y: u.clone(), u, ..Signals::default() }];
        let nominal = hypothesis(&model, &recordings, &Options::default());
        let data = Data::new(&nominal, recordings, vec![600]);
        let term = |kind: &str, numbers: &[(&str, f64)]| {
            let with = nominal.with(Term::new(kind, numbers).unwrap());
            acts(&Fit::at(&with, &with.own_point(), &data).unwrap(), &data)
        };
        assert!(!term("saturation", &[("lower", -7.0), ("upper", 7.0)]));
        assert!(term("saturation", &[("lower", -7.0), ("upper", 0.9)]));
        assert!(term("load_step", &[("level", 0.1)]));
    }
}
