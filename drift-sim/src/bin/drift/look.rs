//! `drift look`: what is in a file, and the command to type next.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::report::command_line;
use drift_sim::terminal::Terminal;
use drift_sim::{Result, look, output};

use crate::recording_arguments::RecordingArguments;

/// Shows what is in a recording: rows, sample time, gaps, columns and what was guessed, manual and saturated stretches.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift look recording.csv
  drift look log.mat --columns r=log.SP,y=log.PV,u=log.OP")]
pub struct Arguments {
    /// The recording, in any of the formats; - is standard input
    #[arg(value_name = "REC")]
    recording: PathBuf,
    #[command(flatten)]
    reading: RecordingArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let seen = arguments.reading.look(&arguments.recording)?;
    let typed = command_line(std::env::args_os());
    let typed = typed.split_once("look ").map_or("", |(_, typed)| typed);
    output::write_text(Path::new("-"), &look::screen(&seen, typed, &Terminal::here()))?;
    Ok(ExitCode::SUCCESS)
}
