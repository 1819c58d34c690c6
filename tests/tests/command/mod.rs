//! Builds the command that tests run.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use drift_tests::markdown::root;

/// Builds `drift` as released and says where it lies.
pub fn drift() -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap();
    let mut build = Command::new(&cargo);
    build.args([
        "build",
        "--release",
        "--locked",
        "--bin",
        "drift",
        "--message-format=json-render-diagnostics",
    ]);
    let built = build.current_dir(root()).stderr(Stdio::inherit()).output().unwrap();
    assert!(built.status.success());
    let messages = String::from_utf8(built.stdout).unwrap();
    let executable = messages.lines().rev().find_map(|line| {
        let message: serde_json::Value = serde_json::from_str(line).ok()?;
        message.get("executable")?.as_str().map(PathBuf::from)
    });
    executable.unwrap()
}
