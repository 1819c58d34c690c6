//! `drift fleet` hands over to another program: its arguments, its exit code, and what is said where it is not there.
#![cfg(unix)]

use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output};

fn drift(path: &std::path::Path, arguments: &[&str]) -> Output {
    // A copy of its own: beside the one that cargo has built there may be a drift-fleet. Another process writes it: a program that another
    // test starts meanwhile would hold a file of ours open, and what is open for writing can't be run.
    let own = path.join("drift");
    assert!(Command::new("cp").arg(env!("CARGO_BIN_EXE_drift")).arg(&own).status().unwrap().success());
    Command::new(own)
        .arg("fleet")
        .args(arguments)
        .env("PATH", format!("{}:/bin:/usr/bin", path.display()))
        .output()
        .unwrap()
}

#[test]
fn where_it_is_not_installed_one_line_says_how() {
    let folder = tempfile::tempdir().unwrap();
    let said = drift(folder.path(), &["monitor", "lake"]);
    let line = String::from_utf8(said.stderr).unwrap();
    let expected = "error: drift-fleet is not installed beside drift, nor on PATH; cargo install --path drift-sim/fleet --locked\n";
    assert_eq!((said.status.code(), line.as_str()), (Some(1), expected));
}

#[test]
fn arguments_and_exit_code_are_those_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("drift-fleet");
    std::fs::write(&program, "#!/bin/sh\nfor one in \"$@\"; do echo \"<$one>\"; done\nexit 3\n").unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let said = drift(folder.path(), &["monitor", "a b", "--loop-column", "tag", "--help"]);
    let told = String::from_utf8(said.stdout).unwrap();
    assert_eq!(
        (said.status.code(), told.as_str()),
        (Some(3), "<monitor>\n<a b>\n<--loop-column>\n<tag>\n<--help>\n")
    );
}
