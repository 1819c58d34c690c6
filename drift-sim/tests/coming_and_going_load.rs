//! The diagnosis of a signal of one level that enters after u now and then, beside a random load. The truth is what was put in.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, diagnose};
use drift_sim::physics::Term;
use drift_sim::reference::Reference;
use drift_sim::simulate::Start;

use crate::random_load;

const FLOW: &str = "[loop]\nsample_time_s = 0.5\n[units]\nr = \"m3/h\"\ny = \"m3/h\"\nu = \"%\"\n\
    [controller]\nkind = \"pi\"\nkp = 1.5\nki = 0.1\nu_min = 0.0\nu_max = 100.0\n\
    [plant]\nkind = \"first-order\"\ngain = 0.8\ntime_constant_s = 12.0\ndelay_s = 3.0\noffset = 2.0\n[sensor]\nnoise = 0.02\n";
const SAMPLES: usize = 8_000;
/// Deviation of the random load, in % of u, and the part of it that stays from one sample to the next.
const LOAD: f64 = 0.3;
const STAYS: f64 = 0.998;
const LEVEL: f64 = 4.0;

/// A recording with these spans of the signal.
fn recorded(model: &Loop, spans: &[(f64, f64)], seed: u64) -> Signals {
    let signal = Term::new("injected_signal", &[("level", LEVEL)]).unwrap().within(spans);
    let mut model = model.clone();
    model.physics.extend((!spans.is_empty()).then_some(signal));
    let r = Reference::random(50.0, 3.0, 900, seed).take_samples(SAMPLES);
    random_load::recorded(&model, r, (LOAD, STAYS), seed, Some(&Start::held(50.0, 60.0)))
}

fn diagnosed(spans: &[(f64, f64)]) -> Diagnosis {
    let model = Loop::parse(FLOW, "loop.toml").unwrap();
    diagnose(&[recorded(&model, spans, 5)], Some(&recorded(&model, &[], 6)), &model).unwrap()
}

/// A recording of 4 000 s in which the signal is on twice, 700 s and 90 s long: it alone is named, with its level and its times, and no load that begins, no leak.
#[test]
#[ignore = "slow: a diagnosis"]
fn a_signal_that_is_on_twice_is_named_with_its_times() {
    let spans = [(850.0, 1_550.0), (2_310.0, 2_400.0)];
    let found = diagnosed(&spans);
    let kinds: Vec<&str> = found.physics.iter().map(|named| named.term.kind.name).collect();
    assert_eq!(kinds, ["injected_signal"]);
    let term = &found.physics[0].term;
    assert!((term.value("level").unwrap() - LEVEL).abs() < 0.2, "{term:?}");
    assert_eq!(term.spans.len(), spans.len(), "{term:?}");
    for ((from, to), (is_from, is_to)) in term.spans.iter().zip(spans) {
        assert!((from - is_from).abs() < 2.0 && (to - is_to).abs() < 2.0, "{term:?}");
    }
}

/// The same beside a load that jumps now and then, once by six tenths of the signal's level: that is no edge of it.
#[test]
#[ignore = "slow: a diagnosis"]
fn a_jump_of_the_load_is_no_edge_of_the_signal() {
    let model = Loop::parse(FLOW, "loop.toml").unwrap();
    let jump =
        |(onset_s, by): (f64, f64)| Term { onset_s, ..Term::new("load_step", &[("level", by)]).unwrap() };
    let jumps = [
        (200.0, 0.9),
        (520.0, -1.3),
        (1_130.0, 1.1),
        (1_700.0, -1.2),
        (2_050.0, 0.8),
        (2_620.0, -1.0),
        (3_060.0, 2.4),
        (3_400.0, -1.5),
    ]
    .map(jump);
    let spans = [(850.0, 1_550.0), (2_310.0, 2_500.0)];
    let loaded = Loop { physics: jumps.to_vec(), ..model.clone() };
    let found =
        diagnose(&[recorded(&loaded, &spans, 7)], Some(&recorded(&loaded, &spans, 8)), &model).unwrap();
    let signal = found.physics.iter().find(|named| named.term.kind.name == "injected_signal");
    let term = &signal.unwrap_or_else(|| panic!("{:?}", found.physics)).term;
    assert!((term.value("level").unwrap() - LEVEL).abs() < 0.4, "{term:?}");
    assert_eq!(term.spans.len(), spans.len(), "{term:?}");
}

/// The same loop without the signal: nothing is.
#[test]
#[ignore = "slow: a diagnosis"]
fn nothing_is_named_where_nothing_comes_and_goes() {
    let found = diagnosed(&[]);
    assert!(
        found.physics.is_empty(),
        "{:?}",
        found.physics.iter().map(|n| n.term.kind.name).collect::<Vec<_>>()
    );
}
