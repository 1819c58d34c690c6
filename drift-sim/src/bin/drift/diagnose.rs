//! `drift diagnose`: what physics a simulation left out of a recording.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use drift_sim::control_loop::Loop;
use drift_sim::diagnose::healthy::Healthy;
use drift_sim::diagnose::signals::Signals;
use drift_sim::diagnose::{Diagnosis, Named, Verdict, diagnose, page, report};
use drift_sim::output::Outputs;
use drift_sim::physics::{Kind, UnitNames, digits, shown, significant, with_unit};
use drift_sim::plot::terminal::Signs;
use drift_sim::report::command_line;
use drift_sim::{Error, Result, output};

use crate::progress::Progress;
use crate::recording_arguments::RecordingArguments;
use crate::sparkline;

/// Finds, names, models and proves the physics that a simulation left out of a recorded loop.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift diagnose recording.csv --loop loop.toml
  drift diagnose recording.csv --loop loop.toml --model improved.toml --report page.html
  drift diagnose faulty.csv --loop loop.toml --healthy monday.csv tuesday.csv")]
pub struct Arguments {
    /// The recording, in any of the formats
    recording: PathBuf,
    /// What is known of the loop
    #[arg(long = "loop", value_name = "LOOP.toml")]
    loop_file: PathBuf,
    /// A second recording, for the proof; without it the last 30 % of the first are held out
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
    /// Healthy recordings that the nominal numbers (or the identified plant) come from
    #[arg(long, value_name = "H.csv", num_args = 1..)]
    healthy: Vec<PathBuf>,
    #[command(flatten)]
    reading: RecordingArguments,
}

pub fn run(arguments: Arguments) -> Result<ExitCode> {
    let mut inputs: Vec<&Path> = vec![&arguments.recording, &arguments.loop_file];
    inputs.extend(arguments.holdout.iter().chain(&arguments.healthy).map(PathBuf::as_path));
    let named = [
        ("--json", arguments.json.as_deref()),
        ("--model", arguments.model.as_deref()),
        ("--report", arguments.report.as_deref()),
    ];
    let mut outputs = Outputs::checked(&named, &inputs)?;
    let model = Loop::read(&arguments.loop_file)?;
    let inputs = || model.inputs.iter().map(|input| input.column.clone()).collect();
    let read = |path: &Path| Signals::new(&arguments.reading.read(path, inputs())?, &model);
    let recording = arguments.reading.read(&arguments.recording, inputs())?;
    let train = Signals::new(&recording, &model)?;
    let holdout = arguments.holdout.as_deref().map(read).transpose()?;
    let healthy = arguments.healthy.iter().map(|path| read(path)).collect::<Result<Vec<_>>>()?;
    let progress = Progress::of_unknown("diagnosing");
    let found = if healthy.is_empty() {
        diagnose(&train, holdout.as_ref(), &model)?
    } else {
        Healthy::of(&model, &healthy)?.diagnose(&train, holdout.as_ref())?
    };
    drop(progress);
    if let Some(path) = &arguments.model {
        outputs.write_text(path, &found.improved.to_toml())?;
    }
    if let Some(path) = &arguments.report {
        let case = page::Case {
            train: &train,
            holdout: holdout.as_ref(),
            recording: &arguments.recording,
            loop_file: &arguments.loop_file,
            holdout_file: arguments.holdout.as_deref(),
            columns: &recording.columns,
        };
        let page = page::page(&found, &case, command_line(std::env::args_os()));
        outputs.write_text(path, &page.to_html()?)?;
    }
    if let Some(path) = &arguments.json {
        let name = arguments.model.as_ref().map(|p| p.display().to_string());
        let text = serde_json::to_string_pretty(&report::json(&found, name.as_deref()))
            .map_err(|e| Error::new(format!("the diagnosis can't be written as JSON: {e}")))?;
        outputs.write_text(path, &(text + "\n"))?;
    }
    outputs.commit()?;
    if arguments.json.as_deref() != Some(Path::new("-")) {
        let shown = holdout.as_ref().unwrap_or(&train);
        let text = screen(&found) + &sparkline::rows(&found, shown, Signs::of_locale());
        output::write_text(Path::new("-"), &text)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// One screen for people.
fn screen(found: &Diagnosis) -> String {
    let place = found.place.map_or(String::new(), |place| format!(", at the {}", place.name()));
    let mut text = format!("verdict: {}{place}\n", found.verdict.name());
    for named in &found.physics {
        text += &physics(named, &found.nominal.unit_names());
    }
    if found.far_off {
        text += match found.verdict {
            Verdict::NoMismatch | Verdict::Parameters => {
                "  nothing can be said: the plant that could be identified does not follow y where it has not seen it\n"
            }
            _ => "  the loop stays far from what was measured: more is missing than can be named\n",
        };
    }
    if found.not_used > 0 {
        text += &format!("  the last {} samples of the recording were not used\n", found.not_used);
    }
    for (what, says) in found.located() {
        text += &format!("  {}: {says}\n", what.to_lowercase());
    }
    for p in &found.parameters {
        let (value, from) = (shown(p.value, ""), shown(p.nominal, ""));
        text += &format!("  {:24} {from} -> {value} +- {}\n", p.name, shown(p.half_width, ""));
    }
    text += &fits(found);
    let unexcited: Vec<&str> = found
        .untestable
        .iter()
        .filter(|r| Kind::named(r.kind).is_ok_and(|kind| (kind.applies)(&found.nominal.plant)))
        .map(|r| r.kind)
        .collect();
    if !unexcited.is_empty() {
        text += &format!("  this recording can't show: {}\n", unexcited.join(", "));
    }
    text
}

/// A term in a sentence, with its intervals and its ties.
fn physics(named: &Named, units: &UnitNames) -> String {
    let mut text = format!("  {}\n", named.term.says(units));
    let parameters = named.term.kind.parameters.iter().zip(&named.term.parameters);
    for ((parameter, value), width) in parameters.zip(&named.half_widths) {
        let unit = units.unit(parameter.unit);
        let digits = digits(*value, *width);
        let interval = if width.is_finite() {
            format!("95 %: {} to {}", significant(value - width, digits), significant(value + width, digits))
        } else {
            "not determined, or held".into()
        };
        let value = with_unit(significant(*value, digits), &unit);
        text += &format!("    {:22} {value:<20} {interval}\n", parameter.name);
    }
    if let Some(first) = named.moved_from() {
        text +=
            &format!("    before the others were named: {}\n", (first.kind.says)(&first.parameters, units));
    }
    if !named.tied.is_empty() {
        text +=
            &format!("    can't be told from {}: {}\n", named.tied.join(", "), named.term.kind.experiment);
    }
    text
}

/// A fit below this follows nothing; how far below says nothing more.
const NO_FIT_PCT: f64 = -1000.0;

fn percent(value: f64, decimals: usize) -> String {
    if value < NO_FIT_PCT { format!("below {NO_FIT_PCT}") } else { format!("{value:.decimals$}") }
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
        ("improved", fits.after),
        ("noise alone leaves", found.noise_floor),
    ];
    let mut text = format!("  {what:25} {:>10} {:>10}\n", "y", "u");
    for (name, fit) in rows {
        if let Some(fit) = fit {
            let u = fit.u_pct.map_or(String::from("-"), |u| percent(u, 2));
            text += &format!("    {name:20} {:>13} {u:>10}\n", percent(fit.y_pct, 3));
        }
    }
    if let Some(period) = found.cycle_s {
        text += &format!("    the loop cycles by itself: simulated anew every {}\n", shown(period, "s"));
    }
    if let Some([low, high]) = found.improvement.filter(|[low, _]| *low > 0.0) {
        text += &format!("    the physics improves it by {low:.2} to {high:.2} points (95 %)\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_that_follows_nothing_is_no_number_of_thirty_digits() {
        assert_eq!(percent(-5.720_106_733_719_835e30, 3), "below -1000");
        assert_eq!(percent(f64::NEG_INFINITY, 3), "below -1000");
        assert_eq!(percent(99.98765, 2), "99.99");
    }
}
