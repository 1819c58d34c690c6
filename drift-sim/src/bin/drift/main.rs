//! The command `drift`: one file a command; each reads its arguments, calls the library and prints.
#![forbid(unsafe_code)]

mod design;
mod diagnose;
#[allow(dead_code, reason = "each command that takes long shows its own kind of progress")]
mod progress;
#[allow(dead_code, reason = "flattened into the commands that read recordings")]
mod recording_arguments;
mod simulate;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Finds what a feedback loop hides.
#[derive(Parser)]
#[command(name = "drift", version, about, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Design(design::Arguments),
    Diagnose(diagnose::Arguments),
    Simulate(simulate::Arguments),
}

/// 0 done, 1 failed, 2 usage (clap's), 3 `--fail-on`.
fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let done: drift_sim::Result<ExitCode> = match arguments.command {
        Command::Design(arguments) => design::run(arguments),
        Command::Diagnose(arguments) => diagnose::run(arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(1)
        }
    }
}
