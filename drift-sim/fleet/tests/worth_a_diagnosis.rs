//! `scan --diagnose` hands to `drift diagnose` the samples of the stretch that it names: whatever the unit of the data's time, and of a closed loop.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::expect_used, dead_code)]

mod made_loops;

use std::fmt::Write;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

use made_loops::run;

const SAMPLES: usize = 12_000;

#[test]
fn a_stretch_is_written_as_the_scan_has_read_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = run(0, SAMPLES, false);
    let sample_time_s = made.t[1];
    // A third of it by hand, and moved far more: clearer, but no law acts there.
    let by_hand = |n: usize| (4_000..8_000).contains(&n);
    let u = |n: usize| made.u[n] + if by_hand(n) { 40.0 * ((n / 100) % 2) as f64 } else { 0.0 };
    let y = |n: usize| if by_hand(n) { u(n - 1) } else { made.y[n] };
    let mut rows = String::from("tag,time_ms,SP,PV,OP,MODE\n");
    for n in 0..SAMPLES {
        let mode = if by_hand(n) { "MAN" } else { "AUTO" };
        writeln!(rows, "a'b,{},{},{},{},{mode}", made.t[n] * 1e3, made.r[n], y(n), u(n)).unwrap();
    }
    std::fs::write(folder.join("rows.csv"), rows).unwrap();
    // In place of the command, which is another program.
    let drift = folder.join("drift");
    std::fs::write(&drift, "#!/bin/sh\necho looked at \"$2\"\n").unwrap();
    std::fs::set_permissions(&drift, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_drift-fleet"));
    command.current_dir(folder).env("PATH", folder);
    let words = "scan rows.csv --loop-column tag --json found.jsonl --diagnose 1 --folder worth";
    let done = command.args(words.split(' ')).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));

    let found = std::fs::read_to_string(folder.join("found.jsonl")).unwrap();
    let found: Vec<serde_json::Value> =
        found.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let seconds = |line: &serde_json::Value, name: &str| line[name].as_f64().unwrap();
    let excited: Vec<_> = found.iter().filter(|line| line["kind"] == "excitation").collect();
    let begins = |line: &serde_json::Value| (seconds(line, "from_s") / sample_time_s).round() as usize;
    assert!(excited.iter().any(|line| by_hand(begins(line))), "{excited:?}");
    let closed = excited.into_iter().filter(|line| !by_hand(begins(line)));
    let clearest = closed.max_by(|a, b| seconds(a, "score").total_cmp(&seconds(b, "score")));
    let clearest = clearest.expect("an excited stretch");
    let at = |name: &str| (seconds(clearest, name) / sample_time_s).round() as usize;
    let (from, to) = (at("from_s"), at("to_s"));
    assert!(to - from > 1000, "{clearest}");

    let mut written = std::fs::read_to_string(folder.join("worth/a%27b.csv")).unwrap();
    assert!(written.starts_with("t,r,y,u\n"), "{}", written.lines().next().unwrap());
    let rows: Vec<Vec<f64>> = written
        .split_off("t,r,y,u\n".len())
        .lines()
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), to - from + 1);
    for (n, row) in (from..).zip(&rows) {
        assert!((row[0] - made.t[n]).abs() < 1e-6 * sample_time_s, "{row:?}");
        assert_eq!(row[1..], [made.r[n], made.y[n], made.u[n]]);
    }
}
