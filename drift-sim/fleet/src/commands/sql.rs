//! `drift fleet sql`: drift's functions in a query of one's own.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use datafusion::arrow::util::pretty::pretty_format_batches;
use datafusion::dataframe::DataFrameWriteOptions;
use datafusion::prelude::SessionContext;
use drift_sim::{Error, Result, output};

use super::reading::Reading;
use crate::{from_engine, session};

/// Asks one's own question in SQL: the table `samples` has loop, t, r, y, u and the data's other columns; drift_verdict, drift_block,
/// drift_stretches and drift_baseline are functions.
#[derive(Args, Debug, Clone)]
#[command(after_help = "\
Examples:
  drift fleet sql lake/ --loop-column tag --query \"SELECT loop, count(*) FROM samples GROUP BY loop\"
  drift fleet sql lake/ --loop-column tag --query \"SELECT loop, floor(t / 3600) AS hour, drift_block(t, r, y, u)['mean_u'] AS u FROM samples GROUP BY 1, 2\" --parquet hours.parquet")]
pub struct Arguments {
    #[command(flatten)]
    /// Where the data lie and how they are read.
    pub reading: Reading,
    /// The question
    #[arg(long, value_name = "SQL")]
    query: String,
    /// Write the answer as Parquet, without holding it, instead of as a table on the screen
    #[arg(long, value_name = "FILE.parquet")]
    parquet: Option<PathBuf>,
}

impl Arguments {
    /// Runs the command on a session that knows drift's functions.
    ///
    /// # Errors
    /// The data can't be read, the query fails, an output can't be written.
    pub async fn run_on(&self, session: &SessionContext) -> Result<ExitCode> {
        self.reading.outputs(&[("--parquet", self.parquet.as_deref())])?;
        self.reading.source().register(session).await?;
        let query = session.sql(&self.query).await.map_err(|e| from_engine(&e))?;
        if let Some(path) = &self.parquet {
            if path.exists() {
                return Err(Error::new("there is a file of this name")
                    .allowed("a name that is free")
                    .in_file(path));
            }
            let name = path.to_string_lossy();
            let one_file = DataFrameWriteOptions::new().with_single_file_output(true);
            query.write_parquet(&name, one_file, None).await.map_err(|e| from_engine(&e).in_file(path))?;
            return Ok(ExitCode::SUCCESS);
        }
        let batches = query.collect().await.map_err(|e| from_engine(&e))?;
        let table = pretty_format_batches(&batches).map_err(|e| from_engine(&e.into()))?;
        output::write_text(Path::new("-"), &format!("{table}\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Runs the command within this process.
///
/// # Errors
/// As [`Arguments::run_on`].
pub async fn run(arguments: &Arguments) -> Result<ExitCode> {
    let session = session::session(&arguments.reading.engine(), None).map_err(|e| from_engine(&e))?;
    arguments.run_on(&session).await
}
