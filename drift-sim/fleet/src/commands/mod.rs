//! The commands of `drift fleet`: one file each.

pub mod calibrate;
pub mod monitor;
pub mod reading;
pub mod scan;
pub mod sql;

use datafusion::arrow::array::{Array, ArrayRef, AsArray};
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::DataType;
use datafusion::prelude::SessionContext;
use drift_sim::Result;
use futures::StreamExt;

use crate::from_engine;

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
fn all_judged(refused: impl Iterator<Item = String>) -> std::process::ExitCode {
    let refused: Vec<String> = refused.collect();
    let Some(first) = refused.first() else { return std::process::ExitCode::SUCCESS };
    let more = refused.len() - 1;
    let more = if more > 0 { format!(" (and {more} more loops)") } else { String::new() };
    eprintln!("error: not judged: {first}{more}");
    std::process::ExitCode::from(1)
}

/// The command `drift`: beside this program, or else on PATH.
pub fn drift() -> std::path::PathBuf {
    let name = format!("drift{}", std::env::consts::EXE_SUFFIX);
    let beside = std::env::current_exe().ok().map(|own| own.with_file_name(&name));
    beside.filter(|path| path.is_file()).unwrap_or_else(|| name.into())
}
