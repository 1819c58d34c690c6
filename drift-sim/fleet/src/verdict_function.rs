//! `drift_verdict(baselines, loop, t, r, y, u [, 'NAME', column]... ORDER BY t)`: the monitor over the rows of one loop.
//!
//! An aggregate whose state is one loop's monitor, told the rows in the order of time. `baselines` is the folder of [`crate::baselines`]; a
//! further column says where the loop is closed, under the name that it has in the data (`'MODE', mode`), which decides what its values
//! mean, as in `drift monitor`; `'MODE=AUTO', mode` states it. `'t', 'time_ms'` tells the name of the time column, whose unit counts.
//!
//! A monitor can't be put together from halves: where two partial results of one loop meet, the query is refused in words and never answered
//! wrongly. [`crate::whole_loops`] plans queries so that this doesn't happen.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use datafusion::arrow::array::{Array, ArrayRef, AsArray, StructArray};
use datafusion::arrow::datatypes::{DataType, Field, FieldRef};
use datafusion::common::ScalarValue;
use datafusion::error::Result;
use datafusion::logical_expr::function::{AccumulatorArgs, StateFieldsArgs};
use datafusion::logical_expr::{Accumulator, AggregateUDFImpl, Signature, Volatility};

use crate::baselines;
use crate::cells::{loop_name, text_at};
use crate::loop_rows::{self, named_columns, piece};
use crate::loop_run::{LoopRun, Reports};
use crate::verdict::Verdict;

/// Its name in SQL.
pub const NAME: &str = "drift_verdict";

/// The aggregate.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct DriftVerdict {
    signature: Signature,
    reports: Option<Reports>,
}

impl DriftVerdict {
    /// Without reports of single loops.
    pub fn new() -> Self {
        Self { signature: Signature::variadic_any(Volatility::Stable), reports: None }
    }

    /// That also writes a page for each loop: for queries within this process.
    pub fn with_reports(reports: Option<Reports>) -> Self {
        Self { reports, ..Self::new() }
    }
}

impl Default for DriftVerdict {
    fn default() -> Self {
        Self::new()
    }
}

impl AggregateUDFImpl for DriftVerdict {
    fn name(&self) -> &str {
        NAME
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, arguments: &[DataType]) -> Result<DataType> {
        loop_rows::check(NAME, &["baselines"], arguments)?;
        Ok(DataType::Struct(Verdict::fields()))
    }

    fn accumulator(&self, _: AccumulatorArgs) -> Result<Box<dyn Accumulator>> {
        Ok(Box::new(Judge { reports: self.reports.clone(), state: State::Nothing, rows: 0 }))
    }

    fn state_fields(&self, args: StateFieldsArgs) -> Result<Vec<FieldRef>> {
        let verdict = DataType::Struct(Verdict::fields());
        Ok(vec![Field::new(format!("{}[verdict]", args.name), verdict, true).into()])
    }
}

/// Judges one loop.
#[derive(Debug)]
struct Judge {
    reports: Option<Reports>,
    state: State,
    rows: usize,
}

/// The engine wants to share what it never uses from two threads at once: hence the lock, which nobody waits for.
enum State {
    Nothing,
    Watching {
        run: Box<Mutex<LoopRun>>,
        names: Vec<String>,
    },
    /// Judged, or known not to be judgeable.
    Judged(Box<Verdict>),
}

impl std::fmt::Debug for State {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Nothing => "Nothing",
            Self::Watching { .. } => "Watching",
            Self::Judged(_) => "Judged",
        })
    }
}

impl Judge {
    fn begin(&self, values: &[ArrayRef]) -> Result<State> {
        let [baselines, name, ..] = values else { return Ok(State::Nothing) };
        let (folder, name) = (text_at(baselines, 0)?, loop_name(name)?);
        let baseline = match baselines::read(Path::new(&folder), &name) {
            Ok(Some(baseline)) => baseline,
            Ok(None) => {
                let why = format!("{} is missing", baselines::path(Path::new(&folder), &name).display());
                return Ok(State::Judged(Box::new(Verdict::without("no_baseline", why))));
            }
            Err(error) => return Ok(refused(&error)),
        };
        let (names, options) = named_columns(values.get(2..).unwrap_or(&[]))?;
        Ok(match LoopRun::new(&name, baseline, &options, self.reports.clone()) {
            Ok(run) => State::Watching { run: Box::new(Mutex::new(run)), names },
            Err(error) => refused(&error),
        })
    }

    fn end(&mut self) -> Result<ScalarValue> {
        match std::mem::replace(&mut self.state, State::Nothing) {
            State::Nothing => ScalarValue::try_from(DataType::Struct(Verdict::fields())),
            State::Judged(verdict) => verdict.to_scalar(),
            State::Watching { run, .. } => {
                let run = run.into_inner().unwrap_or_else(PoisonError::into_inner);
                run.finish().unwrap_or_else(|error| Verdict::without("error", error.to_string())).to_scalar()
            }
        }
    }
}

fn refused(error: &drift_sim::Error) -> State {
    State::Judged(Box::new(Verdict::without("error", error.to_string())))
}

impl Accumulator for Judge {
    fn update_batch(&mut self, values: &[ArrayRef]) -> Result<()> {
        let rows = values.first().map_or(0, |v| v.len());
        if rows == 0 {
            return Ok(());
        }
        if matches!(self.state, State::Nothing) {
            self.state = self.begin(values)?;
        }
        self.rows += rows;
        let failed = match &mut self.state {
            State::Watching { run, names } => {
                let rows = piece(values.get(2..).unwrap_or(&[]), names)?;
                run.get_mut().unwrap_or_else(PoisonError::into_inner).push(rows).err()
            }
            _ => None,
        };
        if let Some(error) = failed {
            self.state = refused(&error);
        }
        Ok(())
    }

    fn evaluate(&mut self) -> Result<ScalarValue> {
        self.end()
    }

    fn size(&self) -> usize {
        let held = match self.state {
            State::Watching { .. } => 65_536 + loop_rows::held_bytes(self.rows),
            _ => 0,
        };
        size_of::<Self>() + held
    }

    fn state(&mut self) -> Result<Vec<ScalarValue>> {
        Ok(vec![self.end()?])
    }

    fn merge_batch(&mut self, states: &[ArrayRef]) -> Result<()> {
        let Some(verdicts) = states.first().and_then(|s| s.as_any().downcast_ref::<StructArray>()) else {
            return Ok(());
        };
        for row in 0..verdicts.len() {
            // An empty half is a struct whose fields are all null.
            let is_empty = verdicts.is_null(row)
                || verdicts
                    .column_by_name("status")
                    .is_none_or(|status| status.as_string::<i32>().is_null(row));
            if is_empty {
                continue;
            }
            if !matches!(self.state, State::Nothing) {
                return Err(loop_rows::in_two_partitions(NAME));
            }
            self.state = State::Judged(Box::new(Verdict::from_row(verdicts, row)?));
        }
        Ok(())
    }
}
