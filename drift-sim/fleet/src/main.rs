//! The command `drift-fleet`, to which `drift fleet` hands over.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use drift_fleet::commands::{calibrate, monitor, run_to_end, scan, sql, until_interrupted};
use drift_sim::Result;

/// Many loops at once: Parquet and CSV, without holding the data.
#[derive(Parser)]
#[command(name = "drift fleet", bin_name = "drift fleet", version, propagate_version = true)]
#[command(after_help = "\
Examples:
  drift fleet calibrate healthy/ --loop-column tag -o baselines/
  drift fleet monitor lake/ --loop-column tag --baselines baselines/ --report plant.html
  drift fleet scan lake/ --loop-column tag")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Calibrate(Box<calibrate::Arguments>),
    Monitor(Box<monitor::Arguments>),
    Scan(Box<scan::Arguments>),
    Sql(Box<sql::Arguments>),
}

/// 0 done, 1 failed, 2 usage (clap's), 3 `--fail-on`.
fn main() -> ExitCode {
    let arguments = Arguments::parse();
    run_to_end(until_interrupted(work(&arguments.command)))
}

async fn work(command: &Command) -> Result<ExitCode> {
    match command {
        Command::Calibrate(arguments) => calibrate::run(arguments).await,
        Command::Monitor(arguments) => monitor::run(arguments).await,
        Command::Scan(arguments) => scan::run(arguments).await,
        Command::Sql(arguments) => sql::run(arguments).await,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_description_of_the_command_is_sound() {
        Arguments::command().debug_assert();
    }
}
