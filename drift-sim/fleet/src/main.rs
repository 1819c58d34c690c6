//! The command `drift-fleet`, to which `drift fleet` hands over.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use drift_fleet::commands::{calibrate, monitor, scan, sql};
use drift_sim::{Error, Result};

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
    match run(&arguments.command) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(1)
        }
    }
}

fn run(command: &Command) -> Result<ExitCode> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    let runtime = runtime.map_err(|e| Error::new(format!("no threads: {e}")))?;
    runtime.block_on(async {
        tokio::select! {
            done = work(command) => done,
            _ = tokio::signal::ctrl_c() => {
                drift_sim::output::remove_unfinished();
                std::process::exit(130)
            }
        }
    })
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
