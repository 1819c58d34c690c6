//! `drift diagnose`: what physics a simulation left out of a recording.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::control_loop::Loop;
use drift_sim::diagnose::{Diagnosis, Named, SAMPLE_WORK_BYTES};
use drift_sim::diagnosed::{Diagnosed, Question, Read};
use drift_sim::output::Outputs;
use drift_sim::physics::{Kind, UnitNames};
use drift_sim::report::command_line;
use drift_sim::sentences::{self, ends, fit, measured, plain};
use drift_sim::terminal::Terminal;
use drift_sim::{Error, Result, output};

use crate::number_argument::part;
use crate::progress::Progress;
use crate::recording_arguments::RecordingArguments;
use crate::sparkline;

/// Finds, names, models and proves the physics that a simulation left out of a recorded loop.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift diagnose recording.csv
  drift diagnose now.csv --healthy then.csv --report page.html
  drift diagnose monday.csv tuesday.csv wednesday.csv
  drift diagnose recording.csv --loop loop.toml
  drift diagnose recording.csv --loop loop.toml --model improved.toml --report page.html
  drift diagnose faulty.csv --loop loop.toml --healthy monday.csv tuesday.csv")]
pub struct Arguments {
    /// The recording, in any of the formats; several of one loop, in which the same is wrong, are pooled
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// What is known of the loop; without it the law is looked for in the (first healthy) recording, and the plant is identified
    #[arg(long = "loop", value_name = "LOOP.toml")]
    loop_file: Option<PathBuf>,
    /// Another recording, for the proof; without it the last 30 % of each are held out
    #[arg(long, value_name = "REC.csv")]
    holdout: Option<PathBuf>,
    /// Write the diagnosis as JSON; - is standard output
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the improved loop file
    #[arg(long, value_name = "OUT.toml")]
    model: Option<PathBuf>,
    /// A page for people: one HTML file that needs nothing else, with charts to zoom into
    #[arg(long, value_name = "OUT.html")]
    report: Option<PathBuf>,
    /// Recordings from before: what has changed since? The nominal numbers (or the identified plant) come from them
    #[arg(long, value_name = "H.csv", num_args = 1..)]
    healthy: Vec<PathBuf>,
    /// Name a cause only if all others are excluded; the true one is lost with a probability of at most this. Slower, and names less
    #[arg(long, value_name = "ALPHA", value_parser = part)]
    guarantee: Option<f64>,
    #[command(flatten)]
    reading: RecordingArguments,
}

pub fn run(arguments: Arguments) -> Result<ExitCode> {
    let recordings = arguments.recordings.iter().chain(&arguments.holdout).chain(&arguments.healthy);
    let inputs: Vec<&Path> = recordings.chain(&arguments.loop_file).map(PathBuf::as_path).collect();
    let named = [
        ("--json", arguments.json.as_deref()),
        ("--model", arguments.model.as_deref()),
        ("--report", arguments.report.as_deref()),
    ];
    let mut outputs = Outputs::checked(&named, &inputs)?;
    let stated = arguments.loop_file.as_deref().map(Loop::read).transpose()?;
    let columns: Vec<String> = stated.as_ref().map(Loop::input_columns).unwrap_or_default();
    let read_file = |path: &PathBuf| {
        Ok(Read {
            file: path.clone(),
            recording: arguments.reading.read(path, columns.clone(), SAMPLE_WORK_BYTES)?,
        })
    };
    let question = Question {
        recordings: arguments.recordings.iter().map(read_file).collect::<Result<_>>()?,
        holdout: arguments.holdout.as_ref().map(read_file).transpose()?,
        healthy: arguments.healthy.iter().map(read_file).collect::<Result<_>>()?,
        stated: arguments.loop_file.clone().zip(stated),
        guarantee: arguments.guarantee,
    };
    let progress = Progress::of_stages("diagnosing");
    let diagnosed = question.diagnose()?;
    drop(progress);
    let found = &diagnosed.found;
    if let Some(path) = &arguments.model {
        outputs.write_text(path, &found.improved.to_toml())?;
    }
    if let Some(path) = &arguments.report {
        let page = diagnosed.page(command_line(std::env::args_os()));
        outputs.write_text(path, &page.to_html()?)?;
    }
    if let Some(path) = &arguments.json {
        let name = arguments.model.as_ref().map(|p| p.display().to_string());
        let text = serde_json::to_string_pretty(&diagnosed.json(name.as_deref()))
            .map_err(|e| Error::new(format!("the diagnosis can't be written as JSON: {e}")))?;
        outputs.write_text(path, &(text + "\n"))?;
    }
    outputs.commit()?;
    if arguments.json.as_deref() != Some(Path::new("-")) {
        let here = Terminal::here();
        let text = screen(&diagnosed, &here)
            + &diagnosed.experiment().map_or_else(String::new, |text| here.wrapped("  experiment: ", text))
            + &sparkline::rows(found, diagnosed.shown(), &here);
        output::write_text(Path::new("-"), &text)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// An improvement below, in percentage points, is nothing that a reader could use.
const LEAST_POINTS: f64 = 0.01;

/// One screen for people: the answer first.
fn screen(diagnosed: &Diagnosed, terminal: &Terminal) -> String {
    let (found, clock, start_s) = (&diagnosed.found, diagnosed.clock(), diagnosed.start_s());
    let place = found.place.map_or(String::new(), |place| format!(", at the {}", place.name()));
    let mut text = terminal.answer(&sentences::diagnosis(found, clock, start_s));
    text += &format!("\nverdict: {}{place}\n", found.verdict.name());
    let (nothing, something): (Vec<&Named>, Vec<&Named>) =
        found.physics.iter().partition(|named| named.may_be_nothing());
    for named in something {
        text += &physics(named, &found.nominal.unit_names(), terminal);
    }
    if !nothing.is_empty() {
        let kinds: Vec<&str> = nothing.iter().map(|named| named.term.kind.name).collect();
        text += &terminal.wrapped("  may be nothing, by its interval: ", &kinds.join(", "));
    }
    if found.not_used > 0 {
        text += &format!("  the last {} samples of the recording were not used\n", found.not_used);
    }
    for (what, says) in found.located(clock, start_s) {
        text += &terminal.wrapped(&format!("  {}: ", what.to_lowercase()), &says);
    }
    for p in &found.parameters {
        let given = format!(" (as given: {})", plain(p.nominal, 4));
        let given = if diagnosed.is_identified && p.is_plants() { "" } else { given.as_str() };
        let value = measured(p.value, p.half_width, "") + given;
        text += &terminal.wrapped(&format!("  {:24} ", p.name), &value);
    }
    text += &fits(found);
    let unexcited: Vec<&str> = found
        .untestable
        .iter()
        .filter(|r| Kind::named(r.kind).is_ok_and(|kind| (kind.applies)(&found.nominal.plant)))
        .map(|r| r.kind)
        .collect();
    if !unexcited.is_empty() {
        text += &terminal.wrapped("  this recording can't show: ", &unexcited.join(", "));
    }
    text
}

/// A term's numbers with their intervals, and its ties.
fn physics(named: &Named, units: &UnitNames, terminal: &Terminal) -> String {
    let kind = named.term.kind;
    let mut text = String::new();
    let parameters = kind.parameters.iter().zip(&named.term.parameters).zip(&named.half_widths);
    // What is held at nothing is no news.
    let parameters = parameters.filter(|((_, value), width)| **value != 0.0 || width.is_finite());
    for ((parameter, value), width) in parameters {
        let shown = sentences::parameter(*value, *width, &units.unit(parameter.unit));
        let remark = if width.is_finite() || !parameter.fitted { "" } else { " (not determined, or held)" };
        let name = format!("{} {}", kind.name, parameter.name.trim_end_matches("_per_s"));
        text += &terminal.wrapped(&format!("  {name:33} "), &format!("{shown}{remark}"));
    }
    if !named.tied.is_empty() {
        let text_of = format!("can't be told from {}: {}", named.tied.join(", "), kind.experiment);
        text += &terminal.wrapped("    ", &text_of);
    }
    text
}

/// How well the simulated loop fits: unseen data, or, where nothing was held out, what all was fitted to.
fn fits(found: &Diagnosis) -> String {
    let (what, fits) = match found.holdout.nominal.or(found.holdout.after) {
        Some(_) => ("fit on unseen data, %", found.holdout),
        None => ("fit, nothing held out, %", found.train),
    };
    let rows = [
        ("as it came", fits.nominal),
        ("refitted", fits.before),
        ("with what was found", fits.after.filter(|_| !found.physics.is_empty())),
        ("noise alone leaves", found.noise_leaves()),
    ];
    let mut text = format!("  {what:25} {:>10} {:>10}\n", "y", "u");
    for (name, of) in rows {
        if let Some(of) = of {
            let u = of.u_pct.map_or(String::from("-"), fit);
            text += &format!("    {name:20} {:>13} {u:>10}\n", fit(of.y_pct));
        }
    }
    if let Some(period) = found.cycle_s {
        text += &format!("    the loop cycles by itself: simulated anew every {} s\n", plain(period, 4));
    }
    if let Some([low, high]) = found.improvement.filter(|[low, high]| *low > 0.0 && *high >= LEAST_POINTS) {
        text += &format!("    what was found improves it by {} points (95 %)\n", ends(low, high));
    }
    text
}
