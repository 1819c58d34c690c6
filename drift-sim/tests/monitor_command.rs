//! `drift monitor` from outside: what it prints and writes, its exit codes, and one line for what it refuses.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// A loop that holds y = 10 with u = 2 and a standard deviation of 0.02 per 5 s window; nothing else is judged.
const BASELINE: &str = r#"
schema = "drift.baseline/1"

[timing]
sample_time_s = 0.1
block_ticks = 10
window_blocks = 5
hop_blocks = 5

[samples]
min_valid = 0.5

[decision]
confirm_hops = 20
log_odds = 4.6
smallest_shift = 1.0

[promise]
false_alarm_every_h = 24.0
decisions = 17280.0
confidence = 0.9

[calibration]
files = ["healthy.csv"]
windows = 100
effective_windows = 100.0

[[channel]]
kind = "energy_error"
index = "iae"

[[channel]]
kind = "effort"
baseline = { b0 = 2.0, b1 = 0.0, sigma = 0.02, windows = 0.0, x_mean = 0.0, x_ss = 0.0, x_min = 9.0, x_max = 11.0 }
detectors = { cusum = { k = 0.5, h = 8.0 }, shewhart = { lower = -4.0, upper = 4.0 } }

[[channel]]
kind = "activity"
"#;

/// 500 s; from 200 s to `until_s` it takes 0.2 more to hold y.
fn recording(until_s: f64) -> String {
    let mut csv = String::from("t,r,y,u\n");
    for i in 0..5000 {
        let t = i as f64 / 10.0;
        let load = if (200.0..until_s).contains(&t) { 0.2 } else { 0.0 };
        csv += &format!("{t:.1},10,10,{}\n", 2.0 + load + 0.01 * f64::from(i % 3 - 1));
    }
    csv
}

/// A folder with the baseline, a recording that ends in drift, one with a disturbance and a healthy one.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("baseline.toml", BASELINE);
    write("drift.csv", &recording(500.0));
    write("disturbed.csv", &recording(230.0));
    write("healthy.csv", &recording(200.0));
    folder
}

fn drift(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_drift"));
    command.current_dir(folder).arg("monitor").args(arguments).output().unwrap()
}

fn message(out: &Output) -> String {
    String::from_utf8(out.stderr.clone()).unwrap()
}

#[test]
fn the_screen_says_drift_where_and_since_when() {
    let folder = folder();
    let out = drift(folder.path(), &["drift.csv", "--baseline", "baseline.toml"]);
    assert_eq!(out.status.code(), Some(0), "{}", message(&out));
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(text.contains("DRIFT\nIt takes more effort to hold y than it did, since about 200 s."), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    assert!(text.contains("one false alarm in 24 h"), "{text}");
    assert!(text.lines().count() < 24 && !text.contains('\u{1b}'), "one screen, no colour:\n{text}");
    assert!(out.stderr.is_empty(), "no progress bar in a pipe");
}

#[test]
fn fail_on_sets_the_exit_code() {
    let folder = folder();
    for (file, level, code) in [
        ("healthy.csv", "disturbance", 0),
        ("disturbed.csv", "disturbance", 3),
        ("disturbed.csv", "suspect", 0),
        ("disturbed.csv", "drift", 0),
        ("drift.csv", "suspect", 3),
        ("drift.csv", "drift", 3),
    ] {
        let out = drift(folder.path(), &[file, "--baseline", "baseline.toml", "--fail-on", level]);
        assert_eq!(out.status.code(), Some(code), "{file} --fail-on {level}: {}", message(&out));
    }
    let usage = drift(folder.path(), &["drift.csv", "--baseline", "baseline.toml", "--fail-on", "x"]);
    assert_eq!(usage.status.code(), Some(2));
}

#[test]
fn json_lines_on_standard_output_and_the_recording_from_standard_input() {
    let folder = folder();
    let mut child = Command::new(env!("CARGO_BIN_EXE_drift"))
        .current_dir(folder.path())
        .args(["monitor", "-", "--baseline", "baseline.toml", "--json", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(recording(500.0).as_bytes()).unwrap();
    let out = child.wait_with_output().unwrap();
    assert!(out.status.success());
    let text = String::from_utf8(out.stdout).unwrap();
    let lines: Vec<serde_json::Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.len(), 101);
    assert_eq!(lines[100]["schema"], "drift.monitor/1");
    assert_eq!(lines[100]["summary"]["verdict"], "drift");
    assert_eq!(lines[99]["channels"][1]["side"], "high");
}

#[test]
fn files_are_written_whole_or_not_at_all() {
    let folder = folder();
    let all = ["drift.csv", "--baseline", "baseline.toml", "--json", "out.jsonl", "--plot", "out.svg"];
    assert!(drift(folder.path(), &all).status.success());
    assert_eq!(fs::read_to_string(folder.path().join("out.jsonl")).unwrap().lines().count(), 101);
    assert!(fs::read_to_string(folder.path().join("out.svg")).unwrap().contains("</svg>"));
    // A recording that breaks on its last line leaves no new file, and the old one as it was.
    let broken = recording(500.0) + "500.0,10,ten,2\n";
    fs::write(folder.path().join("broken.csv"), broken).unwrap();
    let out = drift(folder.path(), &["broken.csv", "--baseline", "baseline.toml", "--json", "new.jsonl"]);
    assert_eq!(out.status.code(), Some(1));
    assert!(message(&out).starts_with("error: broken.csv:5002: "), "{}", message(&out));
    assert!(!folder.path().join("new.jsonl").exists());
}

#[test]
fn a_report_holds_the_command_line_and_the_drift() {
    let folder = folder();
    let arguments = ["drift.csv", "--baseline", "baseline.toml", "--report", "the report.html"];
    let out = drift(folder.path(), &arguments);
    assert_eq!(out.status.code(), Some(0), "{}", message(&out));
    let page = fs::read_to_string(folder.path().join("the report.html")).unwrap();
    assert!(
        page.contains("drift monitor drift.csv --baseline baseline.toml --report &#39;the report.html&#39;")
    );
    assert!(page.contains("<h1>It takes more effort to hold y than it did, since about 200 s.</h1>"));
    let two =
        drift(folder.path(), &["drift.csv", "--baseline", "baseline.toml", "--json", "-", "--report", "-"]);
    assert_eq!(message(&two), "error: --json and --report are both '-'; name a file for each\n");
}

#[test]
fn every_help_of_a_report_has_an_example() {
    for command in ["monitor", "diagnose", "calibrate"] {
        let out = Command::new(env!("CARGO_BIN_EXE_drift")).args([command, "--help"]).output().unwrap();
        let text = String::from_utf8(out.stdout).unwrap();
        assert!(
            text.contains("--report <OUT.html>") && text.contains(&format!("  drift {command} ")),
            "{text}"
        );
    }
}

#[test]
fn what_is_refused_is_one_line() {
    let folder = folder();
    let slow = "t,r,y,u\n".to_owned() + &(0..9).map(|i| format!("{i},1,1,1\n")).collect::<String>();
    fs::write(folder.path().join("slow.csv"), slow).unwrap();
    for (arguments, expected) in [
        (
            ["slow.csv", "--baseline", "baseline.toml"],
            "slow.csv: sampled every 1 s, but the baseline was learnt at 0.1",
        ),
        (["none.csv", "--baseline", "baseline.toml"], "none.csv: can't be read"),
        (["drift.csv", "--baseline", "none.toml"], "none.toml: can't be read"),
        (["drift.csv", "--baseline", "drift.csv"], "drift.csv"),
    ] {
        let out = drift(folder.path(), &arguments);
        let message = message(&out);
        assert_eq!(out.status.code(), Some(1), "{arguments:?}");
        assert!(message.starts_with(&format!("error: {expected}")), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(out.stdout.is_empty());
    }
}
