//! `drift fleet monitor`: every loop's verdict, ranked by what it costs.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use datafusion::arrow::array::{ArrayRef, AsArray};
use datafusion::error::DataFusionError;
use datafusion::prelude::SessionContext;
use drift_sim::{Error, Result, output, report};

use super::reading::Reading;
use crate::loop_run::Reports;
use crate::samples::{Found, literal};
use crate::verdict::{STATUSES, Verdict};
use crate::{from_engine, page, session, table_file, verdict_function};

/// Runs the monitor over every loop: a verdict each, ranked by how severe it is and what it costs.
///
/// Exit code 3 where --fail-on's level is reached by a loop, 1 where a loop could not be judged; the others are judged all the same.
#[derive(Args, Debug, Clone)]
#[command(after_help = "\
Examples:
  drift fleet monitor lake/ --loop-column tag --baselines baselines/ --report plant.html
  drift fleet monitor week.parquet --loop-column tag --baselines baselines/ --json loops.jsonl --parquet loops.parquet")]
pub struct Arguments {
    #[command(flatten)]
    /// Where the data lie and how they are read.
    pub reading: Reading,
    /// The folder of the loops' baselines, from `drift fleet calibrate`
    #[arg(long, value_name = "FOLDER")]
    baselines: PathBuf,
    /// One line of JSON a loop, in the order of the page; - is standard output
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// The same as a Parquet file
    #[arg(long, value_name = "FILE")]
    parquet: Option<PathBuf>,
    /// The plant on one page: one HTML file, one line a loop
    #[arg(long, value_name = "OUT.html")]
    report: Option<PathBuf>,
    /// Which loops get a page of their own, in a folder beside the report
    #[arg(long, value_enum, default_value_t = Which::Away, requires = "report")]
    reports: Which,
    /// Exit with code 3 where a loop drifts, is suspect, or had a disturbance at least
    #[arg(long, value_enum, value_name = "LEVEL")]
    fail_on: Option<Level>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Which {
    /// All of them
    All,
    /// Those that left their baseline
    Away,
    /// None
    None,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Level {
    Disturbance,
    Suspect,
    Drift,
}

impl Level {
    fn name(self) -> &'static str {
        match self {
            Self::Disturbance => "disturbance",
            Self::Suspect => "suspect",
            Self::Drift => "drift",
        }
    }
}

/// The query, as anyone could write it.
pub fn sql(baselines: &Path, found: &Found) -> String {
    format!(
        "SELECT loop, {}({}, loop, t, r, y, u{} ORDER BY t) AS verdict FROM samples GROUP BY loop",
        verdict_function::NAME,
        literal(&baselines.to_string_lossy()),
        found.further_arguments()
    )
}

impl Arguments {
    /// The pages of single loops, where they are asked for.
    pub fn reports(&self) -> Option<Reports> {
        let page = self.report.as_deref().filter(|_| self.reports != Which::None)?;
        let folder = page::reports_folder(page);
        let command = report::command_line(std::env::args_os());
        Some(Reports { folder, all: self.reports == Which::All, command })
    }

    /// Runs the command on a session that knows drift's functions.
    ///
    /// # Errors
    /// The data can't be read, the query fails, an output can't be written.
    pub async fn run_on(&self, session: &SessionContext, reports: Option<&Reports>) -> Result<ExitCode> {
        let named = [
            ("--json", self.json.as_deref()),
            ("--parquet", self.parquet.as_deref()),
            ("--report", self.report.as_deref()),
        ];
        let mut files = self.reading.outputs(&named)?;
        let found = self.reading.source().register(session).await?;
        // The query stands in pages and plans, where a path that depends on the folder says little.
        let baselines = std::path::absolute(&self.baselines)
            .map_err(|e| Error::of_file("can't be read", &e).in_file(&self.baselines))?;
        if !baselines.is_dir() {
            return Err(Error::new("no folder of baselines")
                .allowed("the folder of `drift fleet calibrate`")
                .in_file(&self.baselines));
        }
        let mut loops = verdicts(session, &sql(&baselines, &found)).await?;
        if loops.is_empty() {
            return Err(self.reading.no_rows());
        }
        rank(&mut loops);
        if let Some(path) = &self.json {
            files.write_with(path, |out| {
                loops.iter().try_for_each(|(name, verdict)| write_line(out, name, verdict))
            })?;
        }
        if let Some(path) = &self.parquet {
            let bytes = table_file::verdicts(&loops)?;
            files.write_with(path, |out| out.write_all(&bytes))?;
        }
        if let Some(path) = &self.report {
            let command = report::command_line(std::env::args_os());
            files.write_text(path, &page::html(&loops, path, reports, &command))?;
        }
        files.commit()?;
        if named.iter().all(|(_, path)| *path != Some(Path::new("-"))) {
            output::write_text(Path::new("-"), &page::screen(&loops))?;
        }
        let judged = super::all_judged(loops.iter().filter_map(|(name, verdict)| {
            let is_missing = matches!(verdict.status.as_str(), "error" | "no_baseline");
            is_missing.then(|| format!("{name}: {}", verdict.answer))
        }));
        let reached = self.fail_on.is_some_and(|level| {
            let at_least = STATUSES.iter().position(|status| *status == level.name());
            loops.iter().any(|(_, verdict)| Some(verdict.severity()) <= at_least)
        });
        Ok(if reached { ExitCode::from(3) } else { judged })
    }
}

/// Runs the command within this process.
///
/// # Errors
/// As [`Arguments::run_on`].
pub async fn run(arguments: &Arguments) -> Result<ExitCode> {
    let reports = arguments.reports();
    let session =
        session::session(&arguments.reading.engine(), reports.clone()).map_err(|e| from_engine(&e))?;
    arguments.run_on(&session, reports.as_ref()).await
}

/// The loops and verdicts of a query whose columns they are.
///
/// # Errors
/// The query fails or has other columns.
pub async fn verdicts(session: &SessionContext, sql: &str) -> Result<Vec<(String, Verdict)>> {
    let verdict = |column: &ArrayRef, row: usize| {
        let verdicts = column
            .as_struct_opt()
            .ok_or_else(|| DataFusionError::Plan("the query's second column is no verdict".into()))?;
        Verdict::from_row(verdicts, row).map(Some)
    };
    super::by_loop(session, sql, verdict).await
}

/// The most severe first; among those the most costly, then the farthest, then by name.
pub fn rank(loops: &mut [(String, Verdict)]) {
    loops.sort_by(|(a, x), (b, y)| {
        let farther = y.max_z.unwrap_or(0.0).total_cmp(&x.max_z.unwrap_or(0.0));
        x.severity().cmp(&y.severity()).then(y.cost().total_cmp(&x.cost())).then(farther).then(a.cmp(b))
    });
}

/// One loop's line: what the page shows of it, and under `monitor` the very last line of `drift monitor --json` on its samples.
fn write_line(out: &mut dyn Write, name: &str, verdict: &Verdict) -> std::io::Result<()> {
    let [error, effort, energy] = verdict.costs;
    let head = serde_json::json!({
        "loop": name,
        "status": verdict.status,
        "since_s": verdict.since_s,
        "channel": verdict.channel,
        "side": verdict.side,
        "max_z": verdict.max_z,
        "events": verdict.events,
        "samples": verdict.samples,
        "hours": verdict.hours,
        "cost_percent": {"error": error, "effort": effort, "energy": energy},
        "answer": verdict.answer,
    });
    let head = head.to_string();
    let open = head.strip_suffix('}').unwrap_or(&head);
    writeln!(out, "{open},\"monitor\":{}}}", verdict.summary.as_deref().unwrap_or("null"))
}
