//! `drift simulate` from outside: what it writes, where it refuses.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn drift(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_drift")).args(arguments).output().unwrap()
}

fn loops() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/loops")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn rows(csv: &str) -> Vec<Vec<f64>> {
    csv.lines().skip(1).map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect()
}

#[test]
fn every_loop_file_of_the_examples_runs_and_twice_to_the_same_bytes() {
    let mut count = 0;
    for file in std::fs::read_dir(loops()).unwrap() {
        let path = file.unwrap().path();
        let run = || {
            drift(&["simulate", path.to_str().unwrap(), "-o", "-", "--seed", "3", "--reference-mean", "20"])
        };
        let (first, second) = (run(), run());
        assert!(first.status.success(), "{}: {}", path.display(), text(&first.stderr));
        assert_eq!(first.stdout, second.stdout);
        assert!(first.stderr.is_empty(), "nothing but the run in a pipe");
        let csv = text(&first.stdout);
        assert!(csv.starts_with("t,r,y,u\n0,"));
        assert_eq!(rows(&csv).len(), 10_000);
        count += 1;
    }
    assert!(count >= 5);
}

/// A run that is fed back as `--reference` is reproduced, as there is no noise in it.
#[test]
fn a_recording_of_a_run_gives_the_run_again() {
    let folder = tempfile::tempdir().unwrap();
    let (first, again) = (folder.path().join("a.csv"), folder.path().join("b.csv"));
    let paper = loops().join("paper.toml");
    let [paper, first, again] = [&paper, &first, &again].map(|path| path.to_str().unwrap());
    assert!(drift(&["simulate", paper, "-o", first, "--duration", "2"]).status.success());
    let run = drift(&["simulate", paper, "-o", again, "--reference", first]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let [first, again] = [first, again].map(|path| rows(&std::fs::read_to_string(path).unwrap()));
    assert_eq!(first.len(), 2000);
    for (a, b) in first.iter().flatten().zip(again.iter().flatten()) {
        assert!((a - b).abs() < 1e-6);
    }
}

#[test]
fn faults_are_one_line_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.toml");
    let recording = folder.path().join("rec.csv");
    let out = folder.path().join("out.csv");
    let paper = std::fs::read_to_string(loops().join("paper.toml")).unwrap();
    std::fs::write(&recording, "t,r,y,u\n0,1,2,3\n1,1,x,3\n").unwrap();
    let out = out.to_str().unwrap();
    let recording = recording.to_str().unwrap();
    let cases: [(String, &[&str], &str); 5] = [
        (paper.replace("kp = 300.0", "kp = \"much\""), &[], "bad.toml:8: kp is \"much\""),
        (
            paper.replace("kp = 300.0", "kp = -300.0"),
            &["--duration", "100"],
            "the loop diverges: not finite at t = ",
        ),
        (paper.replace("kind = \"pi\"\nkp = 300.0\nki = 100.0", "kind = \"recorded\""), &[], "has no law"),
        (paper.clone(), &["--reference", recording], "rec.csv:3: 'x' in column 'y' is not a number"),
        (paper.clone(), &["--reference", recording, "--columns", "y=PV"], "no column 'PV'"),
    ];
    for (toml, more, message) in cases {
        std::fs::write(&bad, toml).unwrap();
        let run = drift(&[&["simulate", bad.to_str().unwrap(), "-o", out], more].concat());
        let stderr = text(&run.stderr);
        assert_eq!(run.status.code(), Some(1), "{stderr}");
        assert!(
            stderr.starts_with("error: ") && stderr.contains(message) && stderr.lines().count() == 1,
            "{stderr}"
        );
        assert!(!Path::new(out).exists());
    }
    assert_eq!(drift(&["simulate"]).status.code(), Some(2));
    assert_eq!(drift(&["simulate", "a.toml", "-o", "b", "--duration", "-1"]).status.code(), Some(2));
}

/// What belongs to the run stands before what belongs to reading recordings, which is the same for every command.
#[test]
fn the_help_keeps_its_own_options_together() {
    let help = text(&drift(&["simulate", "--help"]).stdout);
    let (own, reading) = help.split_once("Reading recordings:").unwrap();
    for option in ["--duration", "--seed", "--reference-mean", "--reference-sd", "--reference-hold"] {
        assert!(
            own.contains(option) && !reading.split_once("Examples:").unwrap().0.contains(option),
            "{option}"
        );
    }
}
