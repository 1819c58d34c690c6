//! `drift init`: a loop file proposed from a recording alone.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::Result;
use drift_sim::diagnose::SAMPLE_WORK_BYTES;
use drift_sim::init::propose;
use drift_sim::output::{self, Outputs};
use drift_sim::sentences::typed;
use drift_sim::terminal::Terminal;

use crate::progress::Progress;
use crate::recording_arguments::{RecordingArguments, tell};

/// Proposes a loop file from a recording: sample time, controller, plant, each with how it was found and how sure it is.
///
/// What can't be found is left open in the file (controller kind "recorded", plant kind "identify") with the reason.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift init recording.csv -o loop.toml
  drift init log.mat --columns t=log.time,r=log.SP,y=log.PV,u=log.OP -o loop.toml")]
pub struct Arguments {
    /// The recording, in any of the formats; - is standard input
    #[arg(value_name = "REC")]
    recording: PathBuf,
    /// The loop file; - is standard output, and nothing else is printed then
    #[arg(short, long, value_name = "LOOP.toml", default_value = "-")]
    output: PathBuf,
    #[command(flatten)]
    reading: RecordingArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let output = Some(arguments.output.as_path());
    let mut outputs = Outputs::checked(&[("--output", output)], &[&arguments.recording])?;
    let mut recording = arguments.reading.read(&arguments.recording, Vec::new(), SAMPLE_WORK_BYTES)?;
    if let Some((first_s, last_s)) = recording.keep_longest_closed() {
        let (first_s, last_s) = (typed(first_s), typed(last_s));
        let used = format!("only the longest stretch with the loop closed is used, {first_s} to {last_s} s");
        tell(&recording.name, &[used]);
    }
    let progress = Progress::of_stages("looking for law and plant");
    let proposal = propose(&recording)?;
    drop(progress);
    outputs.write_text(&arguments.output, &proposal.to_toml())?;
    outputs.commit()?;
    if arguments.output != Path::new("-") {
        output::write_text(Path::new("-"), &proposal.screen(&Terminal::here()))?;
    }
    Ok(ExitCode::SUCCESS)
}
