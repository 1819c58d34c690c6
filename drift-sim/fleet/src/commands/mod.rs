//! The commands of `drift fleet`: one file each.

pub mod calibrate;
pub mod monitor;
pub mod reading;
pub mod scan;
pub mod sql;

use std::future::Future;
use std::process::ExitCode;

use datafusion::arrow::array::{Array, ArrayRef, AsArray};
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::DataType;
use datafusion::prelude::SessionContext;
use drift_sim::{Error, Result};
use futures::StreamExt;

use crate::from_engine;

/// Runs a program's work to its end; what it refused is one line on standard error, and 1 is the exit code then.
pub fn run_to_end(work: impl Future<Output = Result<ExitCode>>) -> ExitCode {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    let done = runtime.map_err(|e| Error::new(format!("no threads: {e}"))).and_then(|runtime| {
        let done = runtime.block_on(work);
        // What still waits for the network or for standard input must not hold the process.
        runtime.shutdown_background();
        done
    });
    done.unwrap_or_else(|error| {
        eprintln!("error: {error}");
        ExitCode::from(1)
    })
}

/// Work that Ctrl-C ends: the process exits with 130, and no output is left half written.
///
/// # Errors
/// Those of the work.
pub async fn until_interrupted(work: impl Future<Output = Result<ExitCode>>) -> Result<ExitCode> {
    tokio::select! {
        done = work => done,
        _ = tokio::signal::ctrl_c() => {
            drift_sim::output::remove_unfinished();
            std::process::exit(130)
        }
    }
}

/// The loops of a query with what is read of the second column's value of each; `None` is left out.
async fn by_loop<T>(
    session: &SessionContext,
    sql: &str,
    of: impl Fn(&ArrayRef, usize) -> datafusion::error::Result<Option<T>>,
) -> Result<Vec<(String, T)>> {
    let query = session.sql(sql).await.map_err(|e| from_engine(&e))?;
    let mut batches = query.execute_stream().await.map_err(|e| from_engine(&e))?;
    let mut loops = Vec::new();
    while let Some(batch) = batches.next().await {
        let batch = batch.map_err(|e| from_engine(&e))?;
        let names = cast(batch.column(0), &DataType::Utf8).map_err(|e| from_engine(&e.into()))?;
        let names = names.as_string::<i32>();
        for row in 0..batch.num_rows() {
            let name = if names.is_valid(row) { names.value(row) } else { "" };
            if let Some(value) = of(batch.column(1), row).map_err(|e| from_engine(&e))? {
                loops.push((name.to_owned(), value));
            }
        }
    }
    Ok(loops)
}

/// The exit code of a command over loops of which these could not be judged, and a line for them.
fn all_judged(refused: impl Iterator<Item = String>) -> ExitCode {
    let refused: Vec<String> = refused.collect();
    let Some(first) = refused.first() else { return ExitCode::SUCCESS };
    let more = refused.len() - 1;
    let more = if more > 0 { format!(" (and {more} more loops)") } else { String::new() };
    eprintln!("error: not judged: {first}{more}");
    ExitCode::from(1)
}

/// The command `drift`: beside this program, or else on PATH.
pub fn drift() -> std::path::PathBuf {
    let name = format!("drift{}", std::env::consts::EXE_SUFFIX);
    let beside = std::env::current_exe().ok().map(|own| own.with_file_name(&name));
    beside.filter(|path| path.is_file()).unwrap_or_else(|| name.into())
}
