//! A load that stays on a plant whose loop file states an offset: every fit can take it up there, and it is named all the same, with the offset that would do the same. The truth is what was
//! put in.

use std::f64::consts::TAU;

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, diagnose};
use drift_sim::physics::Term;
use drift_sim::sentences::{self, Clock};
use drift_sim::simulate::Start;

use crate::random_load;

const LOOP: &str = "[loop]\nsample_time_s = 0.5\n[units]\nr = \"bar\"\ny = \"bar\"\nu = \"%\"\n[controller]\nkind = \"pi\"\nkp = 1.2\nki = 0.08\nu_min = 0.0\nu_max = 100.0\n[sensor]\n\
    noise = 0.01\n";
/// As it is, and as it is stated.
const VESSEL: &str =
    "[plant]\nkind = \"transfer-function\"\nnum = [0.87]\nden = [79.0, 20.5, 1.0]\noffset = 2.7\n";
const STATED: &str =
    "[plant]\nkind = \"transfer-function\"\nnum = [0.83]\nden = [84.0, 21.3, 1.0]\noffset = 2.7\n";

/// Behind a valve that plays by 3 %, under this load.
fn found_under(load: f64, seed: u64) -> Diagnosis {
    let play = Term::new("backlash", &[("width", 3.0)]).unwrap();
    let load = Term::new("load_step", &[("level", load)]).unwrap();
    let truth =
        Loop { physics: vec![play, load], ..Loop::parse(&format!("{LOOP}{VESSEL}"), "loop.toml").unwrap() };
    let stated = Loop::parse(&format!("{LOOP}{STATED}"), "loop.toml").unwrap();
    let recorded = |seed: u64| -> Signals {
        let moves = |n: f64| 8.0 * (TAU * n / 900.0 + seed as f64).sin() + 4.0 * (TAU * n / 370.0).sin();
        let r = (0..8_000).map(|n| 45.0 + moves(f64::from(n))).collect();
        random_load::recorded(&truth, r, (0.2, 0.99), seed, Some(&Start::held(45.0, 50.0)))
    };
    diagnose(&[recorded(seed)], Some(&recorded(seed + 10)), &stated).unwrap()
}

fn kinds(found: &Diagnosis) -> Vec<&str> {
    found.physics.iter().map(|named| named.term.kind.name).collect()
}

/// The improved loop file keeps the offset as it was and has the load.
#[test]
#[ignore = "slow: two diagnoses"]
fn a_load_is_named_beside_an_offset() {
    for seed in 1..=2 {
        let found = found_under(3.85, seed);
        let mut named = kinds(&found);
        named.sort_unstable();
        assert_eq!(named, ["backlash", "load_step"], "{seed}");
        let load = found.physics.iter().find(|named| named.term.kind.name == "load_step").unwrap();
        let (level, width) = (load.term.parameters[0], load.half_widths[0]);
        assert!((level - 3.85).abs() < width && width < 0.4, "{seed}: {level} ± {width}");
        assert!(found.parameters.iter().all(|number| number.name != "plant.offset"), "{seed}");
        let improved = found.improved.to_toml();
        assert!(improved.contains("offset = 2.7") && improved.contains("load_step"), "{improved}");
        let answer = sentences::diagnosis(&found, &Clock::new(None, 4_000.0), 0.0);
        let said = format!("{} {}", answer.sentence, answer.also);
        assert!(said.contains("or the plant's offset is -1."), "{said}");
    }
}

/// Without a load the offset is as stated.
#[test]
#[ignore = "slow: two diagnoses"]
fn no_load_is_named_where_there_is_none() {
    for seed in 3..=4 {
        assert_eq!(kinds(&found_under(0.0, seed)), ["backlash"], "{seed}");
    }
}
