//! A cluster's answers against those of one process: the same bytes, also where an executor is killed while the query runs. Real processes, on 127.0.0.1.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::expect_used, dead_code)]

#[path = "../../tests/made_loops/mod.rs"]
mod made_loops;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use clap::Parser;
use datafusion::arrow::util::pretty::pretty_format_batches;
use datafusion::prelude::SessionContext;
use drift_fleet::baselines;
use drift_fleet::commands::{calibrate, monitor};
use drift_fleet::samples::Source;
use drift_fleet::session::{Engine, session};
use drift_fleet_cluster::client;
use made_loops::run;

/// More than the rows that a loop holds until they show its sampling.
const SAMPLES: usize = 13_000;
const LOOPS: usize = 8;
/// Nothing here takes longer, unless it hangs.
const PATIENCE: Duration = Duration::from_secs(300);

#[derive(Parser)]
struct Calibrate {
    #[command(flatten)]
    arguments: calibrate::Arguments,
}

#[derive(Parser)]
struct Monitor {
    #[command(flatten)]
    arguments: monitor::Arguments,
}

/// A plant: rows of eight loops by turns, one of them without a baseline, one whose time goes back.
struct Plant {
    folder: tempfile::TempDir,
}

impl Plant {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let plant = Self { folder };
        let healthy = plant.path("healthy.parquet");
        made_loops::write_parquet(&healthy, &mut (0..LOOPS).map(|n| run(n, SAMPLES, true)), 500);
        let later = |n: usize| {
            let mut made = run(n, SAMPLES, false);
            if n == 2 {
                made.t[11_000] = made.t[100];
            }
            made
        };
        made_loops::write_parquet(&plant.path("later.parquet"), &mut (0..LOOPS).map(later), 500);
        let learnt = plant.path("baselines");
        let words =
            ["calibrate", "--loop-column", "tag", "--window", "100", "--false-alarm-every", "24", "-o"];
        let words =
            words.iter().map(Into::into).chain([learnt.clone().into_os_string(), healthy.into_os_string()]);
        let asked = Calibrate::parse_from(words);
        calibrate::run(&asked.arguments).await.unwrap();
        std::fs::remove_file(baselines::path(&learnt, &made_loops::tag(1))).unwrap();
        plant
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The words of `monitor`: eight parts, so that each executor gets several.
    fn monitor(&self, json: &Path) -> Vec<String> {
        let path = |path: &Path| path.to_string_lossy().into_owned();
        let data = path(&self.path("later.parquet"));
        let words = ["monitor", &data, "--loop-column", "tag", "--threads", "8", "--baselines"];
        let mut words: Vec<String> = words.map(str::to_owned).into();
        words.extend([path(&self.path("baselines")), "--json".into(), path(json)]);
        words
    }

    /// What one process says.
    async fn alone(&self) -> String {
        let json = self.path("alone.jsonl");
        monitor::run(&Monitor::parse_from(self.monitor(&json)).arguments).await.unwrap();
        let lines = std::fs::read_to_string(json).unwrap();
        assert_eq!(lines.lines().count(), LOOPS);
        for status in ["drift", "error", "no_baseline"] {
            assert!(lines.contains(&format!("\"status\":\"{status}\"")), "some loop is {status}: {lines}");
        }
        lines
    }

    /// `monitor` on the cluster, as a process.
    fn on(&self, cluster: &Cluster, json: &Path) -> Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_drift-fleet-cluster"));
        command.args(self.monitor(json)).args(["--scheduler", &cluster.address]);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    }
}

/// `drift-fleet-cluster start`.
struct Cluster {
    starter: Child,
    address: String,
    /// Process numbers.
    executors: Vec<String>,
    /// What it says later.
    said: Receiver<String>,
    /// Where the executors keep what they hand over.
    folder: tempfile::TempDir,
}

impl Cluster {
    fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_drift-fleet-cluster"));
        command.args(["start", "--port", "0"]).env("TMPDIR", folder.path());
        let mut starter = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(starter.stdout.take().unwrap()).lines();
        let mut after = |what: &str| {
            let line = lines.next().unwrap().unwrap();
            line.strip_prefix(what).unwrap_or_else(|| panic!("{line}")).to_owned()
        };
        let address = after("scheduler: ");
        assert!(address.starts_with("127.0.0.1:"), "{address}");
        let executors = vec![after("executor 1: process "), after("executor 2: process ")];
        let (say, said) = channel();
        std::thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| say.send(line)));
        Self { starter, address, executors, said, folder }
    }

    /// The stages of which the executor `number` keeps results.
    fn stages_of(&self, number: usize) -> Vec<String> {
        let within = |path: &Path| -> Vec<PathBuf> {
            std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
        };
        let own = format!("executor_{number}");
        let jobs = within(self.folder.path()).into_iter().flat_map(|starter| within(&starter.join(&own)));
        let stages = jobs.flat_map(|job| within(&job)).filter(|stage| !within(stage).is_empty());
        stages.map(|stage| stage.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let _ = Command::new("kill").arg(self.starter.id().to_string()).status();
        let _ = self.starter.wait();
    }
}

/// Asks until there is an answer.
fn wait_for<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(began.elapsed() < PATIENCE, "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Its lines, and what it said where it failed. Two loops are not judged: exit code 1.
fn finished(mut query: Child, json: &Path) -> String {
    let status = wait_for("the query ends", || query.try_wait().unwrap());
    let mut said = String::new();
    std::io::Read::read_to_string(&mut query.stderr.take().unwrap(), &mut said).unwrap();
    assert_eq!(status.code(), Some(1), "{said}");
    assert!(said.contains("not judged"), "{said}");
    std::fs::read_to_string(json).unwrap()
}

async fn table(session: &SessionContext, plant: &Plant, sql: &str) -> String {
    let source =
        Source { paths: vec![plant.path("later.parquet")], loop_column: "tag".into(), ..Source::default() };
    source.register(session).await.unwrap();
    let rows = session.sql(sql).await.unwrap().collect().await.unwrap();
    session.deregister_table("samples").unwrap();
    pretty_format_batches(&rows).unwrap().to_string()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_clusters_answers_are_those_of_one_process_to_the_byte() {
    let plant = Plant::new().await;
    let cluster = Cluster::start();
    let json = plant.path("cluster.jsonl");
    assert_eq!(finished(plant.on(&cluster, &json), &json), plant.alone().await);
    for number in [1, 2] {
        assert!(!cluster.stages_of(number).is_empty(), "executor {number} had a part");
    }

    let engine = Engine { threads: 4, ..Engine::default() };
    let here = session(&engine, None).unwrap();
    let there = client::session(&cluster.address, &engine).await.unwrap();
    let folder = drift_fleet::samples::literal(&plant.path("baselines").to_string_lossy());
    for sql in [
        "SELECT loop, drift_block(t, r, y, u)['samples'] AS n, drift_block(t, r, y, u)['greatest_u'] AS u FROM samples GROUP BY loop ORDER BY loop",
        "SELECT loop, drift_stretches(loop, t, r, y, u ORDER BY t) AS found FROM samples WHERE loop <> 'FIC-00002' GROUP BY loop ORDER BY loop",
        &format!(
            "SELECT status, count(*) FROM (SELECT loop, drift_verdict({folder}, loop, t, r, y, u ORDER BY t)['status'] AS status FROM samples GROUP BY loop) GROUP BY status ORDER BY status"
        ),
    ] {
        assert_eq!(table(&there, &plant, sql).await, table(&here, &plant, sql).await, "{sql}");
    }
}

/// Kills an executor once it has results of so many stages, and holds what the query says against one process.
async fn survives_a_death(stages: usize) {
    let plant = Plant::new().await;
    let expected = plant.alone().await;
    let cluster = Cluster::start();
    let json = plant.path("cluster.jsonl");
    let mut query = plant.on(&cluster, &json);
    wait_for("the second executor has results", || (cluster.stages_of(2).len() >= stages).then_some(()));
    assert!(Command::new("kill").args(["-9", &cluster.executors[1]]).status().unwrap().success());
    assert!(query.try_wait().unwrap().is_none(), "the query was over before the executor was killed");
    assert_eq!(finished(query, &json), expected);
    let said = wait_for("the death is told", || cluster.said.try_recv().ok());
    assert!(said.starts_with("executor 2: ended"), "{said}");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_executor_killed_with_rows_that_others_wait_for_costs_no_loop() {
    survives_a_death(1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_executor_killed_with_verdicts_in_its_hands_costs_no_loop() {
    survives_a_death(2).await;
}

#[test]
fn what_a_cluster_cannot_do_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rows.csv");
    std::fs::write(&file, "tag,t,SP,PV,OP\nA,0,1,1,1\nA,1,1,1,1\n").unwrap();
    // Bound and given back: nobody listens there.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    for (asked, answer) in [
        ("sql rows.csv --query 1", "no scheduler at 127.0.0.1:"),
        (
            "sql rows.csv --query 1 --sorted",
            "--sorted takes the rows in their order, by one executor; without it",
        ),
        (
            "monitor rows.csv --baselines . --report x.html --reports all",
            "--reports all: executors write no pages",
        ),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_drift-fleet-cluster"));
        command.current_dir(&folder).args(asked.split(' ')).args(["--loop-column", "tag", "--scheduler"]);
        let said = command.arg(format!("127.0.0.1:{port}")).output().unwrap();
        assert_eq!(said.status.code(), Some(1));
        let said = String::from_utf8(said.stderr).unwrap();
        assert!(said.starts_with(&format!("error: {answer}")) && said.lines().count() == 1, "{said}");
    }
    // A port that is taken.
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let mut command = Command::new(env!("CARGO_BIN_EXE_drift-fleet-cluster"));
    let said = command.args(["start", "--port", &port]).output().unwrap();
    assert_eq!(said.status.code(), Some(1));
    let said = String::from_utf8(said.stderr).unwrap();
    assert!(
        said.starts_with(&format!("error: port {port} of 127.0.0.1: ")) && said.lines().count() == 1,
        "{said}"
    );
}
