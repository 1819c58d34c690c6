//! What a command writes never costs what it reads: no output is an input or another output, all outputs of a command
//! land together, and an interrupted command leaves nothing behind.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

const HEATER: &str = "[loop]\nsample_time_s = 1.0\n\n[controller]\nkind = \"pi\"\nkp = 2.0\nki = 0.1\n\n\
    [plant]\nkind = \"first-order\"\ngain = 1.0\ntime_constant_s = 20.0\n";

/// A folder with a recording, a link and a hard link to it, a loop file and a baseline.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("heater.toml"), HEATER).unwrap();
    let made = drift(folder.path(), &["simulate", "heater.toml", "--duration", "4000", "-o", "rec.csv"]);
    assert_eq!(made, (Some(0), String::new()));
    let made = drift(folder.path(), &["calibrate", "rec.csv", "-o", "baseline.toml", "--window", "20"]);
    assert_eq!(made.0, Some(0), "{}", made.1);
    std::os::unix::fs::symlink("rec.csv", at("link.csv")).unwrap();
    fs::hard_link(at("rec.csv"), at("hard.csv")).unwrap();
    fs::create_dir(at("sub")).unwrap();
    folder
}

/// Exit code and standard error.
fn drift(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_drift")).current_dir(folder).args(arguments).output().unwrap();
    (out.status.code(), String::from_utf8(out.stderr).unwrap())
}

/// Every file with its content.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .filter(|path| path.is_file())
        .map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(&path).unwrap()))
        .collect()
}

#[test]
fn no_output_is_an_input_or_another_output() {
    let folder = folder();
    let before = contents(folder.path());
    for (line, message) in [
        (
            "calibrate rec.csv -o rec.csv",
            "rec.csv: --output would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "calibrate rec.csv -o link.csv",
            "link.csv: --output would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "calibrate link.csv -o hard.csv",
            "hard.csv: --output would overwrite the input 'link.csv'; name another file for it",
        ),
        (
            "calibrate rec.csv -o sub/../rec.csv",
            "sub/../rec.csv: --output would overwrite the input 'rec.csv'; name another file for it",
        ),
        ("calibrate rec.csv -o b --rust b", "--output and --rust are both 'b'; name a file for each"),
        (
            "calibrate rec.csv -o b --c x --json sub/../b",
            "--output and --json are both 'sub/../b'; name a file for each",
        ),
        (
            "init rec.csv -o rec.csv",
            "rec.csv: --output would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "monitor rec.csv --baseline baseline.toml --report rec.csv",
            "rec.csv: --report would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "monitor rec.csv --baseline baseline.toml --json rec.csv",
            "rec.csv: --json would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "monitor rec.csv --baseline baseline.toml --plot rec.csv",
            "rec.csv: --plot would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "monitor rec.csv --baseline baseline.toml --report baseline.toml",
            "baseline.toml: --report would overwrite the input 'baseline.toml'; name another file for it",
        ),
        (
            "monitor rec.csv --baseline baseline.toml --json x --plot x",
            "--json and --plot are both 'x'; name a file for each",
        ),
        (
            "diagnose rec.csv --loop heater.toml --report rec.csv",
            "rec.csv: --report would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "diagnose rec.csv --loop heater.toml --model heater.toml",
            "heater.toml: --model would overwrite the input 'heater.toml'; name another file for it",
        ),
        (
            "diagnose rec.csv --loop heater.toml --healthy hard.csv --json link.csv",
            "link.csv: --json would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "simulate heater.toml --reference rec.csv -o rec.csv",
            "rec.csv: --output would overwrite the input 'rec.csv'; name another file for it",
        ),
        (
            "simulate heater.toml -o heater.toml",
            "heater.toml: --output would overwrite the input 'heater.toml'; name another file for it",
        ),
        ("simulate heater.toml -o sub", "sub: can't be written: it is a folder; the name of a file"),
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        assert_eq!(drift(folder.path(), &arguments), (Some(1), format!("error: {message}\n")), "{line}");
        assert!(contents(folder.path()) == before, "{line} changed a file");
    }
    // A recording from standard input is an input like another.
    let fed = Command::new(env!("CARGO_BIN_EXE_drift"))
        .current_dir(folder.path())
        .args(["calibrate", "-", "-o", "rec.csv"])
        .stdin(fs::File::open(folder.path().join("rec.csv")).unwrap())
        .output()
        .unwrap();
    assert_eq!(fed.status.code(), Some(1));
    assert!(contents(folder.path()) == before);
}

/// Files whose names the user did not choose: a folder of somebody's own is left alone, one from the time before is written anew.
#[test]
fn a_folder_of_files_that_are_not_ours_is_left_alone() {
    let folder = folder();
    let before = contents(folder.path());
    let demo = drift(folder.path(), &["demo", "--out", "."]);
    let message =
        "error: .: holds a file 'baseline.toml' that would be overwritten; another folder by --out\n";
    assert_eq!(demo, (Some(1), message.to_owned()));
    fs::write(folder.path().join("sub/fig08a.svg"), "mine").unwrap();
    let paper = drift(folder.path(), &["paper", "--out", "sub"]);
    let message =
        "error: sub: holds a file 'fig08a.svg' that would be overwritten; another folder by --out\n";
    assert_eq!(paper, (Some(1), message.to_owned()));
    assert!(contents(folder.path()) == before);
    for _ in 0..2 {
        assert_eq!(drift(folder.path(), &["demo", "--out", "demo"]).0, Some(0));
    }
}

/// The last of the outputs meets a full disk: none of the others appears, and none of the old ones changes.
#[test]
fn all_outputs_land_together_or_not_at_all() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let folder = folder();
    fs::write(folder.path().join("config.rs"), "old").unwrap();
    let before = contents(folder.path());
    for line in [
        "calibrate rec.csv -o new.toml --rust config.rs --c config.h --report /dev/full",
        "monitor rec.csv --baseline baseline.toml --json new.jsonl --plot config.rs --report /dev/full",
        "diagnose rec.csv --loop heater.toml --model new.toml --report config.rs --json /dev/full",
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let (code, message) = drift(folder.path(), &arguments);
        assert_eq!(code, Some(1), "{line}: {message}");
        assert!(
            message.starts_with("error: /dev/full: can't be written: No space left"),
            "{line}: {message}"
        );
        assert!(contents(folder.path()) == before, "{line} left something");
    }
}

/// A command that has half written its output and waits for more, and the pipe that it waits at. What stands in `before` is run first by
/// the shell that becomes the command.
fn half_written(folder: &Path, before: &str) -> (Child, ChildStdin) {
    let there = contents(folder);
    let line = "monitor - --baseline baseline.toml --json half.jsonl";
    let mut child = Command::new("sh")
        .current_dir(folder)
        .args(["-c", &format!("{before} exec '{}' {line}", env!("CARGO_BIN_EXE_drift"))])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut pipe = child.stdin.take().unwrap();
    pipe.write_all(&there["rec.csv"]).unwrap();
    for k in 4000..12_000 {
        writeln!(pipe, "{k},0,0,0").unwrap();
    }
    pipe.flush().unwrap();
    let began = Instant::now();
    while contents(folder).len() == there.len() {
        assert!(began.elapsed() < Duration::from_secs(60), "no output was begun");
        std::thread::sleep(Duration::from_millis(20));
    }
    (child, pipe)
}

fn send(signal: &str, child: &Child) {
    assert!(Command::new("kill").arg(signal).arg(child.id().to_string()).status().unwrap().success());
}

/// Ctrl-C, the request to end and a terminal that is closed, while the output is half written.
#[test]
fn an_interrupted_command_leaves_nothing_behind() {
    let folder = folder();
    let before = contents(folder.path());
    // Begun by nohup, these tests and all that they begin ignore the hang-up.
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored =
        status.lines().find_map(|line| line.strip_prefix("SigIgn:")?.trim().chars().last()?.to_digit(16));
    let hang_up = ignored.filter(|mask| mask & 1 == 0).map(|_| ("-HUP", 129));
    for (signal, code) in [("-INT", 130), ("-TERM", 143)].into_iter().chain(hang_up) {
        let (mut child, _pipe) = half_written(folder.path(), "");
        send(signal, &child);
        assert_eq!(child.wait().unwrap().code(), Some(code), "{signal}");
        assert!(contents(folder.path()) == before, "{signal} left something");
    }
}

/// `nohup` begins a command with the hang-up ignored: it goes on to its end.
#[test]
fn a_hang_up_that_is_ignored_stays_ignored() {
    let folder = folder();
    let (mut child, pipe) = half_written(folder.path(), "trap '' HUP;");
    send("-HUP", &child);
    std::thread::sleep(Duration::from_millis(200));
    drop(pipe);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(contents(folder.path()).contains_key("half.jsonl"));
}

/// Standard output has more names than one.
#[test]
fn two_outputs_to_standard_output_are_refused() {
    let folder = folder();
    let before = contents(folder.path());
    for (line, other) in [
        (
            "monitor rec.csv --baseline baseline.toml --json /dev/stdout --plot -",
            "--json and --plot are both '-'",
        ),
        (
            "monitor rec.csv --baseline baseline.toml --json - --plot /dev/fd/1",
            "--json and --plot are both '/dev/fd/1'",
        ),
        ("diagnose rec.csv --json - --report /dev/stdout", "--report and --json are both"),
    ] {
        let (code, told) = drift(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(code, Some(1), "{line}: {told}");
        assert!(told.contains(other) || told.contains("--json and --report are both"), "{line}: {told}");
    }
    // The file behind standard output, by its own name.
    let out = fs::File::create(folder.path().join("out")).unwrap();
    let refused = Command::new(env!("CARGO_BIN_EXE_drift"))
        .current_dir(folder.path())
        .args("monitor rec.csv --baseline baseline.toml --json - --plot out".split(' '))
        .stdout(out)
        .output()
        .unwrap();
    assert_eq!(refused.status.code(), Some(1));
    fs::remove_file(folder.path().join("out")).unwrap();
    // What nobody keeps may be written to twice.
    let null = "monitor rec.csv --baseline baseline.toml --json /dev/null --plot /dev/null";
    assert_eq!(drift(folder.path(), &null.split(' ').collect::<Vec<_>>()).0, Some(0));
    assert!(contents(folder.path()) == before);
}
