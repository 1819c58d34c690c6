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
use drift_sim::diagnose::{Diagnosis, diagnose, identify, prove, valve};
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

/// Diagnoses and prints the row of the table; `None` where the plant can't be identified, with which nothing is named.
fn row(name: &str, recording: &Path, holdout: Option<&Path>, model: &Loop) -> Option<Diagnosis> {
    let train = signals(recording, model);
    let holdout = holdout.map(|path| signals(path, model));
    let began = Instant::now();
    let found = match diagnose(&train, holdout.as_ref(), model) {
        Ok(found) => found,
        Err(error) => {
            println!("| {name} | nothing: {error} | - | - | - | {:.1} s |", began.elapsed().as_secs_f64());
            return None;
        }
    };
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
            let ties = named.tied.iter().map(|kind| format!(" or {kind}")).collect::<String>();
            let spans: Vec<String> =
                named.term.spans.iter().map(|(from, to)| format!(" {from:.0}..{to:.0} s")).collect();
            format!("{}{ties} ({}){}", named.term.kind.name, numbers.join(", "), spans.join(","))
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
    Some(found)
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
    let found = row("emps_pulses_ctrl", &recording, None, &model).unwrap();
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

/// A heater that takes 0 to about 11 V, its u (-31 .. 98 V) recorded before that limit; the plant is not known. The hold-out was run
/// under another law.
#[test]
#[ignore = "slow: half a minute of real recordings"]
fn hidden_limit_of_a_heater() {
    let Some(folder) = folder("ce103_thermal") else { return };
    head();
    let model = Loop::read(&folder.join("loop.toml")).unwrap();
    let (train, holdout) = (folder.join("pi_kp33_ki1p23.csv"), folder.join("p_kp33.csv"));
    let found = row("ce103 PI, hold-out P", &train, Some(&holdout), &model).unwrap();
    assert_eq!(found.physics.len(), 1);
    let limit = term(&found, "saturation").unwrap();
    assert!(limit.value("lower").unwrap().abs() < 0.6);
    // Documented as about 11 V; with the plant beside free, this is what fits best.
    assert!((9.0..12.0).contains(&limit.value("upper").unwrap()));
    let left = |fit: Option<prove::FitPct>| 100.0 - fit.unwrap().y_pct;
    let times = left(found.holdout.before) / left(found.holdout.after);
    println!("error of y on the unseen P run: {times:.1} times less than that of the best linear plant");
    assert!(times > 5.0);
}

/// A loop file for a plain export: SP, PV, OP, nothing known.
fn export(folder: &tempfile::TempDir, sample_time_s: f64, units: [&str; 2]) -> Loop {
    let path = folder.path().join("loop.toml");
    let [y, u] = units;
    let text = format!(
        "[loop]\nsample_time_s = {sample_time_s:?}\n[units]\nr = \"{y}\"\ny = \"{y}\"\nu = \"{u}\"\n\
         [controller]\nkind = \"recorded\"\n[plant]\nkind = \"identify\"\n"
    );
    std::fs::write(&path, text).unwrap();
    Loop::read(&path).unwrap()
}

/// Steps of an injected column: (from, to, size), as long as it is not zero.
fn injected(path: &Path, column: &str) -> Vec<(f64, f64, f64)> {
    let options = ReadOptions { extra: vec![column.into()], ..ReadOptions::default() };
    let recording = Recording::read(path, &options).unwrap();
    let mut spans: Vec<(f64, f64, f64)> = Vec::new();
    for (n, level) in recording.column(column).unwrap().iter().enumerate() {
        let t = n as f64 * recording.sample_time_s;
        match spans.last_mut() {
            Some(last) if last.1 == t && last.2 == *level => last.1 = t + recording.sample_time_s,
            _ if level.abs() > 0.0 => spans.push((t, t + recording.sample_time_s, *level)),
            _ => {}
        }
    }
    spans
}

/// Heater steps of 20 % after u and sensor steps of 5 K, three of each, under an unknown law; the plant comes from set-point runs.
/// A second heater warms the first, which the loop file does not know.
#[test]
#[ignore = "slow: a minute of real recordings"]
fn loads_and_biases_of_a_temperature_lab() {
    let Some(folder) = folder("tclab") else { return };
    head();
    let temporary = tempfile::tempdir().unwrap();
    let model = export(&temporary, 1.0, ["K", "%"]);
    let runs = ["augmented_arx", "constrained_ml_1", "reg_cons_ml"];
    let healthy: Vec<Signals> =
        runs.iter().map(|run| signals(&folder.join(format!("sp_{run}.csv")), &model)).collect();
    let model = identify::from_healthy(&model, &healthy).unwrap();
    let (mut hit, mut all, mut wrong) = (0, 0, 0);
    for run in runs {
        let path = folder.join(format!("dist_{run}.csv"));
        let found = row(&format!("tclab dist_{run}"), &path, None, &model).unwrap();
        for (column, kind, size) in [("din1", "injected_signal", 6.0), ("dout1", "sensor_bias", 0.5)] {
            let truth = injected(&path, column);
            let ours: Vec<(f64, f64, f64)> = (found.physics.iter())
                .filter(|named| named.term.kind.name == kind)
                .flat_map(|named| named.term.spans.iter().map(|(a, b)| (*a, *b, named.term.parameters[0])))
                .collect();
            let close = |a: &(f64, f64, f64), b: &(f64, f64, f64)| {
                (a.0 - b.0).abs() < 30.0 && (a.1 - b.1).abs() < 30.0 && (a.2 - b.2).abs() < size
            };
            hit += truth.iter().filter(|truth| ours.iter().any(|ours| close(ours, truth))).count();
            wrong += ours.iter().filter(|ours| !truth.iter().any(|truth| close(ours, truth))).count();
            all += truth.len();
        }
    }
    println!("spans of the right kind within 30 s and 30 % (bias: 10 %): {hit} of {all}, others {wrong}");
    assert!(hit >= 15 && wrong <= 3, "{hit} {wrong}");
    for (run, signals) in runs.iter().zip(&healthy) {
        let found = diagnose(signals, None, &model).unwrap();
        let named: Vec<&str> = found.physics.iter().map(|named| named.term.kind.name).collect();
        println!("| tclab sp_{run} (healthy) | {} {named:?} |", found.verdict.name());
    }
}

/// Twelve loops of a refinery, SP, PV and OP alone. What sticks was judged by the plant; a flow valve needs about 2 % of u
/// before y moves.
#[test]
#[ignore = "slow: a minute of real recordings"]
fn sticking_valves_of_a_refinery() {
    let Some(folder) = folder("stiction_plant") else { return };
    head();
    let temporary = tempfile::tempdir().unwrap();
    let model = export(&temporary, 10.0, ["PV", "OP"]);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder).unwrap().map(|f| f.unwrap().path()).collect();
    paths.sort();
    let mut found_of_flow = 0;
    for path in paths.iter().filter(|path| path.extension().is_some_and(|end| end == "csv")) {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let found = row(&name, path, None, &model);
        if let Some(valve) = valve::search(&signals(path, &model)) {
            println!(
                "|   | sticking gains {:.1} over the best linear plant, band {:.2} | | | | |",
                valve.gain, valve.term.parameters[0]
            );
        }
        let stiction = found.as_ref().and_then(|found| term(found, "stiction")).cloned();
        if name.starts_with("nostiction") {
            assert!(found.is_none_or(|found| found.physics.is_empty()), "{name}");
        }
        if let (Some(stiction), true) = (stiction, name.starts_with("stiction_2411FIC20102")) {
            let band = stiction.value("stick_band").unwrap();
            assert!((0.8..3.0).contains(&band), "{name}: {band}");
            found_of_flow += 1;
        }
    }
    println!("sticking found on {found_of_flow} of the 3 recordings of 2411FIC20102");
    assert!(found_of_flow >= 2);
}
