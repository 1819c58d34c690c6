//! `drift design` from outside: its JSON, and one line for what it refuses.

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

/// Lucas & Saccucci's chart: lambda 0.1 and L = 2.814 has one false alarm in 500 and finds one sigma after 10.3.
#[test]
fn the_ewma_has_the_textbook_numbers_and_the_reverse() {
    let number = |json: &serde_json::Value, key: &str| json[key].as_f64().unwrap();
    let limit = 2.814 * (0.1f64 / 1.9).sqrt();
    let read = |arguments: &[&str]| -> serde_json::Value {
        let out = drift(&[&["--detector", "ewma", "--json", "-"], arguments].concat());
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        serde_json::from_slice(&out.stdout).unwrap()
    };
    let forward = read(&["--lambda", "0.1", "--h", &limit.to_string()]);
    assert!((number(&forward, "arl0") / 500.0 - 1.0).abs() < 0.005, "{forward}");
    assert!((number(&forward, "arl1") - 10.3).abs() < 0.06, "{forward}");
    // lambda = 0.1 is the default.
    let back = read(&["--arl0", &number(&forward, "arl0").to_string()]);
    assert!((number(&back, "h") / limit - 1.0).abs() < 1e-6 && number(&back, "lambda") == 0.1, "{back}");
    let refused = drift(&["--detector", "ewma", "--k", "0.5", "--arl0", "500"]);
    assert_eq!(String::from_utf8_lossy(&refused.stderr), "error: --k does not go with an EWMA\n");
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
