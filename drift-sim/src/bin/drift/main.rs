//! The command `drift`: one file a command; each reads its arguments, calls the library and prints.
#![forbid(unsafe_code)]

mod calibrate;
mod demo;
mod design;
mod diagnose;
mod init;
mod monitor;
mod paper;
mod progress;
mod recording_arguments;
mod simulate;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Finds what a feedback loop hides.
#[derive(Parser)]
#[command(name = "drift", version, about, propagate_version = true)]
#[command(
    after_help = "Examples:\n  drift demo\n  drift init run.csv -o LOOP.toml && drift diagnose run.csv --loop LOOP.toml --report report.html\n  drift calibrate healthy.csv -o BASELINE.toml && drift monitor run.csv --baseline BASELINE.toml"
)]
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
    Init(init::Arguments),
    Diagnose(diagnose::Arguments),
    Paper(paper::Arguments),
}

/// 0 done, 1 failed, 2 usage (clap's), 3 `--fail-on`.
fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let done: drift_sim::Result<ExitCode> = match arguments.command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Design(arguments) => design::run(arguments),
        Command::Diagnose(arguments) => diagnose::run(arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Monitor(arguments) => monitor::run(arguments),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(1)
        }
    }
}
