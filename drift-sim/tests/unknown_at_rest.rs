//! The diagnosis of loops at rest of which nothing is known: disturbances alone move them, and what is identified there may be the law turned round. What begins is told all the same. The truth
//! is what was put in.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, diagnose};
use drift_sim::physics::Term;

use crate::random_load;

/// Two lags of 11 and 4.8 s in percent and kelvin under a PI.
const TWO_LAGS: &str = "[loop]\nsample_time_s = 0.2\n[controller]\nkind = \"pi\"\nkp = 2.05\nki = 0.129\n\
    [plant]\nkind = \"transfer-function\"\nnum = [0.75]\nden = [53.2, 15.93, 1.0]\noffset = 3.7\n[sensor]\nnoise = 0.0075\n";
/// An oscillator of 0.42 Hz under a PID.
const OSCILLATOR: &str = "[loop]\nsample_time_s = 0.002\n[controller]\nkind = \"pid\"\nkp = 58.7\nki = 175.0\nkd = 6.29\nderivative_filter_s = 0.008\n\
    [plant]\nkind = \"state-space\"\na = [[-0.195, 2.65], [-2.65, -0.195]]\nb = [[0.0], [1.43]]\nc = [[1.0, 0.0]]\nd = [[0.0]]\n[sensor]\nnoise = 5e-5\n";
/// A resonance of 0.4 Hz with a zero under a fast PI.
const RESONANCE: &str = "[loop]\nsample_time_s = 0.001\n[controller]\nkind = \"pi\"\nkp = 159.0\nki = 105.0\n\
    [plant]\nkind = \"state-space\"\na = [[-0.18, 2.48], [-2.48, -0.18]]\nb = [[1.0], [0.0]]\nc = [[1.0, 0.0]]\nd = [[0.0]]\n[sensor]\nnoise = 0.001\n";

/// What such a loop does under this reference, with these terms, under a load that drifts.
fn recorded(text: &str, r: Vec<f64>, physics: &[Term], load: (f64, f64), seed: u64) -> Signals {
    let model = Loop { physics: physics.to_vec(), ..Loop::parse(text, "loop.toml").unwrap() };
    random_load::recorded(&model, r, load, seed, None)
}

/// The diagnosis where nothing is known but a recording and a second one of the same.
fn of_nothing_known(recorded: impl Fn(u64) -> Signals, seed: u64) -> Diagnosis {
    let (first, holdout) = (recorded(seed), recorded(seed + 10));
    let text = format!(
        "[loop]\nsample_time_s = {}\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"identify\"\n",
        first.sample_time_s
    );
    diagnose(&[first], Some(&holdout), &Loop::parse(&text, "loop.toml").unwrap()).unwrap()
}

fn kinds(found: &Diagnosis) -> Vec<&'static str> {
    found.physics.iter().map(|named| named.term.kind.name).collect()
}

fn term(kind: &str, parameters: &[(&str, f64)]) -> Term {
    Term::new(kind, parameters).unwrap()
}

/// An oscillator under one wave moves a little about where it rests: the wave may be said, and nothing of the plant.
#[test]
#[ignore = "slow: two diagnoses"]
fn a_wave_makes_no_physics_of_an_oscillator() {
    for seed in [2, 3] {
        let one = |seed: u64| {
            let phase = 0.3 * seed as f64;
            let wave =
                term("periodic_load", &[("amplitude", 0.12), ("frequency_hz", 0.09), ("phase", phase)]);
            recorded(OSCILLATOR, vec![0.1; 14_000], &[wave], (1e-9, 0.999), seed)
        };
        let found = of_nothing_known(one, seed);
        println!("{seed}: {:?} {:?}", found.verdict, kinds(&found));
        assert!(kinds(&found).iter().all(|kind| *kind == "periodic_load"), "{seed}: {:?}", kinds(&found));
    }
}

/// A sensor that is off by a dozen deviations of y from some time on is told from a load, though a simulation from u follows nothing of y where a load walks.
#[test]
#[ignore = "slow: a diagnosis"]
fn a_bias_that_begins_is_named() {
    let bias = term("sensor_bias", &[("bias", 0.5)]).from_s(1400.0);
    let found = of_nothing_known(
        |seed| recorded(TWO_LAGS, vec![37.5; 12_000], std::slice::from_ref(&bias), (0.3, 0.99999), seed),
        1,
    );
    println!("{:?} {:?} {:?}", found.verdict, kinds(&found), found.holdout.after);
    assert_eq!(kinds(&found), ["sensor_bias"]);
    let named = &found.physics[0];
    assert!((named.term.parameters[0] / 0.5 - 1.0).abs() < 0.05 && (named.term.onset_s - 1400.0).abs() < 1.0);
}

/// A sensor that is nearly five times as noisy from some time on, in a loop that takes one step before: no simulation tells it, and none is asked for.
#[test]
#[ignore = "slow: a diagnosis"]
fn a_sensor_that_grows_louder_is_named() {
    let louder = term("sensor_noise", &[("ratio", 4.7)]).from_s(13.5);
    let r: Vec<f64> = (0..30_000).map(|n| if n < 9_740 { -0.9 } else { 1.1 }).collect();
    let found = of_nothing_known(
        |seed| recorded(RESONANCE, r.clone(), std::slice::from_ref(&louder), (5.0, 0.9999), seed),
        5,
    );
    println!("{:?} {:?} {:?}", found.verdict, kinds(&found), found.holdout.after);
    assert_eq!(kinds(&found), ["sensor_noise"]);
    assert!((found.physics[0].term.parameters[0] / 4.7 - 1.0).abs() < 0.1);
}
