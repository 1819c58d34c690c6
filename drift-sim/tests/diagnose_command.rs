//! `drift diagnose` as a person meets it: the same sentence on screen, page and in JSON, in the time of the recording.

use std::fs;
use std::path::Path;
use std::process::Command;

const LOOP: &str = "[loop]\nsample_time_s = 1.0\n\n[units]\ny = \"degC\"\nu = \"%\"\n\n[controller]\nkind = \"pi\"\nkp = 2.0\n\
    ki = 0.1\n\n[plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 20.0\n\n[sensor]\nnoise = 0.02\n";
const WORN: &str = "\n[[physics]]\nkind = \"gain_loss\"\nloss = 0.3\nonset_s = 2000.0\n";

/// What it prints.
fn drift(folder: &Path, line: &str) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_drift"))
        .current_dir(folder)
        .env("LC_ALL", "C")
        .args(line.split(' '))
        .output()
        .unwrap();
    assert!(out.status.success(), "{line}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

/// The recording begins at 13 600 s of its own clock, the fault 2000 s later: nothing says 2000.
#[test]
fn the_onset_is_told_in_the_recordings_own_time() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("loop.toml"), LOOP).unwrap();
    fs::write(at("worn.toml"), LOOP.to_owned() + WORN).unwrap();
    drift(
        folder.path(),
        "simulate worn.toml -o run.csv --duration 4000 --reference-mean 40 --reference-sd 4 --reference-hold 200",
    );
    let run = fs::read_to_string(at("run.csv")).unwrap();
    let late = run.lines().map(|line| match line.split_once(',') {
        Some((t, rest)) if t != "t" => format!("{},{rest}\n", t.parse::<f64>().unwrap() + 13_600.0),
        _ => format!("{line}\n"),
    });
    fs::write(at("late.csv"), late.collect::<String>()).unwrap();
    let screen =
        drift(folder.path(), "diagnose late.csv --loop loop.toml --report page.html --json found.json");
    let sentence = "The actuator delivers 70 % of what it should since 15 600 s.";
    for (name, text) in [
        ("screen", screen.clone()),
        ("page", fs::read_to_string(at("page.html")).unwrap()),
        ("JSON", fs::read_to_string(at("found.json")).unwrap()),
    ] {
        assert!(text.replace(['\u{a0}', '\n'], " ").contains(sentence), "{name}: {text}");
    }
    assert!(screen.contains("shows: 15") && !screen.contains("2000 s"), "{screen}");
}
