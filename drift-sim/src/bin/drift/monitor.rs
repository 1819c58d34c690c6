//! `drift monitor`: runs drift-core's own monitor over a recording and says what it found.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use drift_core::Config;
use drift_sim::baseline_file::BaselineFile;
use drift_sim::monitor::{Chart, FailOn, Outputs, Stopped, Summary, page, screen, watch};
use drift_sim::output::Outputs as Files;
use drift_sim::recording::RecordingStream;
use drift_sim::terminal::Terminal;
use drift_sim::{Error, Result, output, report};

use crate::progress::Progress;
use crate::recording_arguments::{RecordingArguments, tell};

/// Runs the monitor over a recording: tells disturbances from drift, and where they are.
///
/// Exit code 3 where --fail-on's level is reached.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift monitor recording.csv --baseline baseline.toml --report page.html
  drift monitor recording.csv --baseline baseline.toml --plot run.svg --json decisions.jsonl
  drift monitor - --baseline baseline.toml --fail-on drift")]
pub struct Arguments {
    /// The recording, in any of the formats (CSV, gzip, .mat ...); - is standard input
    recording: PathBuf,
    /// What the healthy loop looks like, from `drift calibrate`
    #[arg(long, value_name = "BASELINE.toml")]
    baseline: PathBuf,
    /// The columns of the operating point where this recording names them otherwise than the baseline does, in its order
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    operating_point: Vec<String>,
    /// Write every decision as a line of JSON and the summary as the last; - is standard output, and nothing else is
    /// printed then
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draw the signals, the residuals and the events
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// A page for people: one HTML file that needs nothing else, with charts to zoom into
    #[arg(long, value_name = "OUT.html")]
    report: Option<PathBuf>,
    /// Exit with code 3 at any event (disturbance), at one that is still open or a drift (suspect), or at a drift only
    #[arg(long, value_enum, value_name = "LEVEL")]
    fail_on: Option<Level>,
    #[command(flatten)]
    reading: RecordingArguments,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Level {
    Disturbance,
    Suspect,
    Drift,
}

impl From<Level> for FailOn {
    fn from(level: Level) -> Self {
        match level {
            Level::Disturbance => Self::Disturbance,
            Level::Suspect => Self::Suspect,
            Level::Drift => Self::Drift,
        }
    }
}

pub fn run(arguments: Arguments) -> Result<ExitCode> {
    let named = [
        ("--json", arguments.json.as_deref()),
        ("--plot", arguments.plot.as_deref()),
        ("--report", arguments.report.as_deref()),
    ];
    let mut files = Files::checked(&named, &[&arguments.recording, &arguments.baseline])?;
    let to_standard = named.iter().any(|(_, path)| *path == Some(Path::new("-")));
    let baseline = BaselineFile::read(&arguments.baseline)?;
    let config = baseline.config().map_err(|e| e.in_file(&arguments.baseline))?;
    let point = baseline.point_columns(&arguments.operating_point)?;
    let further = point.as_ref().map_or_else(Vec::new, |point| point.columns.clone());
    let mut stream = arguments.reading.open(&arguments.recording, further)?;
    let told = stream.quality().notes;
    let is_drawn = arguments.plot.is_some() || arguments.report.is_some();
    let mut chart = if is_drawn { Chart::new(&config) } else { Chart::of_residuals(&config) };
    let outputs = Outputs { chart: Some(&mut chart), operating_point: point.as_ref(), ..Outputs::default() };
    let Some(summary) = watch_all(&mut stream, &config, outputs, arguments.json.as_deref(), &mut files)?
    else {
        // The reader of standard output has gone: what it would have been told is nobody's business any more.
        return Ok(ExitCode::SUCCESS);
    };
    // What showed on the way, as rows that are no samples do.
    let since: Vec<String> =
        summary.quality.notes.iter().filter(|note| !told.contains(note)).cloned().collect();
    tell(stream.name(), &since);
    if let Some(path) = &arguments.plot {
        files.write_text(path, &chart.figure(&summary).to_svg().map_err(|e| e.in_file(path))?)?;
    }
    if let Some(path) = &arguments.report {
        let command = report::command_line(std::env::args_os());
        files.write_text(path, &page(&summary, &chart, &baseline, stream.columns(), command).to_html()?)?;
    }
    files.commit()?;
    if !to_standard {
        let here = Terminal::here();
        let text = screen(&summary, baseline.promise.as_ref(), &here) + &chart.rows(&summary, &here);
        output::write_text(Path::new("-"), &text)?;
    }
    let failed = arguments.fail_on.is_some_and(|level| summary.reaches(level.into()));
    Ok(ExitCode::from(if failed { 3 } else { 0 }))
}

/// Watches to the end; `None` where standard output was closed before.
fn watch_all(
    stream: &mut RecordingStream,
    config: &Config<f32, 3>,
    outputs: Outputs<'_>,
    json: Option<&Path>,
    files: &mut Files,
) -> Result<Option<Summary>> {
    let bar = Progress::of_bytes("monitoring", stream.size_bytes());
    let progress = |bytes: u64| bar.at(bytes);
    let Outputs { chart, operating_point, .. } = outputs;
    let Some(path) = json else {
        return watch(
            stream,
            config,
            Outputs { json: None, chart, operating_point, progress: Some(&progress) },
        )
        .map(Some)
        .map_err(input_error);
    };
    // Of a run that fails, no line is left; its own error says more than that the writing was broken off.
    let mut ended = None;
    let written = files.write_with(path, |out| {
        let outputs = Outputs { json: Some(out), chart, operating_point, progress: Some(&progress) };
        match watch(stream, config, outputs) {
            Ok(summary) => {
                ended = Some(Ok(summary));
                Ok(())
            }
            Err(Stopped::Writing(error)) => Err(error),
            Err(Stopped::Input(error)) => {
                ended = Some(Err(error));
                Err(io::Error::other("the run failed"))
            }
        }
    });
    match ended {
        Some(Err(error)) => Err(error),
        Some(Ok(summary)) => written.map(|()| Some(summary)),
        None => written.map(|()| None),
    }
}

fn input_error(stopped: Stopped) -> Error {
    match stopped {
        Stopped::Input(error) => error,
        Stopped::Writing(error) => Error::new(format!("can't be written: {error}")),
    }
}
