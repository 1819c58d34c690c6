//! Many loops at once: drift's monitor over the rows of thousands of loops in Parquet and CSV, on DataFusion, without holding the data.
//!
//! * [`samples`]: what lies in files becomes the table `samples`: loop, t, r, y, u and what says where a loop is closed.
//! * [`session`]: a query engine with a bound on its memory that knows the functions and keeps each loop whole ([`whole_loops`]).
//! * [`loop_rows`]: the rows of one loop as a function is told them. [`loop_run`]: one loop's monitor, told its rows batch by batch; [`verdict`] is what it ends with, [`costs`] what it costs.
//! * [`verdict_function`], [`block_function`]: the aggregates `drift_verdict` and `drift_block`; [`cells`] hands them Arrow's arrays.
//! * [`baselines`]: one file a loop. [`calibration`]: learns them.
//! * [`stretches`]: the stretches of a loop that are worth a diagnosis; [`scan`]: the aggregate `drift_stretches`.
//! * [`page`]: the plant on one page. [`table_file`]: results as Parquet.
#![forbid(unsafe_code)]

pub mod baselines;
pub mod block_function;
pub mod calibration;
pub mod cells;
pub mod commands;
pub mod costs;
pub mod loop_rows;
pub mod loop_run;
pub mod page;
pub mod samples;
pub mod scan;
pub mod session;
pub mod stretches;
pub mod table_file;
pub mod verdict;
pub mod verdict_function;
pub mod whole_loops;

use datafusion::error::DataFusionError;

/// An error of drift as the query engine passes it on.
pub fn to_engine(error: drift_sim::Error) -> DataFusionError {
    DataFusionError::External(Box::new(error))
}

/// What the query engine refused, in one line.
pub fn from_engine(error: &DataFusionError) -> drift_sim::Error {
    let root = error.find_root();
    if let DataFusionError::External(inner) = root
        && let Some(own) = inner.downcast_ref::<drift_sim::Error>()
    {
        return own.clone();
    }
    let text = root.strip_backtrace();
    drift_sim::Error::new(text.lines().next().unwrap_or("the query failed").to_owned())
}
