//! What lies in files as the table `samples`: `loop`, `t`, `r`, `y`, `u`, and every other column under its own name. Parquet and CSV; folders, also
//! partitioned ones (`tag=FIC101/day=3/part.parquet`), whose keys are columns.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use datafusion::arrow::datatypes::{DataType, Field, Schema};
use datafusion::common::{Column, ScalarValue};
use datafusion::datasource::file_format::file_compression_type::FileCompressionType;
use datafusion::logical_expr::{Expr, SortExpr, col, lit};
use datafusion::prelude::{CsvReadOptions, DataFrame, ParquetReadOptions, SessionContext};
use drift_sim::recording::{ColumnMap, ReadOptions, When};
use drift_sim::{Error, Result};

use crate::from_engine;

/// The table's name.
pub const TABLE: &str = "samples";

/// Where the data lie and which of their columns is what.
#[derive(Debug, Clone, Default)]
pub struct Source {
    /// Files and folders, all Parquet or all CSV.
    pub paths: Vec<PathBuf>,
    /// The column that says which loop a row belongs to.
    pub loop_column: String,
    /// The columns of the signals where they are named.
    pub columns: Option<ColumnMap>,
    /// Conditions that all hold where a loop is closed.
    pub when: Vec<String>,
    /// The rows of each file are sorted by loop and time: nothing is sorted then.
    pub is_sorted: bool,
}

/// What was found of the columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The data's names of t, r, y and u.
    pub columns: ColumnMap,
    /// Columns that say where a loop is closed, and what is said of them.
    pub closed: Vec<(String, String)>,
}

impl Found {
    /// The arguments behind u of drift's aggregates, as SQL: the columns that say where a loop is closed, and the name of the time column
    /// where its unit could count.
    pub fn further_arguments(&self) -> String {
        self.further().iter().map(|argument| format!(", {argument}")).collect()
    }

    /// The same as columns of a query, each under a name of its own.
    pub fn further_columns(&self) -> String {
        let numbered = self.further().into_iter().enumerate();
        numbered.map(|(number, argument)| format!(", {argument} AS \"argument {number}\"")).collect()
    }

    fn further(&self) -> Vec<String> {
        let time = self.columns.t.as_deref().filter(|t| *t != "t");
        let time = time.into_iter().flat_map(|t| [literal("t"), literal(t)]);
        let closed = self.closed.iter().flat_map(|(name, column)| [literal(name), identifier(column)]);
        time.chain(closed).collect()
    }
}

/// Text as SQL has it.
pub fn literal(text: &str) -> String {
    format!("'{}'", text.replace('\'', "''"))
}

fn identifier(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Parquet,
    /// With its delimiter; packed or not.
    Csv(u8, bool),
}

impl Source {
    /// Makes the table `samples` known to a session.
    ///
    /// # Errors
    /// There are no such files, they are of several formats, or a column can't be told.
    pub async fn register(&self, session: &SessionContext) -> Result<Found> {
        let files: Vec<PathBuf> = self.paths.iter().map(|path| first_file(path)).collect::<Result<_>>()?;
        let (Some(first), Some(root)) = (files.first(), self.paths.first()) else {
            return Err(Error::new("no data").allowed("Parquet or CSV files, or folders of them"));
        };
        let format = format(first)?;
        for file in &files {
            if self::format(file)? != format {
                return Err(Error::new("not of the same format as the first file").in_file(file));
            }
        }
        for path in &self.paths {
            every_file(path, &mut |file| {
                if Kind::of(file) == Kind::of(first) {
                    return Ok(());
                }
                // The engine would pass over it without a word.
                let others = first.extension().unwrap_or_default().to_string_lossy();
                Err(Error::new(format!("among .{others} files")).allowed("files of one format").in_file(file))
            })?;
        }
        let keys = partition_keys(root, first);
        let order = self.is_sorted;
        let plain = read(session, &self.paths, format, &keys, None)
            .await
            .map_err(|e| from_engine(&e).in_file(first))?;
        let names: Vec<String> = plain.schema().fields().iter().map(|f| f.name().clone()).collect();
        let found = self.found(&names).map_err(|e| e.in_file(first))?;
        let data = if order {
            let by = [Some(self.loop_column.as_str()), found.columns.t.as_deref()];
            let by: Vec<SortExpr> =
                by.into_iter().flatten().map(|name| named(name).sort(true, false)).collect();
            read(session, &self.paths, format, &keys, Some(by))
                .await
                .map_err(|e| from_engine(&e).in_file(first))?
        } else {
            plain
        };
        let table = data.select(self.projection(&found, &names)).map_err(|e| from_engine(&e))?;
        session.register_table(TABLE, table.into_view()).map_err(|e| from_engine(&e))?;
        Ok(found)
    }

    fn found(&self, names: &[String]) -> Result<Found> {
        if names.is_empty() {
            return Err(Error::new("the file is empty").allowed("a line of names, and rows below it"));
        }
        if !names.contains(&self.loop_column) {
            let there = names.join(", ");
            let what = format!("no column '{}' that names the loops", self.loop_column);
            return Err(Error::new(what).allowed(format!("--loop-column with one of {there}")));
        }
        let others: Vec<String> = names.iter().filter(|name| **name != self.loop_column).cloned().collect();
        let when = self.when.iter().map(|text| text.parse()).collect::<Result<Vec<When>>>()?;
        let options = ReadOptions {
            columns: self.columns.clone().unwrap_or_default(),
            when: when.clone(),
            ..ReadOptions::default()
        };
        let (columns, closed) = ColumnMap::among(&others, &options)?;
        match columns.t.as_deref() {
            None => return Err(Error::new("no column of time stamps").allowed("--columns t=NAME")),
            Some(t) if !others.iter().any(|name| name == t) => {
                return Err(Error::new(format!("the time stands in two columns, {t}"))
                    .allowed("a fleet takes one column of time stamps"));
            }
            _ => {}
        }
        let closed = if self.when.is_empty() {
            closed.into_iter().map(|name| (name.clone(), name)).collect()
        } else {
            // `always` looks at no column.
            let said = self.when.iter().cloned().zip(when.into_iter().map(|when| when.column));
            said.filter(|(_, column)| names.contains(column)).collect()
        };
        Ok(Found { columns, closed })
    }

    /// `loop`, `t`, `r`, `y`, `u` and the other columns by their own names.
    fn projection(&self, found: &Found, names: &[String]) -> Vec<Expr> {
        let map = &found.columns;
        let t = map.t.as_deref().unwrap_or_default();
        let r = if map.r.is_empty() { lit(ScalarValue::Float64(None)) } else { named(&map.r) };
        let mut columns = vec![
            named(&self.loop_column).alias("loop"),
            named(t).alias("t"),
            r.alias("r"),
            named(&map.y).alias("y"),
            named(&map.u).alias("u"),
        ];
        let taken = ["loop", "t", "r", "y", "u"];
        let used = [self.loop_column.as_str(), t, &map.r, &map.y, &map.u];
        let free =
            names.iter().filter(|name| !taken.contains(&name.as_str()) && !used.contains(&name.as_str()));
        columns.extend(free.map(|name| named(name)));
        columns
    }
}

/// A column by exactly this name.
fn named(name: &str) -> Expr {
    col(Column::from_name(name))
}

async fn read(
    session: &SessionContext,
    paths: &[PathBuf],
    format: Format,
    keys: &[(String, DataType)],
    order: Option<Vec<SortExpr>>,
) -> datafusion::error::Result<DataFrame> {
    let paths: Vec<String> = paths.iter().map(|path| path.to_string_lossy().into_owned()).collect();
    let order: Vec<Vec<SortExpr>> = order.into_iter().collect();
    match format {
        Format::Parquet => {
            let options = ParquetReadOptions::default().table_partition_cols(keys.to_vec());
            let options = ParquetReadOptions { file_sort_order: order, ..options };
            session.read_parquet(paths, options).await
        }
        Format::Csv(delimiter, is_packed) => {
            let options = |order| {
                let options = CsvReadOptions::new().delimiter(delimiter);
                let options = options.table_partition_cols(keys.to_vec()).file_sort_order(order);
                if is_packed {
                    options.file_extension(".csv.gz").file_compression_type(FileCompressionType::GZIP)
                } else {
                    options
                }
            };
            let seen = session.read_csv(paths.clone(), options(Vec::new())).await?;
            // A column that begins with whole numbers may go on with others.
            let is_key = |name: &String| keys.iter().any(|(key, _)| key == name);
            let widened = |field: &Arc<Field>| match field.data_type() {
                DataType::Int64 => Field::new(field.name(), DataType::Float64, true),
                _ => field.as_ref().clone().with_nullable(true),
            };
            let own = seen.schema().fields().iter().filter(|field| !is_key(field.name()));
            let schema = Schema::new(own.map(widened).collect::<Vec<Field>>());
            session.read_csv(paths, options(order).schema(&schema)).await
        }
    }
}

/// What the engine knows a file's format by: the end of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Parquet,
    Csv,
    PackedCsv,
    Other,
}

impl Kind {
    fn of(file: &Path) -> Self {
        let name = file.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
        match name {
            name if name.ends_with(".parquet") => Self::Parquet,
            name if name.ends_with(".csv") => Self::Csv,
            name if name.ends_with(".csv.gz") => Self::PackedCsv,
            _ => Self::Other,
        }
    }
}

/// Takes every file within a folder, in the order of names, but for those that lakes keep for themselves (`_SUCCESS`, `.crc`); a file
/// is its own.
fn every_file(path: &Path, take: &mut dyn FnMut(&Path) -> Result<()>) -> Result<()> {
    let refused = |e: std::io::Error| Error::of_file("can't be read", &e).in_file(path);
    if !std::fs::metadata(path).map_err(refused)?.is_dir() {
        return take(path);
    }
    let mut within: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(path).map_err(refused)? {
        let entry = entry.map_err(refused)?;
        if !entry.file_name().to_string_lossy().starts_with(['.', '_']) {
            within.push(entry.path());
        }
    }
    within.sort();
    within.iter().try_for_each(|path| every_file(path, take))
}

/// The first file within a folder.
fn first_file(path: &Path) -> Result<PathBuf> {
    let mut first = None;
    every_file(path, &mut |file| {
        first.get_or_insert_with(|| file.to_path_buf());
        Ok(())
    })?;
    first.ok_or_else(|| Error::new("no file in this folder").in_file(path))
}

/// The keys of a partitioned folder: `tag` and `day` of `tag=FIC101/day=3/part.parquet`.
fn partition_keys(root: &Path, file: &Path) -> Vec<(String, DataType)> {
    let within = file.strip_prefix(root).unwrap_or(Path::new(""));
    let key = |part: &std::ffi::OsStr| Some(part.to_string_lossy().split_once('=')?.0.to_owned());
    let folders = within.parent().into_iter().flat_map(Path::iter);
    folders.filter_map(key).map(|key| (key, DataType::Utf8)).collect()
}

fn format(file: &Path) -> Result<Format> {
    let refused = |e: std::io::Error| Error::of_file("can't be read", &e).in_file(file);
    let mut reader = BufReader::new(File::open(file).map_err(refused)?);
    match Kind::of(file) {
        Kind::Parquet => {
            let mut magic = [0; 4];
            if reader.read_exact(&mut magic).is_err() || &magic != b"PAR1" {
                return Err(Error::new("this is no Parquet file").in_file(file));
            }
            return Ok(Format::Parquet);
        }
        Kind::Csv => {}
        Kind::PackedCsv => return Ok(Format::Csv(b',', true)),
        Kind::Other => {
            return Err(Error::new("neither .parquet nor .csv nor .csv.gz")
                .allowed("drift monitor reads every format, one loop at a time")
                .in_file(file));
        }
    }
    let mut header = Vec::new();
    reader.by_ref().take(1 << 16).read_until(b'\n', &mut header).map_err(refused)?;
    let count = |delimiter: u8| header.iter().filter(|b| **b == delimiter).count();
    let delimiter = [b',', b';', b'\t'].into_iter().max_by_key(|d| count(*d)).unwrap_or(b',');
    Ok(Format::Csv(delimiter, false))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keys_of_a_partitioned_folder_are_columns() {
        let keys = partition_keys(Path::new("/lake"), Path::new("/lake/tag=A/day=3/x.parquet"));
        assert_eq!(keys, [("tag".to_owned(), DataType::Utf8), ("day".to_owned(), DataType::Utf8)]);
    }

    #[test]
    fn what_says_where_a_loop_is_closed_goes_to_the_function() {
        let names: Vec<String> = ["tag", "time_ms", "SP", "PV", "OP", "MODE"].map(str::to_owned).into();
        let source = Source { loop_column: "tag".into(), ..Source::default() };
        let found = source.found(&names).unwrap();
        assert_eq!(found.columns.t.as_deref(), Some("time_ms"));
        assert_eq!(found.further_arguments(), ", 't', 'time_ms', 'MODE', \"MODE\"");
        let source = Source { when: vec!["MODE=AUTO".into()], ..source };
        assert!(source.found(&names).unwrap().further_arguments().ends_with(", 'MODE=AUTO', \"MODE\""));
        let refused = Source::default().found(&names).unwrap_err().to_string();
        assert!(refused.contains("--loop-column with one of tag, time_ms"), "{refused}");
    }
}
