//! `drift fleet calibrate`: a baseline for each loop.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use datafusion::arrow::array::{Array, AsArray};
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::DataType;
use datafusion::logical_expr::AggregateUDF;
use drift_sim::calibrate::Options;
use drift_sim::{Error, Result, output};
use futures::StreamExt;

use super::reading::Reading;
use crate::calibration::{DriftBaseline, NAME, REFUSED, Request};
use crate::{baselines, from_engine, session};

/// Learns what healthy looks like of every loop: one LOOP.toml each, as `drift calibrate` writes it.
///
/// A loop that can't be calibrated is named with the reason, and the others go on; exit code 1 where there was one.
#[derive(Args, Debug, Clone)]
#[command(after_help = "\
Examples:
  drift fleet calibrate healthy/ --loop-column tag -o baselines/
  drift fleet calibrate may.parquet --loop-column tag --false-alarm-every 720 -o baselines/")]
pub struct Arguments {
    #[command(flatten)]
    reading: Reading,
    /// The folder for the baselines; those of other loops that lie in it stay
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Window in seconds, for all loops; by default 20 correlation times of each
    #[arg(long, value_name = "S")]
    window: Option<f64>,
    /// Wanted mean time between false alarms of one loop. 10 000 loops at one a day each are 10 000 false alarms a day
    #[arg(long, value_name = "HOURS", default_value_t = 720.0)]
    false_alarm_every: f64,
    /// Samples of each loop that are taken at most, from its beginning
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1000..=50_000_000))]
    most_samples: u32,
}

/// Runs the command.
///
/// # Errors
/// The data can't be read, the query fails, a baseline can't be written.
pub async fn run(arguments: &Arguments) -> Result<ExitCode> {
    let session = session::session(&arguments.reading.engine(), None).map_err(|e| from_engine(&e))?;
    let found = arguments.reading.source().register(&session).await?;
    let options = Options {
        window_s: arguments.window,
        false_alarm_every_h: arguments.false_alarm_every,
        ..Options::default()
    };
    let request = Request { options, most_samples: arguments.most_samples as usize };
    session.register_udaf(AggregateUDF::from(DriftBaseline::new(request)));
    std::fs::create_dir_all(&arguments.output)
        .map_err(|e| Error::of_file("can't be made", &e).in_file(&arguments.output))?;
    let further = found.further_arguments();
    let sql = format!("SELECT loop, {NAME}(loop, t, r, y, u{further} ORDER BY t) FROM samples GROUP BY loop");
    let query = session.sql(&sql).await.map_err(|e| from_engine(&e))?;
    let mut batches = query.execute_stream().await.map_err(|e| from_engine(&e))?;
    let (mut learnt, mut refused) = (0_u64, 0_u64);
    while let Some(batch) = batches.next().await {
        let batch = batch.map_err(|e| from_engine(&e))?;
        let text = |at: usize| cast(batch.column(at), &DataType::Utf8).map_err(|e| from_engine(&e.into()));
        let (names, baselines) = (text(0)?, text(1)?);
        let (Some(names), Some(baselines)) = (names.as_string_opt::<i32>(), baselines.as_string_opt::<i32>())
        else {
            return Err(Error::new("the query's columns are no text"));
        };
        for row in 0..names.len() {
            match baselines.value(row).strip_prefix(REFUSED) {
                Some(why) => {
                    eprintln!("{why}");
                    refused += 1;
                }
                None => {
                    output::write_text(
                        &baselines::path(&arguments.output, names.value(row)),
                        baselines.value(row),
                    )?;
                    learnt += 1;
                }
            }
        }
    }
    if learnt + refused == 0 {
        return Err(arguments.reading.no_rows());
    }
    let folder = arguments.output.display();
    println!(
        "{learnt} baselines in {folder}{}",
        if refused > 0 { format!(", {refused} loops without one") } else { String::new() }
    );
    Ok(ExitCode::from(u8::from(refused > 0)))
}
