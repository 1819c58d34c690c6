//! The diagnosis beside a y that is rounded: to a step that its noise moves it across, so that rounding is a noise like another, and to one that is coarse. The truth is what was put in.

use drift_sim::control_loop::Loop;
use drift_sim::controller::Controller;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, diagnose};
use drift_sim::physics::Term;
use drift_sim::recording::{Recording, RowState};
use drift_sim::reference::Reference;
use drift_sim::simulate::simulate;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const NOISE: f64 = 0.05;
const MOTOR: &str = "[loop]\nsample_time_s = 0.005\n[units]\nr = \"rad/s\"\ny = \"rad/s\"\nu = \"V\"\nforce = \"N m\"\n\
    [controller]\nkind = \"pi\"\nkp = 0.4\nki = 4.0\nu_min = -24.0\nu_max = 24.0\n\
    [plant]\nkind = \"servo\"\noutput = \"speed\"\ninertia = 0.01\nviscous = 0.02\nactuator_gain = 0.1\n[sensor]\nnoise = 0.05\n";
const SAMPLES: usize = 6_000;

fn recorded(model: &Loop, left_out: &[Term], seed: u64) -> Signals {
    let r = Reference::random(0.0, 20.0, 400, seed).take_samples(SAMPLES);
    let trace = simulate(&Loop { physics: left_out.to_vec(), ..model.clone() }, &r, &[], seed, None).unwrap();
    signals(model, r, trace.y, trace.u)
}

fn signals(model: &Loop, r: Vec<f64>, y: Vec<f64>, u: Vec<f64>) -> Signals {
    let (sample_time_s, state) = (model.sample_time_s, vec![RowState::Valid; r.len()]);
    let recording = Recording { sample_time_s, r, y, u, state, ..Recording::default() };
    Signals::new(&recording, model).unwrap()
}

/// What is named of a motor with this left out of its loop file.
fn named(left_out: &[Term]) -> Vec<&'static str> {
    named_beside(&[], left_out)
}

/// The same where the loop file states some of it.
fn named_beside(stated: &[Term], there: &[Term]) -> Vec<&'static str> {
    let model = Loop::parse(MOTOR, "loop.toml").unwrap();
    let (train, holdout) = (recorded(&model, there, 1), recorded(&model, there, 2));
    kinds(&diagnose(&[train], Some(&holdout), &Loop { physics: stated.to_vec(), ..model }).unwrap())
}

fn kinds(found: &Diagnosis) -> Vec<&'static str> {
    found.physics.iter().map(|named| named.term.kind.name).collect()
}

fn rounded_to(step: f64) -> Term {
    Term::new("quantization", &[("step", step)]).unwrap()
}

/// A converter whose step is as large as the noise adds to the noise; one of three times that is told, and friction is found beside both. Of ten times that it hides what y does between two steps.
#[test]
#[ignore = "slow: six diagnoses"]
fn friction_is_named_beside_a_rounded_y() {
    let friction = || Term::new("coulomb_friction", &[("level", 0.1)]).unwrap();
    assert!(named(&[rounded_to(NOISE)]).is_empty());
    assert_eq!(named(&[friction(), rounded_to(NOISE)]), ["coulomb_friction"]);
    assert_eq!(named(&[rounded_to(3.0 * NOISE)]), ["quantization"]);
    assert_eq!(named(&[friction(), rounded_to(3.0 * NOISE)]), ["quantization", "coulomb_friction"]);
    assert_eq!(named(&[rounded_to(10.0 * NOISE)]), ["quantization"]);
    assert_eq!(named(&[friction(), rounded_to(10.0 * NOISE)]), ["quantization"]);
}

/// A step that the loop file states, as the improved loop of a first diagnosis does, is not named again, and friction is found beside it.
#[test]
#[ignore = "slow: three diagnoses"]
fn a_step_that_is_stated_is_not_named() {
    let friction = Term::new("coulomb_friction", &[("level", 0.1)]).unwrap();
    let (step, coarse) = (rounded_to(3.0 * NOISE), rounded_to(10.0 * NOISE));
    for stated in [&step, &coarse].map(std::slice::from_ref) {
        assert!(named_beside(stated, stated).is_empty());
    }
    assert_eq!(named_beside(std::slice::from_ref(&step), &[step.clone(), friction]), ["coulomb_friction"]);
}

/// Noise of which nine tenths stay from sample to sample, with a converter behind it, is a coarse sensor and no slow one: its spectrum is none of an autoregression, rounding being white.
#[test]
#[ignore = "slow: a diagnosis"]
fn rounding_behind_colored_noise_is_no_slow_sensor() {
    let quiet = Loop::parse(&MOTOR.replace("noise = 0.05", "noise = 0.0"), "loop.toml").unwrap();
    let r = Reference::random(0.0, 20.0, 400, 3).take_samples(SAMPLES);
    let trace = simulate(&quiet, &r, &[], 3, None).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut noise = 0.0;
    let shown = |y: f64| {
        let new: f64 = StandardNormal.sample(&mut random);
        noise = 0.9 * noise + NOISE * (1.0f64 - 0.81).sqrt() * new;
        ((y + noise) / NOISE).round() * NOISE
    };
    let y: Vec<f64> = trace.y.into_iter().map(shown).collect();
    // The noise was added behind the loop, so that no law is stated.
    let model = Loop { controller: Controller::Recorded, ..quiet };
    let found = diagnose(&[signals(&model, r, y, trace.u)], None, &model).unwrap();
    assert_eq!(kinds(&found), ["quantization"]);
}
