//! The diagnosis on recordings from real hardware whose hidden effects are known.
//!
//! The recordings are not part of the project: they are looked for in `DRIFT_RECORDINGS`, else in
//! `../shared/recordings` beside the workspace; where they are missing the test says so and skips. It prints one table
//! (`--nocapture` shows it), with the falls short in it: what is asserted is only what the diagnosis stands by.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::time::Instant;

use drift_sim::control_loop::Loop;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, Verdict, diagnose, identify, prove};
use drift_sim::physics::Term;
use drift_sim::recording::{ReadOptions, Recording};

fn folder(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("DRIFT_RECORDINGS")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings"), PathBuf::from);
    let folder = root.join(name);
    if !folder.is_dir() {
        println!("skipped: no recordings in {}", folder.display());
        return None;
    }
    Some(folder)
}

fn signals(path: &Path, model: &Loop) -> Signals {
    let extra = model.inputs.iter().map(|input| input.column.clone()).collect();
    let options = ReadOptions { extra, ..ReadOptions::default() };
    Signals::new(&Recording::read(path, &options).unwrap(), model).unwrap()
}

/// Diagnoses and prints the row of the table.
fn row(name: &str, recording: &Path, holdout: Option<&Path>, model: &Loop) -> Diagnosis {
    let train = signals(recording, model);
    let holdout = holdout.map(|path| signals(path, model));
    let began = Instant::now();
    let model = identify::plant(model, &train).unwrap().unwrap_or_else(|| model.clone());
    let found = diagnose(&train, holdout.as_ref(), &model).unwrap();
    let took = began.elapsed().as_secs_f64();
    let named: Vec<String> = found
        .physics
        .iter()
        .map(|named| {
            let numbers: Vec<String> = named
                .term
                .kind
                .parameters
                .iter()
                .zip(&named.term.parameters)
                .zip(&named.half_widths)
                .map(|((p, value), width)| format!("{} {value:.4} +- {width:.2}", p.name))
                .collect();
            format!("{} ({})", named.term.kind.name, numbers.join(", "))
        })
        .collect();
    let show = |fit: Option<prove::FitPct>| {
        let u = fit.and_then(|fit| fit.u_pct).map_or("-".into(), |u| format!("{u:.1}"));
        format!("{} / {u}", fit.map_or("-".into(), |fit| format!("{:.3}", fit.y_pct)))
    };
    println!(
        "| {name} | {} {} | {} | {} | {} | {took:.1} s |",
        found.verdict.name(),
        named.join("; "),
        show(found.holdout.nominal),
        show(found.holdout.before),
        show(found.holdout.after)
    );
    found
}

fn term<'a>(found: &'a Diagnosis, kind: &str) -> Option<&'a Term> {
    found.physics.iter().map(|named| &named.term).find(|term| term.kind.name == kind)
}

fn head() {
    println!("| recording | named | y / u nominal % | refitted % | improved % (hold-out) | time |");
}

/// Pulses at the actuator of which the loop file says nothing. Truth: 25 pulses of 0.5 s, one a second, of 1.0139*5 V.
#[test]
#[ignore = "slow: a minute of real recordings"]
fn pulses_after_the_controller_of_a_drive() {
    let Some(folder) = folder("emps") else { return };
    head();
    let model = Loop::read(&folder.join("loop.toml")).unwrap();
    let recording = folder.join("emps_pulses_ctrl.csv");
    let found = row("emps_pulses_ctrl", &recording, None, &model);
    let pulses = term(&found, "injected_signal").unwrap();
    assert!((pulses.value("level").unwrap() - 5.07).abs() < 0.05);
    let options = ReadOptions { extra: vec!["pulse".into()], ..ReadOptions::default() };
    let truth = Recording::read(&recording, &options).unwrap();
    let truth = truth.column("pulse").unwrap().to_vec();
    let edges: Vec<f64> = truth
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| pair[0] != pair[1])
        .map(|(i, _)| (i + 1) as f64 * 0.001)
        .collect();
    assert_eq!(pulses.spans.len(), 25);
    let ours = pulses.spans.iter().flat_map(|(from, to)| [*from, *to]);
    // The last pulse ends with the recording.
    for (edge, ours) in edges.iter().zip(ours) {
        assert!((edge - ours).abs() < 0.005, "{edge} {ours}");
    }
    assert!(term(&found, "coulomb_friction").is_some(), "the friction beside");
}

/// A heater that takes 0 to about 11 V, its u recorded before that limit; the plant is not known.
#[test]
#[ignore = "slow: a minute of real recordings"]
fn hidden_limit_of_a_heater() {
    let Some(folder) = folder("ce103_thermal") else { return };
    head();
    let model = Loop::read(&folder.join("loop.toml")).unwrap();
    let (train, holdout) = (folder.join("pi_kp33_ki1p23.csv"), folder.join("p_kp33.csv"));
    // A first-order plant that is driven by the unlimited u follows nothing here: saying so is right, "no mismatch" is not.
    match identify::plant(&model, &signals(&train, &model)) {
        Ok(_) => {
            let found = row("ce103 PI", &train, Some(&holdout), &model);
            assert_ne!(found.verdict, Verdict::NoMismatch);
        }
        Err(error) => println!("| ce103 PI | not identified: {error} |"),
    }
}
