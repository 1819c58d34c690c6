//! `drift-fleet-cluster start`: a scheduler and executors on this machine, each executor a process of its own.

use std::io::Write;
use std::path::Path;
use std::process::{ExitCode, Stdio};

use clap::Args;
use drift_fleet::commands::reading::bytes;
use drift_sim::{Error, Result};
use tokio::net::TcpListener;
use tokio::process::{Child, Command};
use tokio::task::JoinSet;

use crate::{LOOPBACK, scheduler};

/// Runs a scheduler and executors on this machine until it is interrupted. They listen on 127.0.0.1 alone.
#[derive(Args, Debug, Clone)]
pub struct Arguments {
    /// Where the scheduler listens; 0 takes any free port, which is printed
    #[arg(long, value_name = "PORT", default_value_t = 50050)]
    port: u16,
    /// Executors, each a process of its own
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=64))]
    executors: u16,
    /// Parts of the work that each executor does side by side
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// What the sorts of each executor may take in memory, like 500M or 4G; beyond, it goes to the disk
    #[arg(long, value_name = "BYTES", default_value = "1G", value_parser = bytes)]
    memory_limit: u64,
}

/// Runs the command.
///
/// # Errors
/// The port is taken, an executor can't be started, or the last of them has ended.
pub async fn run(arguments: &Arguments) -> Result<ExitCode> {
    let listener = TcpListener::bind((LOOPBACK, arguments.port)).await.map_err(|e| {
        Error::new(format!("port {} of {LOOPBACK}: {e}", arguments.port)).allowed("--port with another, or 0")
    })?;
    let port = listener.local_addr().map_err(|e| Error::new(e.to_string()))?.port();
    say(&format!("scheduler: {LOOPBACK}:{port}"))?;
    // Removed with all that the executors left in it.
    let folder =
        tempfile::tempdir().map_err(|e| Error::new(format!("no folder for temporary files: {e}")))?;
    let mut executors = JoinSet::new();
    for number in 1..=arguments.executors {
        let mut child = executor(arguments, port, &folder.path().join(format!("executor_{number}")))?;
        say(&format!("executor {number}: process {}", child.id().unwrap_or(0)))?;
        executors.spawn(async move {
            // Held open as long as this process lives: waiting would close it.
            let _input = child.stdin.take();
            let ended = child.wait().await;
            (number, ended)
        });
    }
    let scheduling = scheduler::serve(listener);
    tokio::pin!(scheduling);
    loop {
        tokio::select! {
            ended = &mut scheduling => return ended.map(|()| ExitCode::SUCCESS),
            Some(ended) = executors.join_next() => {
                if let Ok((number, Ok(status))) = ended {
                    say(&format!("executor {number}: ended ({status}); its work goes to the others"))?;
                }
                if executors.is_empty() {
                    return Err(Error::new("no executor is left"));
                }
            }
            () = interrupted() => return Ok(ExitCode::SUCCESS),
        }
    }
}

/// An executor's process. It ends with this one: when its standard input closes, even where nobody could tell it so.
fn executor(arguments: &Arguments, scheduler_port: u16, folder: &Path) -> Result<Child> {
    let refused = |e: std::io::Error| Error::new(format!("no executor: {e}"));
    std::fs::create_dir_all(folder).map_err(refused)?;
    let mut command = Command::new(std::env::current_exe().map_err(refused)?);
    command.args(["executor", "--scheduler-port", &scheduler_port.to_string()]);
    command.args(["--threads", &arguments.threads.to_string()]);
    command.args(["--memory-limit", &arguments.memory_limit.to_string()]);
    command.arg("--folder").arg(folder);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).kill_on_drop(true).spawn().map_err(refused)
}

/// One line for whoever started it, at once: programs wait for it.
fn say(line: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}")
        .and_then(|()| out.flush())
        .map_err(|e| Error::new(format!("standard output: {e}")))
}

async fn interrupted() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        if let Ok(mut asked) = signal(SignalKind::terminate()) {
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {}
                _ = asked.recv() => {}
            }
            return;
        }
    }
    let _ = tokio::signal::ctrl_c().await;
}
