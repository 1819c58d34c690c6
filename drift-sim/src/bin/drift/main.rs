//! The command `drift`: one file a command; each reads its arguments, calls the library and prints.
#![forbid(unsafe_code)]

mod calibrate;
mod completions;
mod demo;
mod design;
mod diagnose;
mod fleet;
mod init;
mod interrupts;
mod likelihood;
mod look;
mod man;
mod monitor;
mod number_argument;
mod paper;
mod plan;
mod progress;
mod recording_arguments;
mod simulate;
mod sparkline;

use std::io::Write;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

/// Finds what a feedback loop hides.
#[derive(Parser)]
#[command(name = "drift", version, propagate_version = true)]
#[command(after_help = "\
Examples:
  drift demo
  drift look recording.csv
  drift init recording.csv -o loop.toml
  drift diagnose recording.csv --report page.html
  drift calibrate healthy.csv -o baseline.toml
  drift monitor recording.csv --baseline baseline.toml")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Arguments),
    Simulate(simulate::Arguments),
    Calibrate(Box<calibrate::Arguments>),
    Monitor(monitor::Arguments),
    Design(design::Arguments),
    Look(look::Arguments),
    Diagnose(diagnose::Arguments),
    Init(init::Arguments),
    Likelihood(likelihood::Arguments),
    Fleet(fleet::Arguments),
    Paper(paper::Arguments),
    Plan(plan::Arguments),
    Completions(completions::Arguments),
    Man(man::Arguments),
}

/// The whole command. A negative number is the value of an option everywhere, so that its own range refuses it and not the parser.
fn command() -> clap::Command {
    Arguments::command().mut_subcommands(|command| command.allow_negative_numbers(true))
}

/// 0 done, 1 failed, 2 usage (clap's), 3 `--fail-on`.
fn main() -> ExitCode {
    interrupts::leave_nothing_unfinished();
    let arguments = Arguments::from_arg_matches(&command().get_matches()).unwrap_or_else(|e| e.exit());
    let done: drift_sim::Result<ExitCode> = match arguments.command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Design(arguments) => design::run(arguments),
        Command::Diagnose(arguments) => diagnose::run(arguments),
        Command::Fleet(arguments) => fleet::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Likelihood(arguments) => likelihood::run(&arguments),
        Command::Look(arguments) => look::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments, command()),
        Command::Man(arguments) => man::run(&arguments, command()),
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Monitor(arguments) => monitor::run(arguments),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            // Nobody may listen any more; then there is nobody to tell.
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::from(1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lines of a command's help that show it at work.
    fn examples(command: &clap::Command) -> Vec<String> {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let lines = help.lines().map(|line| line.trim().trim_start_matches("Example: "));
        lines.filter_map(|line| line.strip_prefix("drift ")).map(str::to_string).collect()
    }

    #[test]
    fn the_description_of_the_command_is_sound() {
        command().debug_assert();
    }

    #[test]
    fn every_command_shows_examples_that_it_takes() {
        for command in command().get_subcommands() {
            let examples = examples(command);
            assert!(!examples.is_empty(), "{} has no example", command.get_name());
            for example in examples {
                let own = example.split(['|', '>', '&']).next().unwrap_or_default();
                let words = std::iter::once("drift").chain(own.split_whitespace());
                let parsed = Arguments::try_parse_from(words);
                assert!(
                    parsed.is_ok(),
                    "drift {example}: {}",
                    parsed.err().map_or(String::new(), |e| e.to_string())
                );
                assert!(own.starts_with(command.get_name()), "{example}");
            }
        }
    }
}
