//! `drift paper`: every table and figure of the paper, ours beside the published value.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::paper::{FILES, Paper, Settings};
use drift_sim::report::command_line;
use drift_sim::{Result, output};

use crate::number_argument::seed;
use crate::progress::Progress;

/// Reproduces the paper: its tables and figures, ours beside the published values, and what lies beyond.
///
/// Writes paper.html (one page with everything, which needs nothing else), paper.json (every number) and the figures as SVG.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift paper
  drift paper --out paper --seed 2")]
pub struct Arguments {
    /// The folder to write to; made if it is missing.
    #[arg(long, value_name = "DIR", default_value = "paper")]
    out: PathBuf,
    /// Everything random follows from this number.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = seed)]
    seed: u64,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    output::own_folder(&arguments.out, &FILES)?;
    let settings = Settings::new(arguments.seed);
    let progress = Progress::of_steps("simulating", settings.steps());
    let paper = Paper::reproduce(&settings, &|| progress.step())?;
    drop(progress);
    paper.write(&arguments.out, command_line(std::env::args_os()))?;
    let text = format!(
        "{}\nwritten: {}, paper.json and {} figures beside it\n",
        paper.summary(),
        arguments.out.join("paper.html").display(),
        paper.figure_files().count()
    );
    output::write_text(Path::new("-"), &text)?;
    Ok(ExitCode::SUCCESS)
}
