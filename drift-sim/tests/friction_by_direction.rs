//! Friction that differs by the direction, and what looks like it: an arm that moves once, and one that swings. The truth is what was put in.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, diagnose};
use drift_sim::physics::Term;

use crate::random_load;

const ARM: &str = "[loop]\nsample_time_s = 0.002\n[units]\nr = \"rad\"\ny = \"rad\"\nu = \"V\"\nforce = \"N m\"\n\
    [controller]\nkind = \"pid\"\nkp = 40.0\nki = 84.0\nkd = 4.5\nderivative_filter_s = 0.004\nu_min = -1000.0\nu_max = 1000.0\n";
const PLANT: &str = "[plant]\nkind = \"servo\"\noutput = \"position\"\ninertia = 0.19\nviscous = 0.52\nactuator_gain = 0.94\n[sensor]\nnoise = 2e-5\n";
/// The same as a person would state it who has not measured it.
const ROUGHLY: &str = "[plant]\nkind = \"servo\"\noutput = \"position\"\ninertia = 0.16\nviscous = 0.35\nactuator_gain = 0.94\n";
const UNKNOWN: &str = "[plant]\nkind = \"identify\"\n";
const SAMPLES: usize = 14_000;
/// Deviation of the random load, in N m, and the part of it that stays from one sample to the next.
const LOAD: f64 = 0.003;
const STAYS: f64 = 0.9993;

/// The arm with these terms, over a reference.
fn recorded(physics: &[Term], r: &dyn Fn(f64) -> f64, seed: u64) -> Signals {
    let mut model = Loop::parse(&format!("{ARM}{PLANT}"), "loop.toml").unwrap();
    model.physics = physics.to_vec();
    let r: Vec<f64> = (0..SAMPLES).map(|n| r(n as f64 * model.sample_time_s)).collect();
    random_load::recorded(&model, r, (LOAD, STAYS), seed, None)
}

fn diagnosed(physics: &[Term], r: &dyn Fn(f64) -> f64, plant: &str) -> Diagnosis {
    let model = Loop::parse(&format!("{ARM}{plant}"), "loop.toml").unwrap();
    diagnose(&[recorded(physics, r, 5)], Some(&recorded(physics, r, 6)), &model).unwrap()
}

fn kinds(found: &Diagnosis) -> Vec<&'static str> {
    found.physics.iter().map(|named| named.term.kind.name).collect()
}

/// A move of 1 rad within half a second, 8 s after the start.
fn moves_once(t: f64) -> f64 {
    let part = ((t - 8.0) / 0.5).clamp(0.0, 1.0);
    part * part * part * (10.0 - 15.0 * part + 6.0 * part * part) - 0.5
}

/// Dry friction and a load that comes while the arm rests, behind what moves once: they are named, with their sizes, and not friction that differs by the direction, which takes up
/// most of both.
#[test]
#[ignore = "slow: a diagnosis"]
fn dry_friction_and_a_load_that_comes_are_no_friction_by_direction() {
    let mut load = Term::new("load_step", &[("level", -0.44)]).unwrap();
    load.onset_s = 16.348;
    let friction = Term::new("coulomb_friction", &[("level", 0.18)]).unwrap();
    let found = diagnosed(&[friction, load], &moves_once, ROUGHLY);
    assert_eq!(kinds(&found), ["load_step", "coulomb_friction"]);
    let [load, friction] = [0, 1].map(|place: usize| &found.physics[place].term);
    assert!((friction.parameters[0] - 0.18).abs() < 0.02, "{friction:?}");
    assert!((load.parameters[0] + 0.44).abs() < 0.02 && (load.onset_s - 16.348).abs() < 0.05, "{load:?}");
}

/// Friction that differs by the direction, in an unknown arm that swings. The arm's own friction and a load that stays take up what each of its numbers does: none is told by
/// itself, and what they do together is.
#[test]
#[ignore = "slow: a diagnosis"]
fn friction_by_direction_is_named_where_none_of_its_numbers_is_told() {
    let numbers = [("coulomb_pos", 0.22), ("coulomb_neg", 0.13), ("viscous_pos", 0.2), ("viscous_neg", 0.06)];
    let friction = Term::new("directional_friction", &numbers).unwrap();
    let swings = |t: f64| 0.4 * libm::sin(2.1 * t) + 0.2 * libm::sin(3.7 * t);
    let found = diagnosed(&[friction], &swings, UNKNOWN);
    assert_eq!(kinds(&found), ["directional_friction"]);
    let named = &found.physics[0];
    let [forward, back] = [0, 1].map(|place: usize| named.term.parameters[place]);
    // In volts: the arm's torque is 0.94 times that. What they have in common is told.
    assert!((0.5 * (forward + back) - 0.175 / 0.94).abs() < 0.02, "{named:?}");
    assert!(!named.may_be_nothing(), "{named:?}");
    let says = drift_sim::sentences::says(named, &found);
    assert!(says.starts_with("Viscous friction differs by direction: 0.7"), "{says}");
}
