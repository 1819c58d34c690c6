//! `drift_stretches(loop, t, r, y, u [, 'NAME', column]... ORDER BY t)`: where a loop's rows are worth a diagnosis ([`crate::stretches`]), as a
//! list of structs (kind, from_s, to_s, score).

use std::sync::{Arc, Mutex, PoisonError};

use datafusion::arrow::array::{Array, ArrayRef, AsArray, StructArray};
use datafusion::arrow::datatypes::{DataType, Field, FieldRef, Fields, Float64Type};
use datafusion::common::ScalarValue;
use datafusion::error::{DataFusionError, Result};
use datafusion::logical_expr::function::{AccumulatorArgs, StateFieldsArgs};
use datafusion::logical_expr::{Accumulator, AggregateUDFImpl, Signature, Volatility};

use crate::loop_rows::{self, LoopRows};
use crate::stretches::{Finder, Stretch};

/// Its name in SQL.
pub const NAME: &str = "drift_stretches";

/// The kind of the one row that stands for a loop whose rows can't be read; `what` says why.
pub const ERROR: &str = "error";

/// The fields of a stretch.
fn fields() -> Fields {
    let number = |name: &str| Field::new(name, DataType::Float64, true);
    let text = |name: &str| Field::new(name, DataType::Utf8, true);
    Fields::from(vec![text("kind"), number("from_s"), number("to_s"), number("score"), text("what")])
}

fn list_type() -> DataType {
    DataType::List(Arc::new(Field::new("item", DataType::Struct(fields()), true)))
}

/// One row of the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// A kind's name, or [`ERROR`].
    pub kind: String,
    /// First and last sample, s, and how clear it is; none of an error.
    pub span: Option<(f64, f64, f64)>,
    /// Why a loop's rows can't be read.
    pub what: Option<String>,
}

impl From<&Stretch> for Found {
    fn from(of: &Stretch) -> Self {
        Self { kind: of.kind.name().to_owned(), span: Some((of.from_s, of.to_s, of.score)), what: None }
    }
}

impl Found {
    fn to_scalar(&self) -> Result<ScalarValue> {
        let number = |of: fn(&(f64, f64, f64)) -> f64| ScalarValue::Float64(self.span.as_ref().map(of));
        let values = [
            ScalarValue::Utf8(Some(self.kind.clone())),
            number(|s| s.0),
            number(|s| s.1),
            number(|s| s.2),
            ScalarValue::Utf8(self.what.clone()),
        ];
        let columns = values.iter().map(ScalarValue::to_array).collect::<Result<Vec<_>>>()?;
        Ok(ScalarValue::Struct(Arc::new(StructArray::try_new(fields(), columns, None)?)))
    }

    /// The rows of one loop's list.
    ///
    /// # Errors
    /// It is another kind of list.
    pub fn of_list(list: &ArrayRef) -> Result<Vec<Self>> {
        let rows =
            list.as_struct_opt().ok_or_else(|| DataFusionError::Execution("no list of stretches".into()))?;
        let column = |at: usize| rows.columns().get(at);
        let text = |at: usize, row: usize| {
            let values = column(at)?.as_string_opt::<i32>()?;
            values.is_valid(row).then(|| values.value(row).to_owned())
        };
        let number = |at: usize, row: usize| {
            let values = column(at)?.as_primitive_opt::<Float64Type>()?;
            values.is_valid(row).then(|| values.value(row))
        };
        let of = |row: usize| Self {
            kind: text(0, row).unwrap_or_default(),
            span: number(1, row).zip(number(2, row)).zip(number(3, row)).map(|((a, b), c)| (a, b, c)),
            what: text(4, row),
        };
        Ok((0..rows.len()).map(of).collect())
    }
}

/// The aggregate.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct DriftStretches {
    signature: Signature,
}

impl DriftStretches {
    /// It has no settings.
    pub fn new() -> Self {
        Self { signature: Signature::variadic_any(Volatility::Immutable) }
    }
}

impl Default for DriftStretches {
    fn default() -> Self {
        Self::new()
    }
}

impl AggregateUDFImpl for DriftStretches {
    fn name(&self) -> &str {
        NAME
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, arguments: &[DataType]) -> Result<DataType> {
        loop_rows::check(NAME, &[], arguments)?;
        Ok(list_type())
    }

    fn accumulator(&self, _: AccumulatorArgs) -> Result<Box<dyn Accumulator>> {
        Ok(Box::new(Searcher { search: None, ended: None, rows: 0 }))
    }

    fn state_fields(&self, args: StateFieldsArgs) -> Result<Vec<FieldRef>> {
        Ok(vec![Field::new(format!("{}[stretches]", args.name), list_type(), true).into()])
    }
}

/// Searches one loop.
struct Searcher {
    /// Never used from two threads at once; the engine wants to share it all the same.
    search: Option<Mutex<Search>>,
    /// What is known already: an error, or what another partition has found.
    ended: Option<Vec<Found>>,
    rows: usize,
}

struct Search {
    rows: LoopRows,
    finder: Finder,
}

impl std::fmt::Debug for Searcher {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Searcher").field("ended", &self.ended).finish_non_exhaustive()
    }
}

impl Search {
    fn begin(values: &[ArrayRef]) -> Result<Self> {
        Ok(Self { rows: LoopRows::begin(values)?, finder: Finder::new() })
    }

    fn take(&mut self) -> drift_sim::Result<()> {
        while let Some(sample) = self.rows.fed.next()? {
            self.finder.sample(&sample);
        }
        Ok(())
    }

    fn finish(mut self) -> drift_sim::Result<Vec<Found>> {
        self.rows.fed.finish()?;
        self.take()?;
        Ok(self.finder.finish().0.iter().map(Found::from).collect())
    }
}

fn refused(error: &drift_sim::Error) -> Vec<Found> {
    vec![Found { kind: ERROR.into(), span: None, what: Some(error.to_string()) }]
}

impl Searcher {
    fn end(&mut self) -> Result<ScalarValue> {
        let found = match (self.ended.take(), self.search.take()) {
            (Some(found), _) => found,
            (None, Some(search)) => {
                let search = search.into_inner().unwrap_or_else(PoisonError::into_inner);
                search.finish().unwrap_or_else(|error| refused(&error))
            }
            (None, None) => return ScalarValue::try_from(list_type()),
        };
        let rows = found.iter().map(Found::to_scalar).collect::<Result<Vec<_>>>()?;
        Ok(ScalarValue::List(ScalarValue::new_list_nullable(&rows, &DataType::Struct(fields()))))
    }
}

impl Accumulator for Searcher {
    fn update_batch(&mut self, values: &[ArrayRef]) -> Result<()> {
        if values.first().is_none_or(|v| v.is_empty()) || self.ended.is_some() {
            return Ok(());
        }
        self.rows += values.first().map_or(0, |v| v.len());
        let search = match &mut self.search {
            Some(search) => search,
            none => none.insert(Mutex::new(Search::begin(values)?)),
        };
        let search = search.get_mut().unwrap_or_else(PoisonError::into_inner);
        let rows = search.rows.piece(values)?;
        if let Err(error) = search.rows.fed.push(rows).and_then(|()| search.take()) {
            self.ended = Some(refused(&error));
            self.search = None;
        }
        Ok(())
    }

    fn evaluate(&mut self) -> Result<ScalarValue> {
        self.end()
    }

    fn size(&self) -> usize {
        size_of::<Self>() + self.search.as_ref().map_or(0, |_| 8_192 + loop_rows::held_bytes(self.rows))
    }

    fn state(&mut self) -> Result<Vec<ScalarValue>> {
        Ok(vec![self.end()?])
    }

    fn merge_batch(&mut self, states: &[ArrayRef]) -> Result<()> {
        let Some(lists) = states.first().and_then(|s| s.as_list_opt::<i32>()) else { return Ok(()) };
        for row in (0..lists.len()).filter(|row| lists.is_valid(*row)) {
            if self.ended.is_some() || self.search.is_some() {
                return Err(loop_rows::in_two_partitions(NAME));
            }
            self.ended = Some(Found::of_list(&lists.value(row))?);
        }
        Ok(())
    }
}
