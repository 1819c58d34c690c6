//! `drift_block(t, r, y, u)`: what a block of one loop's samples adds up to: a struct of counts, means and extremes. Grouped by loop and time it
//! turns a year of samples into a table that fits a notebook.
//!
//! The sums add up in any order, so that the engine divides the work as it likes; that also means that the last bits of a mean depend on how
//! the work was divided. The monitor doesn't stand on these sums: it judges samples in their order ([`crate::verdict_function`]), because what a
//! block says depends on the samples before it (blanking after a step of r, an index weighted by time, effort along the motion).

use std::sync::Arc;

use datafusion::arrow::array::{Array, ArrayRef, AsArray, BooleanArray, Float64Array, StructArray};
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::{DataType, Field, FieldRef, Fields, Float64Type, TimeUnit};
use datafusion::common::ScalarValue;
use datafusion::error::{DataFusionError, Result};
use datafusion::logical_expr::function::{AccumulatorArgs, StateFieldsArgs};
use datafusion::logical_expr::{
    Accumulator, AggregateUDFImpl, EmitTo, GroupsAccumulator, Signature, Volatility,
};

/// Its name in SQL.
pub const NAME: &str = "drift_block";

/// Sums of a block, one number each; NaN among the samples enters none.
const SUMS: usize = 14;
/// What each of them is.
const NAMES: [&str; SUMS] = [
    "samples",
    "from_s",
    "to_s",
    "sum_r",
    "sum_y",
    "sum_u",
    "sum_abs_e",
    "sum_e2",
    "sum_u2",
    "sum_e",
    "least_y",
    "greatest_y",
    "least_u",
    "greatest_u",
];

#[derive(Debug, Clone, Copy, PartialEq)]
struct Sums([f64; SUMS]);

impl Sums {
    const EMPTY: Self = {
        let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
        Self([0.0, low, high, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, low, high, low, high])
    };

    #[inline]
    fn add(&mut self, t_s: f64, r: f64, y: f64, u: f64) {
        let e = r - y;
        // One test for all three: e is not finite where r or y isn't.
        if (e + u).is_finite() {
            self.merge(&Self([1.0, t_s, t_s, r, y, u, e.abs(), e * e, u * u, e, y, y, u, u]));
        }
    }

    #[inline]
    fn merge(&mut self, other: &Self) {
        for (at, (mine, theirs)) in self.0.iter_mut().zip(&other.0).enumerate() {
            match at {
                1 | 10 | 12 => *mine = mine.min(*theirs),
                2 | 11 | 13 => *mine = mine.max(*theirs),
                _ => *mine += theirs,
            }
        }
    }

    /// What is told of it: counts, means, roots of mean squares, extremes.
    fn told(&self) -> [f64; TOLD.len()] {
        let [n, from, to, r, y, u, abs_e, e2, u2, e, y_min, y_max, u_min, u_max] = self.0;
        [
            n,
            from,
            to,
            r / n,
            y / n,
            u / n,
            e / n,
            abs_e / n,
            (e2 / n).sqrt(),
            u2 / n,
            y_min,
            y_max,
            u_min,
            u_max,
        ]
    }
}

/// The fields of the result.
const TOLD: [&str; 14] = [
    "samples",
    "from_s",
    "to_s",
    "mean_r",
    "mean_y",
    "mean_u",
    "mean_e",
    "mean_abs_e",
    "rms_e",
    "mean_u2",
    "least_y",
    "greatest_y",
    "least_u",
    "greatest_u",
];

fn fields() -> Fields {
    TOLD.iter().map(|name| Field::new(*name, DataType::Float64, true)).collect()
}

/// The blocks as one column: null where a block has no valid sample.
fn told(blocks: &[Sums]) -> Result<ArrayRef> {
    let is_empty = |block: &Sums| block.0[0] == 0.0;
    let rows: Vec<[f64; TOLD.len()]> = blocks.iter().map(Sums::told).collect();
    let column = |at: usize| -> ArrayRef {
        let cells =
            rows.iter().zip(blocks).map(|(row, block)| row.get(at).copied().filter(|_| !is_empty(block)));
        Arc::new(cells.collect::<Float64Array>())
    };
    Ok(Arc::new(StructArray::try_new(fields(), (0..TOLD.len()).map(column).collect(), None)?))
}

/// Numbers of an array; times as seconds.
fn numbers(array: &ArrayRef) -> Result<Float64Array> {
    let per_second = match array.data_type() {
        DataType::Timestamp(TimeUnit::Millisecond, _) => 1e3,
        DataType::Timestamp(TimeUnit::Microsecond, _) => 1e6,
        DataType::Timestamp(TimeUnit::Nanosecond, _) => 1e9,
        _ => 1.0,
    };
    let plain = if matches!(array.data_type(), DataType::Timestamp(..)) {
        cast(array, &DataType::Int64)?
    } else {
        Arc::clone(array)
    };
    let numbers = cast(&plain, &DataType::Float64)?;
    let numbers = numbers.as_primitive::<Float64Type>().clone();
    Ok(if per_second == 1.0 { numbers } else { numbers.unary(|x| x / per_second) })
}

/// t, r, y and u of some rows.
struct Rows([Float64Array; 4]);

impl Rows {
    fn of(values: &[ArrayRef]) -> Result<Self> {
        let [t, r, y, u] = values else {
            return Err(DataFusionError::Plan(format!("{NAME} takes (t, r, y, u)")));
        };
        Ok(Self([numbers(t)?, numbers(r)?, numbers(y)?, numbers(u)?]))
    }

    fn each(&self, mut take: impl FnMut(usize, f64, f64, f64, f64)) {
        let [t, r, y, u] = &self.0;
        let has_nulls = self.0.iter().any(|x| x.null_count() > 0);
        let columns = t.values().iter().zip(r.values()).zip(y.values().iter().zip(u.values()));
        for (row, ((t, r), (y, u))) in columns.enumerate() {
            if !has_nulls || self.0.iter().all(|x| x.is_valid(row)) {
                take(row, *t, *r, *y, *u);
            }
        }
    }
}

/// Sums as they were handed on.
fn sums_at(states: &[ArrayRef], row: usize) -> Sums {
    let mut sums = Sums::EMPTY;
    for (sum, column) in sums.0.iter_mut().zip(states) {
        if let Some(values) = column.as_primitive_opt::<Float64Type>().filter(|v| v.is_valid(row)) {
            *sum = values.value(row);
        }
    }
    sums
}

/// The aggregate.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct DriftBlock {
    signature: Signature,
}

impl DriftBlock {
    /// It has no settings.
    pub fn new() -> Self {
        Self { signature: Signature::any(4, Volatility::Immutable) }
    }
}

impl Default for DriftBlock {
    fn default() -> Self {
        Self::new()
    }
}

impl AggregateUDFImpl for DriftBlock {
    fn name(&self) -> &str {
        NAME
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(DataType::Struct(fields()))
    }

    fn order_sensitivity(&self) -> datafusion::logical_expr::utils::AggregateOrderSensitivity {
        datafusion::logical_expr::utils::AggregateOrderSensitivity::Insensitive
    }

    fn accumulator(&self, _: AccumulatorArgs) -> Result<Box<dyn Accumulator>> {
        Ok(Box::new(OneBlock(Sums::EMPTY)))
    }

    fn state_fields(&self, args: StateFieldsArgs) -> Result<Vec<FieldRef>> {
        let field = |name: &str| Field::new(format!("{}[{name}]", args.name), DataType::Float64, true).into();
        Ok(NAMES.into_iter().map(field).collect())
    }

    fn groups_accumulator_supported(&self, _: AccumulatorArgs) -> bool {
        true
    }

    fn create_groups_accumulator(&self, _: AccumulatorArgs) -> Result<Box<dyn GroupsAccumulator>> {
        Ok(Box::new(Blocks(Vec::new())))
    }
}

/// One block, where the engine holds one at a time.
#[derive(Debug)]
struct OneBlock(Sums);

impl Accumulator for OneBlock {
    fn update_batch(&mut self, values: &[ArrayRef]) -> Result<()> {
        Rows::of(values)?.each(|_, t, r, y, u| self.0.add(t, r, y, u));
        Ok(())
    }

    fn evaluate(&mut self) -> Result<ScalarValue> {
        ScalarValue::try_from_array(&told(&[self.0])?, 0)
    }

    fn size(&self) -> usize {
        size_of::<Self>()
    }

    fn state(&mut self) -> Result<Vec<ScalarValue>> {
        Ok(self.0.0.iter().map(|sum| ScalarValue::Float64(Some(*sum))).collect())
    }

    fn merge_batch(&mut self, states: &[ArrayRef]) -> Result<()> {
        for row in 0..states.first().map_or(0, |s| s.len()) {
            self.0.merge(&sums_at(states, row));
        }
        Ok(())
    }
}

/// Many blocks.
#[derive(Debug)]
struct Blocks(Vec<Sums>);

impl GroupsAccumulator for Blocks {
    fn update_batch(
        &mut self,
        values: &[ArrayRef],
        groups: &[usize],
        filter: Option<&BooleanArray>,
        count: usize,
    ) -> Result<()> {
        self.0.resize(count, Sums::EMPTY);
        let counts = |row: usize| filter.is_none_or(|f| f.is_valid(row) && f.value(row));
        Rows::of(values)?.each(|row, t, r, y, u| {
            if let Some(block) = groups.get(row).filter(|_| counts(row)).and_then(|g| self.0.get_mut(*g)) {
                block.add(t, r, y, u);
            }
        });
        Ok(())
    }

    fn evaluate(&mut self, emit: EmitTo) -> Result<ArrayRef> {
        told(&emit.take_needed(&mut self.0))
    }

    fn state(&mut self, emit: EmitTo) -> Result<Vec<ArrayRef>> {
        let blocks = emit.take_needed(&mut self.0);
        let column = |at: usize| -> ArrayRef {
            Arc::new(blocks.iter().map(|b| b.0.get(at).copied()).collect::<Float64Array>())
        };
        Ok((0..SUMS).map(column).collect())
    }

    fn merge_batch(&mut self, states: &[ArrayRef], groups: &[usize], count: usize) -> Result<()> {
        self.0.resize(count, Sums::EMPTY);
        for (row, group) in groups.iter().enumerate() {
            if let Some(block) = self.0.get_mut(*group) {
                block.merge(&sums_at(states, row));
            }
        }
        Ok(())
    }

    /// Each row as a block of its own, where so few rows share one that adding them up first saves nothing.
    fn convert_to_state(&self, values: &[ArrayRef], filter: Option<&BooleanArray>) -> Result<Vec<ArrayRef>> {
        let rows = values.first().map_or(0, |v| v.len());
        let groups: Vec<usize> = (0..rows).collect();
        let mut blocks = Self(Vec::new());
        blocks.update_batch(values, &groups, filter, rows)?;
        GroupsAccumulator::state(&mut blocks, EmitTo::All)
    }

    fn size(&self) -> usize {
        self.0.capacity() * size_of::<Sums>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_a_block_add_up_to_the_whole() {
        let samples: Vec<[f64; 4]> = (0..100).map(f64::from).map(|k| [k, 1.0, k.sin(), k.cos()]).collect();
        let of = |samples: &[[f64; 4]]| {
            let mut sums = Sums::EMPTY;
            samples.iter().for_each(|[t, r, y, u]| sums.add(*t, *r, *y, *u));
            sums
        };
        let mut halves = of(&samples[..37]);
        halves.merge(&of(&samples[37..]));
        for (a, b) in halves.told().iter().zip(of(&samples).told()) {
            assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{a} {b}");
        }
        let [n, from, to, _, mean_y, ..] = halves.told();
        let direct: f64 = samples.iter().map(|s| s[2]).sum::<f64>() / 100.0;
        assert_eq!((n, from, to), (100.0, 0.0, 99.0));
        assert!((mean_y - direct).abs() < 1e-12);
        let mut with_gap = of(&samples);
        with_gap.add(100.0, f64::NAN, 1.0, 1.0);
        assert_eq!(with_gap, of(&samples), "a sample that isn't there enters no sum");
    }
}
