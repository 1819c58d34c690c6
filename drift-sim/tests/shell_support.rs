//! What the command does for shells and terminals: completions, manual pages, no colour where none is wanted.

use std::io::Write;
use std::process::{Command, Output, Stdio};

fn drift(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_drift")).args(arguments).output().unwrap()
}

fn printed(arguments: &[&str]) -> String {
    let output = drift(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The commands that the help lists, without `help` itself.
fn commands() -> Vec<String> {
    let help = printed(&["--help"]);
    let section = help.split("Commands:\n").nth(1).unwrap().split("\nOptions:").next().unwrap();
    let lines = section.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = lines.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let names: Vec<String> = names.map(str::to_string).collect();
    assert!(["demo", "monitor", "man"].iter().all(|name| names.iter().any(|n| n == name)), "{names:?}");
    names
}

/// Feeds a program; `None` where it is not installed.
fn fed(program: &str, arguments: &[&str], input: &str) -> Option<Output> {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let Ok(mut running) = command.spawn() else {
        println!("skipped: no {program} here");
        return None;
    };
    running.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    Some(running.wait_with_output().unwrap())
}

#[test]
fn every_shell_s_completions_name_every_command() {
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let script = printed(&["completions", shell]);
        for command in commands() {
            assert!(script.contains(&command), "{shell} lacks {command}");
        }
        assert!(script.contains("false-alarm-every"), "{shell} lacks an option");
    }
    assert_eq!(drift(&["completions", "cmd"]).status.code(), Some(2));
}

#[test]
fn shells_that_are_here_accept_their_completions() {
    for (shell, check) in [("bash", "-n"), ("zsh", "-n"), ("fish", "--no-execute")] {
        if let Some(output) = fed(shell, &[check], &printed(&["completions", shell])) {
            assert!(output.status.success(), "{shell}: {}", String::from_utf8_lossy(&output.stderr));
        }
    }
}

#[test]
fn manual_pages_format_without_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("man1");
    printed(&["man", "--out", path.to_str().unwrap()]);
    let mut pages = vec!["drift.1".to_string()];
    pages.extend(commands().iter().map(|command| format!("drift-{command}.1")));
    for page in &pages {
        let text = std::fs::read_to_string(path.join(page)).unwrap();
        assert!(text.contains("\n.TH DRIFT") && text.contains(".SH SYNOPSIS"), "{page}");
        if let Some(output) = fed("groff", &["-man", "-ww", "-Tascii"], &text) {
            assert!(output.status.success() && output.stderr.is_empty(), "{page}: {output:?}");
            assert!(output.stdout.len() > 500, "{page} is empty");
        }
    }
    assert_eq!(std::fs::read_dir(&path).unwrap().count(), pages.len());
    let monitor = printed(&["man", "monitor"]);
    assert_eq!(monitor, std::fs::read_to_string(path.join("drift-monitor.1")).unwrap());
    let unknown = drift(&["man", "rust"]);
    let message = String::from_utf8(unknown.stderr).unwrap();
    assert!(unknown.status.code() == Some(1) && message.contains("monitor") && message.lines().count() == 1);
}

/// Colour is forced here as no terminal is: what is left of it must go.
#[test]
fn no_color_is_honoured() {
    let help = |no_color: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_drift"));
        command.arg("--help").env("CLICOLOR_FORCE", "1").env("NO_COLOR", no_color);
        String::from_utf8(command.output().unwrap().stdout).unwrap()
    };
    assert!(help("").contains('\u{1b}'));
    assert!(!help("1").contains('\u{1b}'));
}

/// The demo prints the summary with its small chart: blocks in a UTF-8 locale, plain signs elsewhere, no colour and
/// no progress in a pipe.
#[test]
fn charts_on_the_terminal_follow_the_locale() {
    let folder = tempfile::tempdir().unwrap();
    for (locale, utf8) in [("C.UTF-8", true), ("C", false)] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_drift"));
        let output =
            command.args(["demo", "--out"]).arg(folder.path()).env("LC_ALL", locale).output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
        let text = String::from_utf8(output.stdout).unwrap();
        let effort = text.lines().rfind(|line| line.starts_with("  effort ")).unwrap();
        assert_eq!(effort.contains('▁'), utf8, "{effort}");
        assert_eq!(effort.is_ascii(), !utf8, "{effort}");
        assert!(!text.contains('\u{1b}') && text.lines().count() <= 40, "more than a screen");
    }
}

/// Lines that are wider than a terminal of 80 columns.
fn wide(text: &str) -> Vec<&str> {
    text.lines().filter(|line| line.chars().count() > 80).collect()
}

/// What `drift` prints where the environment says that there are 80 columns, run in a folder.
fn printed_at_80(folder: &std::path::Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_drift"));
    let output = command.args(arguments).current_dir(folder).env("COLUMNS", "80").output().unwrap();
    let [out, told] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(output.status.success(), "{arguments:?}: {told}");
    out + &told
}

#[test]
fn help_fits_a_terminal_of_80_columns() {
    let here = std::path::Path::new(".");
    for help in ["-h", "--help"] {
        let text = printed_at_80(here, &[help]);
        assert!(wide(&text).is_empty(), "drift {help}: {:?}", wide(&text));
        for command in commands().iter().filter(|name| *name != "fleet") {
            let text = printed_at_80(here, &[command, help]);
            // What is shown to be copied stays on one line.
            let lines: Vec<&str> =
                wide(&text).into_iter().filter(|line| !line.trim().starts_with("drift ")).collect();
            assert!(lines.is_empty(), "drift {command} {help}: {lines:?}");
        }
    }
}

#[test]
fn demo_and_init_fit_a_terminal_of_80_columns() {
    let folder = tempfile::tempdir().unwrap();
    let text = printed_at_80(folder.path(), &["demo"]);
    assert!(wide(&text).is_empty(), "{:?}", wide(&text));
    assert!(text.starts_with("An oven under PI control."), "{text}");
    // A loop whose law and plant nothing tells: the longest reasons.
    let rows: String =
        (0..400).map(|i| format!("{i},{},{}\n", (i * 37 % 101) as f64, (i * 53 % 89) as f64)).collect();
    std::fs::write(folder.path().join("noise.csv"), "t,y,u\n".to_owned() + &rows).unwrap();
    let text = printed_at_80(folder.path(), &["init", "noise.csv"]);
    assert!(wide(&text).is_empty(), "{:?}", wide(&text));
    let text = printed_at_80(folder.path(), &["init", "noise.csv", "-o", "loop.toml"]);
    assert!(wide(&text).is_empty(), "{:?}", wide(&text));
    let file = std::fs::read_to_string(folder.path().join("loop.toml")).unwrap();
    assert!(wide(&file).is_empty() && file.contains("# State the plant here"), "{file}");
    assert!(drift_sim::control_loop::Loop::parse(&file, "loop.toml").is_ok(), "{file}");
}
