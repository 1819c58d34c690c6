//! The diagnosis under a load that jumps now and then, which is noise of another kind than one that drifts. The truth is what was put in.

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, diagnose};
use drift_sim::physics::Term;
use drift_sim::recording::{Recording, RowState};
use drift_sim::reference::Reference;
use drift_sim::simulate::simulate;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use crate::random_load;

const ARM: &str = "[loop]\nsample_time_s = 0.005\n[units]\nr = \"rad\"\ny = \"rad\"\nu = \"V\"\nforce = \"N m\"\n\
    [controller]\nkind = \"pid\"\nkp = 30.0\nki = 60.0\nkd = 3.0\nderivative_filter_s = 0.01\nu_min = -100.0\nu_max = 100.0\n\
    [plant]\nkind = \"servo\"\noutput = \"position\"\ninertia = 0.2\nviscous = 0.3\nactuator_gain = 2.0\n[sensor]\nnoise = 2e-5\n";
const SAMPLES: usize = 6_000;
/// Deviation of the levels between which the load jumps, in N m, and how many it takes.
const LEVELS: f64 = 0.2;
const JUMPS: usize = 14;

/// Terms that make such a load.
fn jumping(model: &Loop, seed: u64) -> Vec<Term> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut level = 0.0;
    let jump = |_| {
        let next: f64 = StandardNormal.sample(&mut random);
        let by = LEVELS * next - level;
        level = LEVELS * next;
        let sample = random.next_u64() % SAMPLES as u64;
        let onset_s = sample as f64 * model.sample_time_s;
        Term { onset_s, ..Term::new("load_step", &[("level", by)]).unwrap() }
    };
    (0..JUMPS).map(jump).collect()
}

fn recorded(model: &Loop, left_out: &[Term], seed: u64) -> Signals {
    let r = Reference::random(0.0, 0.5, 300, seed).take_samples(SAMPLES);
    let physics = left_out.iter().cloned().chain(jumping(model, seed)).collect();
    let trace = simulate(&Loop { physics, ..model.clone() }, &r, &[], seed, None).unwrap();
    let (sample_time_s, state) = (model.sample_time_s, vec![RowState::Valid; SAMPLES]);
    let recording = Recording { sample_time_s, r, y: trace.y, u: trace.u, state, ..Recording::default() };
    Signals::new(&recording, model).unwrap()
}

fn diagnosed(left_out: &[Term], seed: u64) -> Diagnosis {
    let model = Loop::parse(ARM, "loop.toml").unwrap();
    let recording = |seed| recorded(&model, left_out, seed);
    let (train, holdout) = (recording(seed), recording(seed + 1));
    diagnose(&[train], Some(&holdout), &model).unwrap()
}

/// What is named but for loads that begin, which there are.
fn named(found: &Diagnosis) -> Vec<&'static str> {
    let kinds = found.physics.iter().map(|named| named.term.kind.name);
    kinds.filter(|kind| *kind != "load_step").collect()
}

/// The jumps are told, and about how large they are; nothing else is.
#[test]
#[ignore = "slow: two diagnoses"]
fn nothing_is_named_where_only_the_load_jumps() {
    for seed in [11, 21] {
        let found = diagnosed(&[], seed);
        assert!(named(&found).is_empty(), "{seed}: {:?}", named(&found));
        let size = found.load_jumps.unwrap().size / (LEVELS * libm::sqrt(2.0));
        assert!((0.5..2.0).contains(&size), "{seed}: {size}");
    }
}

/// Friction beside such a load is named, and its size told.
#[test]
#[ignore = "slow: two diagnoses"]
fn friction_is_named_where_the_load_jumps() {
    let friction = Term::new("coulomb_friction", &[("level", 0.1)]).unwrap();
    for seed in [31, 41] {
        let found = diagnosed(std::slice::from_ref(&friction), seed);
        assert_eq!(named(&found), ["coulomb_friction"], "{seed}");
        let level = found.physics[0].term.value("level").unwrap();
        assert!((level - 0.1).abs() < 0.005, "{seed}: {level}");
    }
}

/// A change of the plant is proved although the load jumps in what proves as well: its jumps show once the change explains what was seen.
#[test]
#[ignore = "slow: a diagnosis"]
fn a_change_is_proved_beside_jumps_that_no_fit_has_seen() {
    let change = Term { onset_s: 10.0, ..Term::new("viscous_friction", &[("ratio", 3.0)]).unwrap() };
    let found = diagnosed(std::slice::from_ref(&change), 51);
    assert_eq!(named(&found), ["viscous_friction"]);
    let ratio = found.physics.iter().find_map(|named| named.term.value("ratio")).unwrap();
    assert!((ratio - 3.0).abs() < 0.15, "{ratio}");
}

/// A level whose valve does nothing within a dead zone cycles, and its load jumps: a simulation has another phase, and misses more than one without a dead zone, as it does of a recording that
/// is drawn from what was found.
#[test]
#[ignore = "slow: three diagnoses"]
fn a_dead_zone_is_named_that_leads_a_simulation_astray() {
    const LEVEL: &str = "[loop]\nsample_time_s = 1.0\n[units]\nr = \"%\"\ny = \"%\"\nu = \"%\"\n\
        [controller]\nkind = \"pi\"\nkp = 24.8\nki = 0.193\nu_min = -100.0\nu_max = 100.0\n\
        [plant]\nkind = \"transfer-function\"\nnum = [0.0025]\nden = [1.0, 0.0]\n[sensor]\nnoise = 0.03\n";
    let model = Loop::parse(LEVEL, "loop.toml").unwrap();
    let dead_zone = Term::new("dead_zone", &[("half_width", 1.4)]).unwrap();
    for seed in [61, 301, 321] {
        let recorded = |seed: u64| {
            let r = (0..11_000).map(|n| if n < 4_200 { 45.5 } else { 54.5 }).collect();
            let physics = std::iter::once(dead_zone.clone()).chain(jumping(&model, seed)).map(|mut term| {
                if term.kind.name == "load_step" {
                    term.parameters[0] *= 3.0;
                }
                term
            });
            random_load::recorded(
                &Loop { physics: physics.collect(), ..model.clone() },
                r,
                (0.05, 0.98),
                seed,
                None,
            )
        };
        let found = diagnose(&[recorded(seed)], Some(&recorded(seed + 1)), &model).unwrap();
        assert_eq!(named(&found), ["dead_zone"], "{seed}");
        let half_width = found.physics[0].term.value("half_width").unwrap();
        assert!((half_width - 1.4).abs() < 0.5, "{seed}: {half_width}");
    }
}
