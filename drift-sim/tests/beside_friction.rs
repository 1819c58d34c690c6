//! The diagnosis of a motor whose dry friction hides what is beside it, or is hidden by it. The truth is what was put in.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, diagnose, diagnose_since};
use drift_sim::likelihood_search::options::Options;
use drift_sim::physics::Term;
use drift_sim::plant::Plant;

use crate::random_load;

const MOTOR: &str = "[loop]\nsample_time_s = 0.002\n[units]\nr = \"rad/s\"\ny = \"rad/s\"\nu = \"V\"\nforce = \"N m\"\n\
    [controller]\nkind = \"pi\"\nkp = 0.5\nki = 3.0\nu_min = -200.0\nu_max = 200.0\n\
    [plant]\nkind = \"servo\"\noutput = \"speed\"\ninertia = 0.003\nviscous = 0.024\nactuator_gain = 0.14\n[sensor]\nnoise = 0.02\n";
const SAMPLES: usize = 15_000;
const FRICTION: f64 = 0.3;

/// The motor with these terms, which turns both ways where it is to.
fn recorded(physics: &[Term], load: f64, both_ways: bool, seed: u64) -> Signals {
    let model = Loop { physics: physics.to_vec(), ..Loop::parse(MOTOR, "loop.toml").unwrap() };
    let offset = if both_ways { 0.0 } else { 14.0 };
    let r = (0..SAMPLES).map(|n| {
        let t = n as f64 * model.sample_time_s + seed as f64;
        offset + 6.0 * libm::sin(0.9 * t) + 4.0 * libm::sin(2.3 * t)
    });
    random_load::recorded(&model, r.collect(), (load, 0.99), seed, None)
}

fn kinds(found: &Diagnosis) -> Vec<&'static str> {
    found.physics.iter().map(|named| named.term.kind.name).collect()
}

fn friction() -> Term {
    Term::new("coulomb_friction", &[("level", FRICTION)]).unwrap()
}

/// Dry friction and a load that have come since the motor was healthy do exactly what friction does that differs by the direction: the two simple ones are named, and the other one as what
/// can't be told from them.
#[test]
#[ignore = "slow: a diagnosis"]
fn friction_and_a_load_that_have_come_are_no_friction_by_direction() {
    let load = Term::new("load_step", &[("level", 0.2)]).unwrap();
    let unknown = Loop { plant: Plant::Identify, ..Loop::parse(MOTOR, "loop.toml").unwrap() };
    let recorded = |physics: &[Term], seed| recorded(physics, 0.004, true, seed);
    let (then, now) = (recorded(&[], 1), recorded(&[friction(), load.clone()], 2));
    let holdout = recorded(&[friction(), load], 3);
    let found = diagnose_since(&[then], &[now], Some(&holdout), &unknown, &Options::default()).unwrap();
    let mut named = kinds(&found);
    named.sort_unstable();
    assert_eq!(named, ["coulomb_friction", "load_step"]);
    let tied = found.physics.iter().find(|named| named.term.kind.name == "coulomb_friction").unwrap();
    assert!(tied.tied.contains(&"directional_friction"), "{tied:?}");
    for named in &found.physics {
        let truth = if named.term.kind.name == "load_step" { 0.2 } else { FRICTION };
        // In volts: the motor's torque is 0.14 times that.
        assert!((0.14 * named.term.parameters[0] / truth - 1.0).abs() < 0.05, "{named:?}");
    }
}

/// A motor of which nothing is known cogs behind friction that holds it: either alone leaves too much to stand, and both are named.
#[test]
#[ignore = "slow: two diagnoses"]
fn cogging_is_named_beside_friction_that_hides_it() {
    let cogging = Term::new("cogging", &[("amplitude", 0.2), ("period", 7.0), ("phase", 1.0)]).unwrap();
    let text = "[loop]\nsample_time_s = 0.002\n[units]\nr = \"rad/s\"\ny = \"rad/s\"\nu = \"V\"\nforce = \"N m\"\n\
        [controller]\nkind = \"recorded\"\n[plant]\nkind = \"identify\"\n";
    let unknown = Loop::parse(text, "loop.toml").unwrap();
    for seed in [11, 21] {
        let recorded = |seed| recorded(&[cogging.clone(), friction()], 1e-9, true, seed);
        let found = diagnose(&[recorded(seed)], Some(&recorded(seed + 1)), &unknown).unwrap();
        let mut named = kinds(&found);
        named.sort_unstable();
        assert_eq!(named, ["cogging", "coulomb_friction"], "{seed}");
        let period = found.physics.iter().find_map(|named| named.term.value("period")).unwrap();
        assert!((period - 7.0).abs() < 0.01, "{seed}: {period}");
    }
}

/// A motor that turns one way alone: what takes from its drive beside the cogging may be a load, or friction, and both are said.
#[test]
#[ignore = "slow: a diagnosis"]
fn what_takes_from_a_motor_that_turns_one_way_may_be_friction() {
    let cogging = Term::new("cogging", &[("amplitude", 0.12), ("period", 7.6), ("phase", 2.2)]).unwrap();
    let model = Loop::parse(MOTOR, "loop.toml").unwrap();
    let recorded = |seed| recorded(&[cogging.clone(), friction()], 1e-9, false, seed);
    let found = diagnose(&[recorded(31)], Some(&recorded(32)), &model).unwrap();
    assert!(kinds(&found).contains(&"cogging"), "{:?}", kinds(&found));
    let takes = found.physics.iter().find(|named| named.term.kind.name != "cogging").unwrap();
    let may_be = [&[takes.term.kind.name][..], &takes.tied].concat();
    assert!(may_be.contains(&"load_step") && may_be.contains(&"coulomb_friction"), "{may_be:?}");
    assert!((takes.term.parameters[0] - FRICTION).abs() < 0.01, "{takes:?}");
}
