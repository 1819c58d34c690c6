//! The arguments that say where the data lie and how they are read, the same in every command.

use std::path::{Path, PathBuf};

use clap::Args;
use drift_sim::output::Outputs;
use drift_sim::recording::ColumnMap;
use drift_sim::{Error, Result};

use crate::samples::Source;
use crate::session::Engine;

/// Where the data lie and how they are read.
#[derive(Args, Debug, Clone)]
pub struct Reading {
    /// Parquet or CSV files (.parquet, .csv, .csv.gz), or folders of them, also partitioned ones (tag=FIC101/part.parquet)
    #[arg(required = true, value_name = "DATA")]
    pub data: Vec<PathBuf>,
    /// The column that says which loop a row belongs to
    #[arg(long, value_name = "COLUMN")]
    pub loop_column: String,
    /// Columns of the signals where they are not called t, r, y, u, nor SP, PV, OP and the like, which are guessed; `r=` says that
    /// r is not recorded
    #[arg(long, value_name = "t=time,r=SP,y=PV,u=OP")]
    columns: Option<ColumnMap>,
    /// Where a loop is closed, like MODE=AUTO; elsewhere its samples count as manual. Without it columns called MODE, AUTO, QUALITY and
    /// the like say it
    #[arg(long, value_name = "COLUMN=VALUE")]
    when: Vec<String>,
    /// The rows of every file are sorted by loop and time: nothing is sorted, and memory stays least
    #[arg(long)]
    sorted: bool,
    #[command(flatten)]
    running: Running,
}

/// How the query engine runs.
#[derive(Args, Debug, Clone)]
pub struct Running {
    /// What sorting may take in memory, like 500M or 4G; beyond, it goes to the disk
    #[arg(long, value_name = "BYTES", default_value = "1G", value_parser = bytes)]
    memory_limit: u64,
    /// Parts of the work that run side by side; as many as there are cores by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

impl Reading {
    /// Where the data lie.
    pub fn source(&self) -> Source {
        Source {
            paths: self.data.clone(),
            loop_column: self.loop_column.clone(),
            columns: self.columns.clone(),
            when: self.when.clone(),
            is_sorted: self.sorted,
        }
    }

    /// The outputs of a command, checked before any work: (name of the argument, path).
    ///
    /// # Errors
    /// An output is an input or another output, lies in a folder of data, where the next run would read it, or can't be written.
    pub fn outputs(&self, named: &[(&str, Option<&Path>)]) -> Result<Outputs> {
        let place = |path: &Path| std::path::absolute(path).ok();
        for (name, path) in named.iter().filter_map(|(name, path)| Some((name, (*path)?))) {
            let within = |data: &&PathBuf| {
                data.is_dir()
                    && place(path).zip(place(data)).is_some_and(|(path, data)| path.starts_with(data))
            };
            if let Some(data) = self.data.iter().find(within) {
                let what = format!("{name} would lie among the data in '{}'", data.display());
                return Err(Error::new(what).allowed("another folder").in_file(path));
            }
        }
        let inputs: Vec<&Path> = self.data.iter().map(PathBuf::as_path).collect();
        Outputs::checked(named, &inputs)
    }

    /// What is said of data without any row.
    pub fn no_rows(&self) -> Error {
        let first = self.data.first().cloned().unwrap_or_default();
        Error::new("no rows of data").in_file(first)
    }

    /// How the query engine runs. Sorted rows are taken in their order, by one thread: to divide them would mean to hold those that others
    /// have not reached yet.
    pub fn engine(&self) -> Engine {
        let mut engine = Engine { memory_limit_bytes: self.running.memory_limit, ..Engine::default() };
        if let Some(threads) = self.running.threads {
            engine.threads = usize::from(threads);
        }
        if self.sorted {
            engine.threads = 1;
        }
        engine
    }
}

/// A number of bytes, as `--memory-limit` has it: `500M`, `4G`.
///
/// # Errors
/// It is no number of bytes, or less than 1M.
pub fn bytes(text: &str) -> std::result::Result<u64, String> {
    let lower = text.trim().to_lowercase();
    let number = lower.trim_end_matches(['k', 'm', 'g']);
    let shift = match lower.get(number.len()..).unwrap_or_default() {
        "" => 0,
        "k" => 10,
        "m" => 20,
        "g" => 30,
        _ => return Err("a number of bytes, like 500M or 4G".into()),
    };
    let bytes = number.parse::<u64>().ok().and_then(|number| number.checked_mul(1 << shift));
    bytes
        .filter(|bytes| *bytes >= 1 << 20)
        .ok_or_else(|| "a number of bytes from 1M on, like 500M or 4G".into())
}
