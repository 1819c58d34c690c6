//! Keeps each loop whole and in order: an aggregate that holds a monitor is planned in one stage, over rows that are divided among
//! partitions by loop and sorted by loop and time within them. The engine's own two stages would judge parts of a loop, and the order that it
//! finds for an aggregate that can't run backwards is that of the groups alone.
//!
//! Sorted input has a second use: a loop that is over is told at once, so that one monitor a partition is held and not one a loop.

use std::sync::Arc;

use datafusion::arrow::compute::SortOptions;
use datafusion::common::config::ConfigOptions;
use datafusion::common::tree_node::{Transformed, TransformedResult, TreeNode};
use datafusion::error::Result;
use datafusion::physical_expr::{LexOrdering, PhysicalSortExpr};
use datafusion::physical_optimizer::PhysicalOptimizerRule;
use datafusion::physical_plan::aggregates::{AggregateExec, AggregateMode};
use datafusion::physical_plan::coalesce_partitions::CoalescePartitionsExec;
use datafusion::physical_plan::repartition::RepartitionExec;
use datafusion::physical_plan::sorts::sort::SortExec;
use datafusion::physical_plan::sorts::sort_preserving_merge::SortPreservingMergeExec;
use datafusion::physical_plan::{ExecutionPlan, ExecutionPlanProperties, Partitioning};

use crate::{calibration, scan, verdict_function};

/// The aggregates that need whole loops.
const SEQUENTIAL: [&str; 3] = [verdict_function::NAME, scan::NAME, calibration::NAME];

/// The rule; it comes right after the engine's own that adds sorts and partitions.
#[derive(Debug, Default)]
pub struct WholeLoops;

impl PhysicalOptimizerRule for WholeLoops {
    fn optimize(
        &self,
        plan: Arc<dyn ExecutionPlan>,
        config: &ConfigOptions,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        let partitions = config.execution.target_partitions.max(1);
        plan.transform_down(|plan| {
            Ok(match in_one_stage(&plan, partitions)? {
                Some(whole) => Transformed::yes(whole),
                None => Transformed::no(plan),
            })
        })
        .data()
    }

    fn name(&self) -> &str {
        "WholeLoops"
    }

    fn schema_check(&self) -> bool {
        true
    }
}

/// The same aggregation in one stage over sorted rows; `None` of a plan that needs no change.
fn in_one_stage(plan: &Arc<dyn ExecutionPlan>, partitions: usize) -> Result<Option<Arc<dyn ExecutionPlan>>> {
    let Some(last) = plan.downcast_ref::<AggregateExec>() else { return Ok(None) };
    let is_sequential = last.aggr_expr().iter().any(|f| SEQUENTIAL.contains(&f.fun().name()));
    if !is_sequential || !last.group_expr().is_single() {
        return Ok(None);
    }
    let Some(first) = first_stage(last) else { return Ok(None) };
    let rows = unordered(first.input());
    let groups = first.group_expr().input_exprs();
    let mode = if groups.is_empty() || partitions == 1 {
        AggregateMode::Single
    } else {
        AggregateMode::SinglePartitioned
    };
    let rows: Arc<dyn ExecutionPlan> = match mode {
        AggregateMode::SinglePartitioned => {
            Arc::new(RepartitionExec::try_new(rows, Partitioning::Hash(groups, partitions))?)
        }
        _ if rows.output_partitioning().partition_count() > 1 => Arc::new(CoalescePartitionsExec::new(rows)),
        _ => rows,
    };
    let whole = AggregateExec::try_new(
        mode,
        first.group_expr().clone(),
        first.aggr_expr().to_vec(),
        first.filter_expr().to_vec(),
        sorted(first, rows)?,
        first.input_schema(),
    )?;
    // The rule may come by its own result again.
    let is_new = whole.mode() != last.mode() || !last.input().is::<SortExec>();
    Ok(is_new.then(|| Arc::new(whole) as Arc<dyn ExecutionPlan>))
}

/// The stage that reads rows: an aggregate in one stage is its own.
fn first_stage(last: &AggregateExec) -> Option<&AggregateExec> {
    if matches!(last.mode(), AggregateMode::Single | AggregateMode::SinglePartitioned) {
        return Some(last);
    }
    let mut below = last.input();
    loop {
        if let Some(first) = below.downcast_ref::<AggregateExec>() {
            return (*first.mode() == AggregateMode::Partial).then_some(first);
        }
        let [only] = below.children()[..] else { return None };
        below = only;
    }
}

/// The same rows without what only divides or sorts them.
fn unordered(rows: &Arc<dyn ExecutionPlan>) -> Arc<dyn ExecutionPlan> {
    let only_orders = rows.is::<SortExec>()
        || rows.is::<RepartitionExec>()
        || rows.is::<CoalescePartitionsExec>()
        || rows.is::<SortPreservingMergeExec>();
    match rows.children()[..] {
        [input] if only_orders && rows.fetch().is_none() => unordered(input),
        _ => Arc::clone(rows),
    }
}

/// These rows sorted by an aggregate's groups, and within them as its functions ask; as they are where they come so.
fn sorted(aggregate: &AggregateExec, rows: Arc<dyn ExecutionPlan>) -> Result<Arc<dyn ExecutionPlan>> {
    let groups = aggregate.group_expr().input_exprs().into_iter();
    let mut order: Vec<PhysicalSortExpr> = groups
        .map(|expr| PhysicalSortExpr::new(expr, SortOptions { descending: false, nulls_first: false }))
        .collect();
    for function in aggregate.aggr_expr().iter().filter(|f| SEQUENTIAL.contains(&f.fun().name())) {
        for wanted in function.order_bys() {
            if !order.iter().any(|by| by.expr.eq(&wanted.expr)) {
                order.push(wanted.clone());
            }
        }
    }
    let Some(order) = LexOrdering::new(order) else { return Ok(rows) };
    if rows.equivalence_properties().ordering_satisfy(order.clone())? {
        return Ok(rows);
    }
    let is_divided = rows.output_partitioning().partition_count() > 1;
    Ok(Arc::new(SortExec::new(order, rows).with_preserve_partitioning(is_divided)))
}
