//! `drift plan`: the experiment that tells apart what a diagnosis left.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::control_loop::Loop;
use drift_sim::output::{self, Outputs};
use drift_sim::plan::{Limits, OpenDiagnosis, Plan, Request};
use drift_sim::report::command_line;
use drift_sim::sentences;
use drift_sim::terminal::Terminal;
use drift_sim::{Error, Result};

use crate::number_argument::{finite, part, positive, seconds, seed};
use crate::progress::Progress;

/// Proposes the reference, within limits, that tells apart what a diagnosis left, and says with which chance.
///
/// The closed loop is simulated with each cause that is left, and with the noise that the recording showed; the shortest reference wins whose
/// worst pair separates after the rival's numbers have been refitted.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift plan loop.toml --diagnosis diagnosis.json -o reference.csv
  drift plan loop.toml --diagnosis diagnosis.json -o reference.csv --r-min 20 --r-max 60 --duration 3600 --report plan.html")]
pub struct Arguments {
    /// The loop file that was diagnosed, with its law
    #[arg(value_name = "LOOP.toml")]
    loop_file: PathBuf,
    /// What drift diagnose --json wrote
    #[arg(long, value_name = "D.json")]
    diagnosis: PathBuf,
    /// Where the reference is written, as CSV: t, r, and y and u as the likeliest cause would answer; - is standard output
    #[arg(short, long, value_name = "R.csv")]
    output: PathBuf,
    /// Least r; without it the recording's
    #[arg(long, value_name = "R", value_parser = finite)]
    r_min: Option<f64>,
    /// Greatest r; without it the recording's
    #[arg(long, value_name = "R", value_parser = finite)]
    r_max: Option<f64>,
    /// The fastest change of r, per second; without it the recording's, or 40 times the range in the longest experiment where that is more
    #[arg(long, value_name = "R_PER_S", value_parser = positive)]
    r_rate: Option<f64>,
    /// Least u that any of the causes may lead to
    #[arg(long, value_name = "U", value_parser = finite)]
    u_min: Option<f64>,
    /// Greatest u that any of the causes may lead to
    #[arg(long, value_name = "U", value_parser = finite)]
    u_max: Option<f64>,
    /// The longest experiment, in seconds; without it as long as the recording
    #[arg(long, value_name = "S", value_parser = seconds)]
    duration: Option<f64>,
    /// The chance with which each pair is to be told apart: a longer reference is taken until it is reached
    #[arg(long, value_name = "PART", default_value_t = 0.98, value_parser = part)]
    chance: f64,
    /// The noise of the rehearsals follows from this number
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = seed)]
    seed: u64,
    /// Write the plan as JSON; - is standard output
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// A page for people: the reference with the predicted response of each cause
    #[arg(long, value_name = "OUT.html")]
    report: Option<PathBuf>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let inputs: Vec<&Path> = vec![&arguments.loop_file, &arguments.diagnosis];
    let named = [
        ("--output", Some(arguments.output.as_path())),
        ("--json", arguments.json.as_deref()),
        ("--report", arguments.report.as_deref()),
    ];
    let mut outputs = Outputs::checked(&named, &inputs)?;
    let request = Request {
        stated: Loop::read(&arguments.loop_file)?,
        open: OpenDiagnosis::read(&arguments.diagnosis)?,
        limits: Limits {
            r_low: arguments.r_min,
            r_high: arguments.r_max,
            r_rate: arguments.r_rate,
            u_low: arguments.u_min,
            u_high: arguments.u_max,
            longest_s: arguments.duration,
        },
        chance: arguments.chance,
        seed: arguments.seed,
    };
    let progress = Progress::of_stages("planning");
    let plan = request.plan()?;
    drop(progress);
    outputs.write_text(&arguments.output, &plan.csv())?;
    if let Some(path) = &arguments.report {
        let file =
            arguments.output.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        outputs.write_text(path, &plan.page(command_line(std::env::args_os()), &file).to_html()?)?;
    }
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&plan.json())
            .map_err(|e| Error::new(format!("the plan can't be written as JSON: {e}")))?;
        outputs.write_text(path, &(text + "\n"))?;
    }
    outputs.commit()?;
    let is_free = |path: &Path| path != Path::new("-");
    if is_free(&arguments.output) && arguments.json.as_deref().is_none_or(is_free) {
        output::write_text(Path::new("-"), &screen(&plan, arguments, &Terminal::here()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// One screen for people: the answer first, then each cause's chance, then what to type.
fn screen(plan: &Plan, arguments: &Arguments, terminal: &Terminal) -> String {
    let mut text = terminal.answer(&sentences::planning(plan));
    text.push('\n');
    for (place, chance) in &plan.separation.named {
        let name = format!("  if it is {:24} ", plan.name(*place));
        text += &terminal.wrapped(&name, &format!("named with a chance of {}", sentences::chance(*chance)));
    }
    let log = if plan.is_continued() { "LOG.csv" } else { "EXPERIMENT.csv" };
    text += &terminal
        .wrapped("  then: ", &format!("drift diagnose {log} --loop {}", arguments.loop_file.display()));
    text
}
