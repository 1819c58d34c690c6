//! The query engine as fleets use it: with a bound on its memory, beyond which it sorts on disk, with drift's functions, and with whole loops.

use std::sync::Arc;

use datafusion::error::Result;
use datafusion::execution::SessionStateBuilder;
use datafusion::execution::memory_pool::FairSpillPool;
use datafusion::execution::runtime_env::RuntimeEnvBuilder;
use datafusion::logical_expr::AggregateUDF;
use datafusion::physical_optimizer::PhysicalOptimizerRule;
use datafusion::physical_optimizer::optimizer::PhysicalOptimizer;
use datafusion::prelude::{SessionConfig, SessionContext};

use crate::block_function::DriftBlock;
use crate::calibration::{self, DriftBaseline};
use crate::loop_run::Reports;
use crate::scan::DriftStretches;
use crate::verdict_function::DriftVerdict;
use crate::whole_loops::WholeLoops;

/// What the engine's sorts may take in all, bytes, where nothing is said.
pub const MEMORY_LIMIT_BYTES: u64 = 1 << 30;

/// How a query runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Engine {
    /// What sorts may take in all, bytes; what doesn't fit is sorted on disk.
    pub memory_limit_bytes: u64,
    /// Partitions that run side by side.
    pub threads: usize,
}

impl Default for Engine {
    fn default() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        Self { memory_limit_bytes: MEMORY_LIMIT_BYTES, threads }
    }
}

/// drift's aggregates, as they are known by name.
pub fn functions() -> Vec<Arc<AggregateUDF>> {
    vec![
        Arc::new(AggregateUDF::from(DriftVerdict::new())),
        Arc::new(AggregateUDF::from(DriftBlock::new())),
        Arc::new(AggregateUDF::from(DriftStretches::new())),
        Arc::new(AggregateUDF::from(DriftBaseline::new(calibration::Request::default()))),
    ]
}

/// The engine's rules for physical plans, with [`WholeLoops`] right after the one that adds sorts and partitions.
pub fn physical_rules() -> Vec<Arc<dyn PhysicalOptimizerRule + Send + Sync>> {
    let mut rules = PhysicalOptimizer::new().rules;
    let at = rules.iter().position(|rule| rule.name() == "EnsureRequirements").map_or(0, |at| at + 1);
    rules.insert(at, Arc::new(WholeLoops));
    rules
}

/// What a sort sets aside for merging what it has put on the disk, bytes at most: the engine's own choice.
const MERGE_BYTES: usize = 10 << 20;

/// The settings of a session.
pub fn config(engine: &Engine) -> SessionConfig {
    let threads = engine.threads.max(1);
    // Where little memory is allowed, the merges of all partitions must not take it from their sorts.
    let merge = memory_bytes(engine) / (8 * threads);
    SessionConfig::new()
        .with_target_partitions(threads)
        .with_sort_spill_reservation_bytes(merge.min(MERGE_BYTES))
        .with_information_schema(true)
}

fn memory_bytes(engine: &Engine) -> usize {
    usize::try_from(engine.memory_limit_bytes).unwrap_or(usize::MAX)
}

/// A session within this process.
///
/// # Errors
/// The engine can't be set up: no folder for temporary files.
pub fn session(engine: &Engine, reports: Option<Reports>) -> Result<SessionContext> {
    let pool = FairSpillPool::new(memory_bytes(engine));
    let runtime = RuntimeEnvBuilder::new().with_memory_pool(Arc::new(pool)).build_arc()?;
    let state = SessionStateBuilder::new()
        .with_config(config(engine))
        .with_runtime_env(runtime)
        .with_default_features()
        .with_physical_optimizer_rules(physical_rules())
        .build();
    let session = SessionContext::new_with_state(state);
    for function in functions() {
        session.register_udaf(function.as_ref().clone());
    }
    if reports.is_some() {
        session.register_udaf(AggregateUDF::from(DriftVerdict::with_reports(reports)));
    }
    Ok(session)
}
