//! A fleet's verdict on a loop against `drift monitor`'s on the same samples: the same bytes, whether the rows come sorted, by turns, from
//! Parquet or CSV, from partitioned folders, with one thread or several.
#![allow(clippy::unwrap_used, clippy::expect_used, dead_code)]

mod made_loops;

use std::path::{Path, PathBuf};
use std::process::Command;

use drift_fleet::commands::monitor::{sql, verdicts};
use drift_fleet::samples::Source;
use drift_fleet::session::{Engine, session};
use drift_fleet::verdict::Verdict;
use drift_fleet::{baselines, session};
use drift_sim::baseline_file::BaselineFile;
use drift_sim::monitor::{Outputs, watch};
use drift_sim::recording::{ReadOptions, RecordingStream};
use made_loops::{Run, run};

/// More than the rows that a loop holds until they show its sampling.
const SAMPLES: usize = 13_000;

/// The baselines of some loops, by the fleet's own command over their healthy rows.
fn calibrate(folder: &Path, loops: usize) -> PathBuf {
    let healthy = folder.join("healthy.parquet");
    made_loops::write_parquet(&healthy, &mut (0..loops).map(|n| run(n, SAMPLES, true)), 500);
    let out = folder.join("baselines");
    let fleet = env!("CARGO_BIN_EXE_drift-fleet");
    let arguments =
        ["calibrate", "--loop-column", "tag", "--window", "100", "--false-alarm-every", "24", "-o"];
    let done = Command::new(fleet).args(arguments).arg(&out).arg(&healthy).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    out
}

/// The last line of `drift monitor --json` on a CSV file of the loop: the very functions that the command calls.
fn monitored(folder: &Path, baselines: &Path, made: &Run) -> String {
    let file = folder.join(&made.tag);
    made_loops::write_csv(&file, made);
    // The recording's name is in the line: the loop's.
    let here = std::fs::File::open(&file).unwrap();
    let mut stream = RecordingStream::from_reader(&made.tag, here, &ReadOptions::default()).unwrap();
    let baseline = BaselineFile::read(&baselines::path(baselines, &made.tag)).unwrap();
    let mut lines = Vec::new();
    let outputs = Outputs { json: Some(&mut lines), ..Outputs::default() };
    watch(&mut stream, &baseline.config().unwrap(), outputs).unwrap();
    String::from_utf8(lines).unwrap().lines().last().unwrap().to_owned()
}

async fn fleet(
    paths: Vec<PathBuf>,
    baselines: &Path,
    engine: &Engine,
    is_sorted: bool,
) -> Vec<(String, Verdict)> {
    let session = session(engine, None).unwrap();
    let source = Source { paths, loop_column: "tag".into(), is_sorted, ..Source::default() };
    let found = source.register(&session).await.unwrap();
    let mut loops = verdicts(&session, &sql(baselines, &found)).await.unwrap();
    loops.sort_by(|a, b| a.0.cmp(&b.0));
    loops
}

#[tokio::test]
async fn a_fleets_verdict_is_the_monitors_to_the_byte() {
    const LOOPS: usize = 5;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let baselines = calibrate(folder, LOOPS);
    let expected: Vec<String> =
        (0..LOOPS).map(|n| monitored(folder, &baselines, &run(n, SAMPLES, false))).collect();
    assert!(expected.iter().any(|line| line.contains("\"verdict\":\"drift\"")), "some loop drifts");

    let runs = || (0..LOOPS).map(|n| run(n, SAMPLES, false));
    let one_after_the_other = folder.join("sorted.parquet");
    made_loops::write_parquet(&one_after_the_other, &mut runs(), 0);
    let by_turns = folder.join("by_turns.parquet");
    made_loops::write_parquet(&by_turns, &mut runs(), 700);
    let lake = folder.join("lake");
    for made in runs() {
        let of_loop = lake.join(format!("tag={}", made.tag));
        std::fs::create_dir_all(&of_loop).unwrap();
        made_loops::write_unnamed(&of_loop.join("part.parquet"), &made);
    }
    let csv = folder.join("csv");
    for made in runs() {
        let of_loop = csv.join(format!("tag={}", made.tag));
        std::fs::create_dir_all(&of_loop).unwrap();
        made_loops::write_csv(&of_loop.join("part.csv"), &made);
    }
    let two = Engine { threads: 2, ..Engine::default() };
    let one = Engine { threads: 1, ..Engine::default() };
    // So little that the sorts go to the disk.
    let tight = Engine { memory_limit_bytes: 24 << 20, ..two.clone() };
    for (path, engine, is_sorted) in [
        (&one_after_the_other, &one, true),
        (&one_after_the_other, &two, false),
        (&by_turns, &two, false),
        (&by_turns, &one, false),
        (&by_turns, &tight, false),
        (&lake, &two, false),
        (&csv, &two, false),
    ] {
        let loops = fleet(vec![path.clone()], &baselines, engine, is_sorted).await;
        assert_eq!(loops.len(), LOOPS, "{}", path.display());
        for ((name, verdict), line) in loops.iter().zip(&expected) {
            assert_eq!(
                verdict.summary.as_deref(),
                Some(line.as_str()),
                "{name} of {}: {}",
                path.display(),
                verdict.answer
            );
        }
    }
}

#[tokio::test]
async fn a_loop_that_cannot_be_judged_says_why_and_the_others_are_judged() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let baselines = calibrate(folder, 3);
    std::fs::remove_file(baselines::path(&baselines, &made_loops::tag(1))).unwrap();
    let data = folder.join("later.parquet");
    let broken = |n: usize| {
        let mut made = run(n, SAMPLES, false);
        if n == 2 {
            made.t[11_000] = made.t[100];
        }
        made
    };
    made_loops::write_parquet(&data, &mut (0..3).map(broken), 0);
    let loops = fleet(vec![data], &baselines, &Engine { threads: 1, ..Engine::default() }, true).await;
    let status: Vec<&str> = loops.iter().map(|(_, verdict)| verdict.status.as_str()).collect();
    assert_eq!(status[1..], ["no_baseline", "error"]);
    assert!(loops[0].1.summary.is_some());
    let (_, refused) = &loops[2];
    assert_eq!(
        refused.answer,
        "FIC-00002:11001: time goes back from ".to_owned()
            + refused.answer.split("back from ").nth(1).unwrap()
    );
}

/// How often two halves are asked for: of some eight times one is whole by chance.
const ASKED: usize = 20;

/// The other way to the same samples: a session without the rule that keeps loops whole.
#[tokio::test]
async fn two_halves_of_a_loop_are_refused_and_not_judged() {
    use datafusion::logical_expr::AggregateUDF;
    use datafusion::prelude::{SessionConfig, SessionContext};
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let baselines = calibrate(folder, 1);
    let (first, second) = (folder.join("a.parquet"), folder.join("b.parquet"));
    let half = |from: usize| {
        let all = run(0, SAMPLES, false);
        let part = |x: &[f64]| x[from..from + SAMPLES / 2].to_vec();
        Run { tag: all.tag.clone(), t: part(&all.t), r: part(&all.r), y: part(&all.y), u: part(&all.u) }
    };
    made_loops::write_parquet(&first, &mut std::iter::once(half(0)), 0);
    made_loops::write_parquet(&second, &mut std::iter::once(half(SAMPLES / 2)), 0);
    let plain = SessionContext::new_with_config(SessionConfig::new().with_target_partitions(2));
    plain.register_udaf(AggregateUDF::from(drift_fleet::verdict_function::DriftVerdict::new()));
    let source = Source { paths: vec![first, second], loop_column: "tag".into(), ..Source::default() };
    let found = source.register(&plain).await.unwrap();
    // The engine may hand both files to one of its threads: then the loop is whole, and judged as a whole.
    let mut refused = 0;
    for _ in 0..ASKED {
        match verdicts(&plain, &sql(&baselines, &found)).await {
            Ok(loops) => assert_eq!(loops[0].1.samples, SAMPLES as i64),
            Err(error) => {
                assert!(error.to_string().contains("met one loop in two partitions"), "{error}");
                refused += 1;
            }
        }
    }
    assert!(refused > 0);
    // With the rule the same halves are one loop.
    let whole = session::session(&Engine { threads: 2, ..Engine::default() }, None).unwrap();
    let found = source.register(&whole).await.unwrap();
    let loops = verdicts(&whole, &sql(&baselines, &found)).await.unwrap();
    assert_eq!(
        loops[0].1.summary.as_deref(),
        Some(monitored(folder, &baselines, &run(0, SAMPLES, false)).as_str())
    );
}

/// The same against the command itself, on 100 loops. `DRIFT` is its path.
#[tokio::test]
#[ignore = "needs the command drift; .ci/fleet runs it"]
async fn a_hundred_loops_are_the_commands_to_the_byte() {
    const LOOPS: usize = 100;
    let drift = std::env::var("DRIFT").expect("DRIFT is the path of the command");
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let baselines = calibrate(folder, LOOPS);
    let data = folder.join("later.parquet");
    made_loops::write_parquet(&data, &mut (0..LOOPS).map(|n| run(n, SAMPLES, false)), 500);
    let loops = fleet(vec![data], &baselines, &Engine { threads: 2, ..Engine::default() }, false).await;
    assert_eq!(loops.len(), LOOPS);
    for (n, (name, verdict)) in loops.iter().enumerate() {
        let made = run(n, SAMPLES, false);
        made_loops::write_csv(&folder.join(&made.tag), &made);
        let baseline = baselines::path(&baselines, name);
        let mut command = Command::new(&drift);
        command.current_dir(folder).args(["monitor", name, "--json", "-", "--baseline"]).arg(baseline);
        let said = command.output().unwrap();
        assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
        let lines = String::from_utf8(said.stdout).unwrap();
        assert_eq!(verdict.summary.as_deref(), lines.lines().last(), "{name}");
    }
}
