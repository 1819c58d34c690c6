//! `drift fleet scan`: of every loop the stretches that are worth a diagnosis.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::Args;
use datafusion::arrow::array::{Array, ArrayRef, AsArray};
use datafusion::error::DataFusionError;
use datafusion::prelude::SessionContext;
use drift_sim::recording::write_csv;
use drift_sim::{Error, Result, output};
use futures::StreamExt;

use super::reading::Reading;
use crate::loop_rows::LoopRows;
use crate::samples::{self, literal};
use crate::scan::{Found, NAME};
use crate::stretches::Kind;
use crate::{baselines, from_engine, session};

/// Finds the stretches that are worth a diagnosis: excitation, by hand, at a limit, in oscillation, and changes.
#[derive(Args, Debug, Clone)]
#[command(after_help = "\
Examples:
  drift fleet scan lake/ --loop-column tag --json stretches.jsonl
  drift fleet scan lake/ --loop-column tag --diagnose 5 --folder worth/")]
pub struct Arguments {
    #[command(flatten)]
    reading: Reading,
    /// One line of JSON a stretch; - is standard output
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write this many of the clearest excited stretches of closed loops as CSV, each of another loop, and run `drift diagnose` on them
    #[arg(long, value_name = "N", requires = "folder")]
    diagnose: Option<u16>,
    /// Where the stretches and their reports go
    #[arg(long, value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// The data can't be read, the query fails, an output can't be written.
pub async fn run(arguments: &Arguments) -> Result<ExitCode> {
    let named = [("--json", arguments.json.as_deref())];
    let mut files = arguments.reading.outputs(&named)?;
    let session = session::session(&arguments.reading.engine(), None).map_err(|e| from_engine(&e))?;
    let found = arguments.reading.source().register(&session).await?;
    let further = found.further_arguments();
    let sql = format!("SELECT loop, {NAME}(loop, t, r, y, u{further} ORDER BY t) FROM samples GROUP BY loop");
    let mut loops = stretches(&session, &sql).await?;
    if loops.is_empty() {
        return Err(arguments.reading.no_rows());
    }
    loops.sort_by(|a, b| a.0.cmp(&b.0));
    if let Some(path) = &arguments.json {
        files.write_with(path, |out| {
            loops
                .iter()
                .try_for_each(|(name, found)| found.iter().try_for_each(|one| write_line(out, name, one)))
        })?;
    }
    files.commit()?;
    if arguments.json.as_deref() != Some(Path::new("-")) {
        output::write_text(Path::new("-"), &screen(&loops))?;
    }
    if let (Some(count), Some(folder)) = (arguments.diagnose, &arguments.folder) {
        diagnose(&session, &found, &loops, usize::from(count), folder).await?;
    }
    Ok(super::all_judged(loops.iter().flat_map(|(_, found)| found.iter().filter_map(|one| one.what.clone()))))
}

async fn stretches(session: &SessionContext, sql: &str) -> Result<Vec<(String, Vec<Found>)>> {
    let found = |column: &ArrayRef, row: usize| {
        let lists = column.as_list_opt::<i32>();
        let lists = lists.ok_or_else(|| {
            DataFusionError::Plan("the query's second column is no list of stretches".into())
        })?;
        lists.is_valid(row).then(|| Found::of_list(&lists.value(row))).transpose()
    };
    super::by_loop(session, sql, found).await
}

fn write_line(out: &mut dyn Write, name: &str, found: &Found) -> std::io::Result<()> {
    let (from, to, score) = found.span.map_or((None, None, None), |(a, b, c)| (Some(a), Some(b), Some(c)));
    let line = serde_json::json!({"loop": name, "kind": found.kind, "from_s": from, "to_s": to, "score": score, "what": found.what});
    writeln!(out, "{line}")
}

/// How many stretches of each kind, and of how many loops.
fn screen(loops: &[(String, Vec<Found>)]) -> String {
    let mut text = format!("{} loops\n", loops.len());
    for kind in [Kind::Excitation, Kind::Manual, Kind::Saturation, Kind::Oscillation, Kind::Change] {
        let of = |found: &Vec<Found>| found.iter().filter(|one| one.kind == kind.name()).count();
        let stretches: usize = loops.iter().map(|(_, found)| of(found)).sum();
        let among = loops.iter().filter(|(_, found)| of(found) > 0).count();
        text += &format!("{:<12} {stretches:>7} in {among} loops\n", kind.name());
    }
    text
}

/// Writes the clearest excited stretches of closed loops, one a loop, and has `drift diagnose` look at each.
async fn diagnose(
    session: &SessionContext,
    columns: &samples::Found,
    loops: &[(String, Vec<Found>)],
    count: usize,
    folder: &Path,
) -> Result<()> {
    let clearest = |found: &Vec<Found>| {
        let of =
            |kind: Kind| found.iter().filter(move |one| one.kind == kind.name()).filter_map(|one| one.span);
        // By hand there is no law to diagnose.
        let is_closed =
            |one: &(f64, f64, f64)| of(Kind::Manual).all(|by_hand| one.1 < by_hand.0 || by_hand.1 < one.0);
        of(Kind::Excitation).filter(is_closed).max_by(|a, b| a.2.total_cmp(&b.2))
    };
    let mut chosen: Vec<(&str, (f64, f64, f64))> =
        loops.iter().filter_map(|(name, found)| Some((name.as_str(), clearest(found)?))).collect();
    chosen.sort_by(|a, b| b.1.2.total_cmp(&a.1.2).then(a.0.cmp(b.0)));
    chosen.truncate(count);
    std::fs::create_dir_all(folder).map_err(|e| Error::of_file("can't be made", &e).in_file(folder))?;
    for (name, (from_s, to_s, _)) in chosen {
        let file = folder.join(format!("{}.csv", baselines::file_stem(name)));
        let report = file.with_extension("html");
        write_stretch(session, columns, name, (from_s, to_s), &file).await?;
        let ran =
            Command::new(super::drift()).arg("diagnose").arg(&file).arg("--report").arg(&report).output();
        let ran = ran.map_err(|e| {
            Error::new(format!("`drift` can't be run: {e}")).allowed("drift beside drift-fleet or on PATH")
        })?;
        let said = if ran.status.success() { &ran.stdout } else { &ran.stderr };
        let said = String::from_utf8_lossy(said);
        println!(
            "{name}, {from_s} to {to_s} s: {}; {}",
            said.lines().next().unwrap_or_default(),
            report.display()
        );
    }
    Ok(())
}

/// Writes a stretch as the scan has read it, in seconds on the loop's clock.
async fn write_stretch(
    session: &SessionContext,
    columns: &samples::Found,
    name: &str,
    (from_s, to_s): (f64, f64),
    file: &Path,
) -> Result<()> {
    let further = columns.further_columns();
    let sql =
        format!("SELECT loop, t, r, y, u{further} FROM samples WHERE loop = {} ORDER BY t", literal(name));
    let query = session.sql(&sql).await.map_err(|e| from_engine(&e))?;
    let mut batches = query.execute_stream().await.map_err(|e| from_engine(&e))?;
    let mut rows: Option<LoopRows> = None;
    let mut stretch = Part::default();
    while let Some(batch) = batches.next().await {
        let batch = batch.map_err(|e| from_engine(&e))?;
        if batch.num_rows() == 0 {
            continue;
        }
        let rows = match &mut rows {
            Some(rows) => rows,
            none => none.insert(LoopRows::begin(batch.columns()).map_err(|e| from_engine(&e))?),
        };
        let piece = rows.piece(batch.columns()).map_err(|e| from_engine(&e))?;
        rows.fed.push(piece)?;
        stretch.take(rows, from_s, to_s)?;
    }
    if let Some(mut rows) = rows {
        rows.fed.finish()?;
        stretch.take(&mut rows, from_s, to_s)?;
    }
    stretch.write(file)
}

/// The samples of a stretch.
#[derive(Default)]
struct Part {
    t: Vec<f64>,
    r: Vec<f64>,
    y: Vec<f64>,
    u: Vec<f64>,
}

impl Part {
    /// Those of the rows so far that lie in it.
    fn take(&mut self, rows: &mut LoopRows, from_s: f64, to_s: f64) -> Result<()> {
        while let Some(sample) = rows.fed.next()? {
            if (from_s..=to_s).contains(&sample.t_s) {
                self.t.push(sample.t_s);
                self.r.push(sample.r);
                self.y.push(sample.y);
                self.u.push(sample.u);
            }
        }
        Ok(())
    }

    fn write(&self, file: &Path) -> Result<()> {
        write_csv(file, &[("t", &self.t), ("r", &self.r), ("y", &self.y), ("u", &self.u)])
    }
}
