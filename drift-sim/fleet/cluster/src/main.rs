//! The command `drift-fleet-cluster`.
#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use datafusion::prelude::SessionContext;
use drift_fleet::commands::reading::Reading;
use drift_fleet::commands::{monitor, run_to_end, sql, until_interrupted};
use drift_fleet_cluster::executor::Executor;
use drift_fleet_cluster::{client, start};
use drift_sim::{Error, Result};
use tokio::io::AsyncReadExt;

/// `drift fleet` on Ballista: the same commands, the same answers, several executors.
#[derive(Parser)]
#[command(name = "drift-fleet-cluster", version, propagate_version = true)]
#[command(after_help = "\
Examples:
  drift-fleet-cluster start
  drift-fleet-cluster monitor lake/ --loop-column tag --baselines baselines/ --report plant.html")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Start(start::Arguments),
    /// `drift fleet monitor` on a cluster. Single loops get no page of their own
    Monitor(Box<Monitor>),
    /// `drift fleet sql` on a cluster
    Sql(Box<Sql>),
    #[command(hide = true)]
    Executor(Worker),
}

#[derive(Args)]
struct Monitor {
    #[command(flatten)]
    arguments: monitor::Arguments,
    #[command(flatten)]
    cluster: Cluster,
}

#[derive(Args)]
struct Sql {
    #[command(flatten)]
    arguments: sql::Arguments,
    #[command(flatten)]
    cluster: Cluster,
}

#[derive(Args)]
struct Cluster {
    /// Where the scheduler listens, as `start` says it
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:50050")]
    scheduler: String,
}

/// What `start` tells an executor.
#[derive(Args)]
struct Worker {
    #[arg(long)]
    scheduler_port: u16,
    #[arg(long)]
    folder: PathBuf,
    #[arg(long)]
    threads: usize,
    #[arg(long)]
    memory_limit: u64,
}

/// 0 done, 1 failed, 2 usage (clap's), 3 `--fail-on`.
fn main() -> ExitCode {
    // Silent unless RUST_LOG asks.
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("off")).init();
    let arguments = Arguments::parse();
    run_to_end(work(&arguments.command))
}

async fn work(command: &Command) -> Result<ExitCode> {
    match command {
        Command::Start(arguments) => start::run(arguments).await,
        Command::Monitor(asked) => {
            let Monitor { arguments, cluster } = asked.as_ref();
            if arguments.reports().is_some_and(|reports| reports.all) {
                let what = "--reports all: executors write no pages of single loops";
                return Err(Error::new(what).allowed("`drift fleet monitor`, or --report alone"));
            }
            let session = session(cluster, &arguments.reading).await?;
            until_interrupted(arguments.run_on(&session, None)).await
        }
        Command::Sql(asked) => {
            let Sql { arguments, cluster } = asked.as_ref();
            let session = session(cluster, &arguments.reading).await?;
            until_interrupted(arguments.run_on(&session)).await
        }
        Command::Executor(worker) => {
            let executor = Executor {
                scheduler_port: worker.scheduler_port,
                folder: &worker.folder,
                threads: worker.threads,
                memory_limit_bytes: worker.memory_limit,
            };
            tokio::select! {
                ended = executor.serve() => ended.map(|()| ExitCode::SUCCESS),
                () = alone() => Ok(ExitCode::SUCCESS),
            }
        }
    }
}

async fn session(cluster: &Cluster, reading: &Reading) -> Result<SessionContext> {
    if reading.source().is_sorted {
        let what = "--sorted takes the rows in their order, by one executor";
        return Err(Error::new(what).allowed("without it they are divided among all, and sorted there"));
    }
    client::session(&cluster.scheduler, &reading.engine()).await
}

/// Returns when the process that started this one is gone: nothing is ever written to standard input.
async fn alone() {
    let mut nothing = [0];
    let _ = tokio::io::stdin().read(&mut nothing).await;
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
