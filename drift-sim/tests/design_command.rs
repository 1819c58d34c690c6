//! `drift design` from outside: its JSON, and one line for what it refuses.
#![allow(clippy::unwrap_used)]

use std::process::{Command, Output};

fn drift(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_drift")).arg("design").args(arguments).output().unwrap()
}

#[test]
fn json_on_standard_output_holds_the_textbook_numbers() {
    let out = drift(&["--k", "0.5", "--h", "5", "--shift", "1", "--json", "-"]);
    assert!(out.status.success());
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    for (key, known) in [("/arl0", 465.443506), ("/arl1", 10.37596992), ("/one_sided/arl0", 930.8870121)] {
        let ours = json.pointer(key).and_then(serde_json::Value::as_f64).unwrap();
        assert!((ours / known - 1.0).abs() < 1e-9, "{key}: {ours}");
    }
    assert_eq!(json["quantiles"]["shifted"]["p50"], 9.0);
}

#[test]
fn wrong_values_are_one_line_and_wrong_usage_is_exit_2() {
    for wrong in [
        ["--k", "-1", "--h", "5"],
        ["--k", "NaN", "--h", "5"],
        ["--k", "0.5", "--arl0", "1"],
        ["--k", "0.5", "--h", "1e300"],
    ] {
        let out = drift(&wrong);
        let message = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(1), "{wrong:?}");
        assert!(message.starts_with("error: ") && message.lines().count() == 1, "{message}");
    }
    assert_eq!(drift(&["--k", "0.5"]).status.code(), Some(2));
    assert_eq!(drift(&["--k", "0.5", "--h", "5", "--arl0", "500"]).status.code(), Some(2));
}
