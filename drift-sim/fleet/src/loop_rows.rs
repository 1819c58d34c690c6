//! The rows of one loop as an aggregate is told them, `(loop, t, r, y, u [, 'NAME', column]... ORDER BY t)`: what the names mean, and the recording that
//! they make, piece by piece.

use datafusion::arrow::array::ArrayRef;
use datafusion::arrow::datatypes::DataType;
use datafusion::error::{DataFusionError, Result};
use drift_sim::recording::{ColumnMap, FedRecording, Piece, ReadOptions};

use crate::cells::{cells, loop_name, text_at};

/// What a held row takes, bytes.
const ROW_BYTES: usize = 160;
/// Rows that a loop holds at most before its sampling is known.
const HEAD_ROWS: usize = 10_000;

/// What the rows of a loop hold at most before their sampling is known, in bytes.
pub fn held_bytes(rows: usize) -> usize {
    ROW_BYTES * rows.min(HEAD_ROWS)
}

/// Checks the number of a function's arguments, of which some come before the loop's.
///
/// # Errors
/// There are too few, or a name without a column.
pub fn check(function: &str, before: &[&str], arguments: &[DataType]) -> Result<()> {
    let (least, given) = (before.len() + 5, arguments.len());
    if given >= least && (given - least).is_multiple_of(2) {
        return Ok(());
    }
    let first: String = before.iter().map(|name| format!("{name}, ")).collect();
    Err(DataFusionError::Plan(format!(
        "{function} takes ({first}loop, t, r, y, u [, 'NAME', column]... ORDER BY t), not {given} arguments"
    )))
}

/// Two partial results of one loop: they can't be put together.
pub fn in_two_partitions(function: &str) -> DataFusionError {
    DataFusionError::Execution(format!(
        "{function} met one loop in two partitions: set datafusion.execution.target_partitions = 1, or use `drift fleet`, which keeps \
         loops whole"
    ))
}

/// A loop's recording while its rows come in.
pub struct LoopRows {
    /// The loop.
    pub name: String,
    /// What has come in.
    pub fed: FedRecording,
    columns: Vec<String>,
}

impl LoopRows {
    /// Of the loop that these arguments are of, from the loop's name on.
    ///
    /// # Errors
    /// A name means nothing.
    pub fn begin(values: &[ArrayRef]) -> Result<Self> {
        let name = values.first().map_or(Ok(String::new()), loop_name)?;
        let (columns, options) = named_columns(values.get(1..).unwrap_or(&[]))?;
        let fed = FedRecording::new(&name, &options).map_err(crate::to_engine)?;
        Ok(Self { name, fed, columns })
    }

    /// These arguments' rows.
    ///
    /// # Errors
    /// A column is of a type that nothing can be read from.
    pub fn piece(&self, values: &[ArrayRef]) -> Result<Piece> {
        piece(values.get(1..).unwrap_or(&[]), &self.columns)
    }
}

/// The names of the columns t, r, y, u and those after them, and how they are read. `values` begin with t.
///
/// # Errors
/// A name means nothing.
pub fn named_columns(values: &[ArrayRef]) -> Result<(Vec<String>, ReadOptions)> {
    let mut names: Vec<String> = ["t", "r", "y", "u"].map(str::to_owned).into();
    let mut options = ReadOptions::default();
    for pair in values.get(4..).unwrap_or(&[]).chunks_exact(2) {
        let [name, column] = pair else { continue };
        let name = text_at(name, 0)?;
        if name == "t" {
            let time = text_at(column, 0)?;
            let pairs = [("t", time.as_str()), ("r", "r"), ("y", "y"), ("u", "u")];
            let pairs = pairs.map(|(signal, column)| (signal.to_owned(), column.to_owned()));
            options.columns = ColumnMap::of(pairs).map_err(crate::to_engine)?;
            if let Some(first) = names.first_mut() {
                *first = time;
            }
        } else if name.contains(['=', '<', '>', '!']) {
            let condition: drift_sim::recording::When = name.parse().map_err(crate::to_engine)?;
            names.push(name.split(['=', '<', '>', '!']).next().unwrap_or_default().trim().to_owned());
            options.when.push(condition);
        } else {
            names.push(name);
        }
    }
    Ok((names, options))
}

/// Rows as a piece of a recording.
///
/// # Errors
/// A column is of a type that nothing can be read from.
pub fn piece(values: &[ArrayRef], names: &[String]) -> Result<Piece> {
    let signals = values.iter().take(4);
    let rest = values.get(4..).unwrap_or(&[]);
    let conditions = rest.chunks_exact(2).filter_map(|pair| match pair {
        [name, column] if text_at(name, 0).is_ok_and(|name| name != "t") => Some(column),
        _ => None,
    });
    let columns = signals.chain(conditions).zip(names);
    columns.map(|(column, name)| Ok((name.clone(), cells(column)?))).collect()
}
