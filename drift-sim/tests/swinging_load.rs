//! The diagnosis under a load that swings, in each recording in its own way, which is noise of another kind than one that drifts. The truth is what was put in.

use std::f64::consts::TAU;

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, diagnose};
use drift_sim::physics::Term;
use drift_sim::recording::{Recording, RowState};
use drift_sim::reference::Reference;
use drift_sim::simulate::simulate;

use crate::random_load;

const HEATER: &str = "[loop]\nsample_time_s = 1.0\n[units]\nr = \"degC\"\ny = \"degC\"\nu = \"%\"\n\
    [controller]\nkind = \"pi\"\nkp = 4.0\nki = 0.03\nu_min = 0.0\nu_max = 100.0\n\
    [plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 150.0\ndelay_s = 6.0\n[sensor]\nnoise = 0.02\n";
const SAMPLES: usize = 6_000;
/// Size of each wave, in the drive's unit.
const SIZE: f64 = 1.0;

/// Terms that make such a load.
fn swinging(hz: &[f64]) -> Vec<Term> {
    let wave = |(i, hz): (usize, &f64)| {
        let numbers = [("amplitude", SIZE), ("frequency_hz", *hz), ("phase", 2.0 * i as f64)];
        Term::new("periodic_load", &numbers).unwrap()
    };
    hz.iter().enumerate().map(wave).collect()
}

/// Of a loop that holds its level, or goes from one to another.
fn diagnosed(left_out: &[Term], holds: bool) -> Diagnosis {
    let model = Loop::parse(HEATER, "loop.toml").unwrap();
    let recorded = |hz: &[f64], seed: u64| {
        let (low, high) = if holds { (40.0, 40.0) } else { (35.0, 45.0) };
        let r = Reference::random(low, high, 1_500, seed).take_samples(SAMPLES);
        let physics = left_out.iter().cloned().chain(swinging(hz)).collect();
        let trace = simulate(&Loop { physics, ..model.clone() }, &r, &[], seed, None).unwrap();
        let (sample_time_s, state) = (model.sample_time_s, vec![RowState::Valid; SAMPLES]);
        let recording = Recording { sample_time_s, r, y: trace.y, u: trace.u, state, ..Recording::default() };
        Signals::new(&recording, &model).unwrap()
    };
    let (train, holdout) = (recorded(&[0.0053, 0.0057, 0.0062], 1), recorded(&[0.0021, 0.0026], 2));
    diagnose(&[train], Some(&holdout), &model).unwrap()
}

fn named(found: &Diagnosis) -> Vec<&'static str> {
    found.physics.iter().map(|named| named.term.kind.name).collect()
}

/// How often the load swings is told; nothing else is.
#[test]
#[ignore = "slow: two diagnoses"]
fn nothing_is_named_where_only_the_load_swings() {
    for holds in [true, false] {
        let found = diagnosed(&[], holds);
        assert!(named(&found).is_empty(), "{holds}: {:?}", named(&found));
        let waves = found.load_waves.unwrap().frequencies_hz;
        assert!(waves.iter().all(|hz| (0.0050..0.0065).contains(hz)), "{holds}: {waves:?}");
    }
}

/// A slow actuator beside such a load is named, and its size told.
#[test]
#[ignore = "slow: a diagnosis"]
fn a_lag_is_named_where_the_load_swings() {
    let lag = Term::new("unmodelled_lag", &[("time_constant_s", 40.0)]).unwrap();
    let found = diagnosed(&[lag], false);
    assert_eq!(named(&found), ["unmodelled_lag"]);
    let time_constant_s = found.physics[0].term.value("time_constant_s").unwrap();
    assert!((time_constant_s / 40.0 - 1.0).abs() < 0.1, "{time_constant_s}");
}

/// A flow whose reference sweeps over the waves of its load: they are told from what the model lacks of the sweep, and the slow sensor beside them is named. Its delay, which the loop
/// file says half as long, would take it up.
#[test]
#[ignore = "slow: a diagnosis"]
fn a_lag_is_named_where_the_reference_sweeps_over_the_waves() {
    const FLOW: &str = "[loop]\nsample_time_s = 0.5\n[units]\nr = \"m3/h\"\ny = \"m3/h\"\nu = \"%\"\n\
        [controller]\nkind = \"pi\"\nkp = 0.58\nki = 0.107\nu_min = 0.0\nu_max = 100.0\n\
        [plant]\nkind = \"first-order\"\ngain = 1.16\ntime_constant_s = 5.4\ndelay_s = 1.5\noffset = 0.8\n[sensor]\nnoise = 0.05\n";
    let model = Loop::parse(FLOW, "loop.toml").unwrap();
    let recorded = |hz: &[f64], seed: u64| {
        let part = |n: usize| n as f64 / 11_000.0;
        let sweep = |n: usize| 59.0 + 12.0 * libm::sin(TAU * 0.5 * n as f64 * (0.002 + 0.006 * part(n)));
        let lag = Term::new("sensor_lag", &[("time_constant_s", 1.8)]).unwrap();
        let physics = std::iter::once(lag).chain(swinging(hz)).collect();
        let r = (0..11_000).map(sweep).collect();
        random_load::recorded(&Loop { physics, ..model.clone() }, r, (0.05, 0.98), seed, None)
    };
    let (train, holdout) = (recorded(&[0.0244, 0.0261, 0.0098], 1), recorded(&[0.0151, 0.0098], 2));
    let found = diagnose(&[train], Some(&holdout), &model).unwrap();
    assert!(matches!(named(&found)[..], ["sensor_lag" | "unmodelled_lag"]), "{:?}", named(&found));
    assert_eq!(found.load_waves.unwrap().frequencies_hz.len(), 3);
}

/// A wave of each recording that is far larger than what swings beside it, otherwise in each, is named, and its size told.
#[test]
#[ignore = "slow: a diagnosis"]
fn a_wave_is_named_where_little_swings_beside_it() {
    let numbers = [("amplitude", 12.0 * SIZE), ("frequency_hz", 0.0058), ("phase", 1.0)];
    let found = diagnosed(&[Term::new("periodic_load", &numbers).unwrap()], false);
    let first = &found.physics.first().unwrap().term;
    assert_eq!(first.kind.name, "periodic_load");
    assert!((first.parameters[0] / (12.0 * SIZE) - 1.0).abs() < 0.1, "{first:?}");
    assert!(named(&found).iter().all(|kind| *kind == "periodic_load"), "{:?}", named(&found));
}
