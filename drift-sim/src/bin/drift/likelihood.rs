//! `drift likelihood`: how likely recordings are under a loop file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::control_loop::Loop;
use drift_sim::diagnose::SAMPLE_WORK_BYTES;
use drift_sim::diagnose::signals::Signals;
use drift_sim::likelihood_search::loop_likelihood::loop_likelihood;
use drift_sim::likelihood_search::options::Options;
use drift_sim::output::{self, Outputs};
use drift_sim::physics::shown;
use drift_sim::{Error, Result};

use crate::recording_arguments::RecordingArguments;

/// How likely recordings are under a loop file: to compare two loop files on the same recordings
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift likelihood train.csv holdout.csv --loop improved.toml
  drift likelihood train.csv holdout.csv --loop truth.toml --refit --json -")]
pub struct Arguments {
    /// Recordings of one loop, in any of the formats
    #[arg(required = true, num_args = 1..)]
    recordings: Vec<PathBuf>,
    /// The loop file
    #[arg(long = "loop", value_name = "LOOP.toml")]
    loop_file: PathBuf,
    /// Move the plant's and the terms' numbers to where the recordings are likeliest, from where they stand
    #[arg(long)]
    refit: bool,
    /// Write the likelihood as JSON; - is standard output
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    reading: RecordingArguments,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let inputs: Vec<&Path> =
        arguments.recordings.iter().chain([&arguments.loop_file]).map(PathBuf::as_path).collect();
    let mut outputs = Outputs::checked(&[("--json", arguments.json.as_deref())], &inputs)?;
    let model = Loop::read(&arguments.loop_file)?;
    let columns = || model.input_columns();
    let read =
        |path: &PathBuf| Signals::new(&arguments.reading.read(path, columns(), SAMPLE_WORK_BYTES)?, &model);
    let recordings = arguments.recordings.iter().map(read).collect::<Result<Vec<_>>>()?;
    let found = loop_likelihood(&model, &recordings, arguments.refit, &Options::default())?;
    if let Some(path) = &arguments.json {
        let numbers: serde_json::Map<String, serde_json::Value> =
            found.numbers.iter().map(|(name, value)| (name.clone(), serde_json::json!(value))).collect();
        let document = serde_json::json!({
            "schema": "drift.likelihood/1",
            "log_likelihood": found.log_likelihood,
            "samples": found.samples,
            "sensor_sd": found.sensor_sd,
            "load_over_drive": found.load.0,
            "load_tau_s": found.load.1,
            "numbers": numbers,
        });
        let text = serde_json::to_string_pretty(&document)
            .map_err(|e| Error::new(format!("the likelihood can't be written as JSON: {e}")))?;
        outputs.write_text(path, &(text + "\n"))?;
    }
    outputs.commit()?;
    if arguments.json.as_deref() != Some(Path::new("-")) {
        let units = model.unit_names();
        let mut text =
            format!("log-likelihood: {:.1} nats, {} samples\n", found.log_likelihood, found.samples);
        text += &format!("  sensor noise {}\n", shown(found.sensor_sd, &units.y));
        text += &format!(
            "  random load {} of the drive's deviation, time constant {}\n",
            shown(found.load.0, ""),
            shown(found.load.1, "s")
        );
        for (name, value) in &found.numbers {
            text += &format!("  {name:30} {}\n", shown(*value, ""));
        }
        output::write_text(Path::new("-"), &text)?;
    }
    Ok(ExitCode::SUCCESS)
}
