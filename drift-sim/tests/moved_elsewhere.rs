//! What shows in a recording may not show in its hold-out, where the reference moves another way: the proof is then made by half of what shows it. The truth is what was put in.

use std::f64::consts::TAU;

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::diagnose;
use drift_sim::diagnose::signals::Signals;
use drift_sim::physics::Term;
use drift_sim::simulate::Start;

use crate::random_load;

const LOOP: &str = "[loop]\nsample_time_s = 0.5\n[units]\nr = \"bar\"\ny = \"bar\"\nu = \"%\"\n[controller]\nkind = \"pi\"\nkp = 1.2\nki = 0.05\nu_min = 0.0\nu_max = 100.0\n[sensor]\n\
    noise = 0.01\n[plant]\nkind = \"transfer-function\"\nnum = [0.87]\nden = [79.0, 20.5, 1.0]\noffset = 2.7\n";

const DELAY_S: f64 = 0.4;

/// What is named where the loop steps in the recording, and follows a slow sine in its hold-out.
fn named(physics: Vec<Term>, seed: u64) -> Vec<&'static str> {
    let stated = Loop::parse(LOOP, "loop.toml").unwrap();
    let truth = Loop { physics, ..stated.clone() };
    let recorded = |moves: &dyn Fn(f64) -> f64, seed: u64| -> Signals {
        let r = (0..8_000).map(|n| 45.0 + moves(f64::from(n))).collect();
        random_load::recorded(&truth, r, (0.2, 0.98), seed, Some(&Start::held(45.0, 50.0)))
    };
    let steps = recorded(&|n| if n % 2_000.0 < 1_000.0 { 0.0 } else { 6.0 }, seed);
    let slow = recorded(&|n| 6.0 * (TAU * n / 8_000.0).sin(), seed + 10);
    let found = diagnose(&[steps], Some(&slow), &stated).unwrap();
    println!("{seed}: {:?} {:?}", found.verdict, found.candidates);
    found
        .physics
        .iter()
        .flat_map(|named| std::iter::once(named.term.kind.name).chain(named.tied.clone()))
        .collect()
}

/// Dead time shows where the reference steps.
#[test]
#[ignore = "slow: two diagnoses"]
fn dead_time_that_only_steps_show_is_named() {
    for seed in 1..=2 {
        let delay = Term::new("delay", &[("delay_s", DELAY_S)]).unwrap();
        let named = named(vec![delay], seed);
        assert!(named.contains(&"delay"), "{seed}: {named:?}");
    }
}

/// Nothing is named where nothing is missing.
#[test]
#[ignore = "slow: two diagnoses"]
fn nothing_is_named_where_nothing_is_missing() {
    for seed in 3..=4 {
        assert!(named(Vec::new(), seed).is_empty(), "{seed}");
    }
}
