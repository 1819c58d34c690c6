//! The diagnosis where the noise of the load is another than it was when the loop was healthy. The truth is what was put in.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::{Diagnosis, diagnose_since};
use drift_sim::likelihood_search::options::Options;
use drift_sim::physics::Term;
use drift_sim::plant::Plant;

use crate::random_load;

const AXIS: &str = "[loop]\nsample_time_s = 0.001\n[units]\nr = \"m\"\ny = \"m\"\nu = \"A\"\nforce = \"N\"\n[controller]\nkind = \"pid\"\nkp = 450.0\nki = 900.0\nkd = 25.0\n\
    derivative_filter_s = 0.004\nu_min = -1000.0\nu_max = 1000.0\n[sensor]\nnoise = 8e-7\n";
const SLIDES: &str = "[plant]\nkind = \"servo\"\noutput = \"position\"\ninertia = 50.0\nviscous = 208.0\nactuator_gain = 46.0\n";
const SAMPLES: usize = 16_000;
/// Of an arm that steps once and rests.
const STEPS_AT: usize = 5_800;
/// Deviation of the load in N, and what stays of it from one sample to the next, then and now.
const LOAD: f64 = 5.0;
const THEN: f64 = 0.99;
const NOW: f64 = 0.997;

fn diagnosed(left_out: &[Term]) -> Diagnosis {
    let truth = Loop::parse(&format!("{AXIS}{SLIDES}"), "loop.toml").unwrap();
    let recorded = |physics: &[Term], stays: f64, seed: u64| {
        let r = (0..SAMPLES).map(|n| if n < STEPS_AT { 0.05 } else { 0.15 }).collect();
        let model = Loop { physics: physics.to_vec(), ..truth.clone() };
        random_load::recorded(&model, r, (LOAD, stays), seed, None)
    };
    let (then, now) = (recorded(&[], THEN, 1), recorded(left_out, NOW, 2));
    let holdout = recorded(left_out, NOW, 3);
    let unknown = Loop { plant: Plant::Identify, ..truth.clone() };
    diagnose_since(&[then], &[now], Some(&holdout), &unknown, &Options::default()).unwrap()
}

/// A slower load moves an arm that rests otherwise, as more friction would: that is its noise.
#[test]
#[ignore = "slow: a diagnosis"]
fn nothing_is_named_where_only_the_load_is_slower_than_it_was() {
    let found = diagnosed(&[]);
    assert!(found.physics.is_empty(), "{:?}", found.physics);
}

/// Friction that has come is named beside such a load, and its size told.
#[test]
#[ignore = "slow: a diagnosis"]
fn friction_that_has_come_is_named_beside_a_slower_load() {
    let friction = Term { onset_s: 4.0, ..Term::new("viscous_friction", &[("ratio", 3.0)]).unwrap() };
    let found = diagnosed(&[friction]);
    let first = &found.physics.first().unwrap().term;
    assert_eq!(first.kind.name, "viscous_friction");
    assert!((first.parameters[0] - 3.0).abs() < 0.3, "{first:?}");
}
