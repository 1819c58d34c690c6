//! `drift init`: a loop file proposed from a recording alone.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::Result;
use drift_sim::init::propose;
use drift_sim::output::{self, Outputs};
use drift_sim::recording::{Recording, RowState};

use crate::progress::Progress;
use crate::recording_arguments::RecordingArguments;

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
    let mut recording = arguments.reading.read(&arguments.recording, Vec::new())?;
    keep_longest_closed(&mut recording);
    let progress = Progress::of_stages("looking for law and plant");
    let proposal = propose(&recording)?;
    drop(progress);
    outputs.write_text(&arguments.output, &proposal.to_toml())?;
    outputs.commit()?;
    if arguments.output != Path::new("-") {
        output::write_text(Path::new("-"), &proposal.screen())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Keeps the longest stretch in which the loop is closed: by hand u follows no law, and the law starts anew afterwards.
fn keep_longest_closed(recording: &mut Recording) {
    let is_closed = |state: &RowState| *state != RowState::Manual;
    let (mut longest, mut from) = (0..0, 0);
    for (end, state) in recording.state.iter().chain([&RowState::Manual]).enumerate() {
        if !is_closed(state) {
            if end - from > longest.len() {
                longest = from..end;
            }
            from = end + 1;
        }
    }
    if longest.len() == recording.len() || longest.is_empty() {
        return;
    }
    let (first_s, last_s) = (recording.time_s(longest.start), recording.time_s(longest.end - 1));
    eprintln!(
        "{}: only the longest stretch with the loop closed is used, {first_s} to {last_s} s",
        recording.name
    );
    let signals = [&mut recording.r, &mut recording.y, &mut recording.u].into_iter();
    for values in signals.chain(recording.extra.iter_mut().map(|(_, values)| values)) {
        values.truncate(longest.end);
        values.drain(..longest.start);
    }
    recording.state.truncate(longest.end);
    recording.state.drain(..longest.start);
    recording.start_s = first_s;
}
