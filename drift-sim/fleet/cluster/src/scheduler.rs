//! The scheduler: Ballista's own, which plans with drift's functions and keeps loops whole.

use std::sync::Arc;

use ballista_core::config::TaskSchedulingPolicy;
use ballista_core::extension::SessionConfigExt;
use ballista_core::utils::default_session_builder;
use ballista_scheduler::cluster::BallistaCluster;
use ballista_scheduler::config::{SchedulerConfig, TaskDistributionPolicy};
use ballista_scheduler::scheduler_process::{create_scheduler, start_grpc_service_with_listener};
use datafusion::error::Result as EngineResult;
use datafusion::execution::{SessionState, SessionStateBuilder};
use datafusion::prelude::SessionConfig;
use datafusion_proto::protobuf::{LogicalPlanNode, PhysicalPlanNode};
use drift_fleet::session::{functions, physical_rules};
use drift_sim::Result;
use tokio::net::TcpListener;

use crate::{LOOPBACK, from_ballista};

/// An executor that was silent for so long is taken for dead, and its work is given to another, s: ten heartbeats
/// ([`crate::executor::HEARTBEAT_S`]), so that a busy machine isn't taken for a dead one.
pub const DEAD_AFTER_S: u64 = 10;

/// How often the scheduler looks for dead executors, s.
const LOOK_EVERY_S: u64 = 1;

/// Schedules until the process ends.
///
/// # Errors
/// The network refuses.
pub async fn serve(listener: TcpListener) -> Result<()> {
    let port =
        listener.local_addr().map_err(|e| drift_sim::Error::of_file("can't be listened on", &e))?.port();
    let config = SchedulerConfig {
        external_host: LOOPBACK.into(),
        bind_host: LOOPBACK.into(),
        bind_port: port,
        scheduling_policy: TaskSchedulingPolicy::PushStaged,
        task_distribution: TaskDistributionPolicy::RoundRobin,
        executor_timeout_seconds: DEAD_AFTER_S,
        expire_dead_executor_interval_seconds: LOOK_EVERY_S,
        override_session_builder: Some(Arc::new(planning)),
        ..SchedulerConfig::default()
    };
    let run = async {
        config.validate()?;
        let cluster = BallistaCluster::new_from_config(&config).await?;
        let scheduler =
            create_scheduler::<LogicalPlanNode, PhysicalPlanNode>(cluster, Arc::new(config)).await?;
        start_grpc_service_with_listener(listener, scheduler).await
    };
    run.await.map_err(|e| from_ballista(&e))
}

/// The session that plans one client's query. Ballista's adaptive planner takes a list of rules of its own, without ours: loops would be judged in
/// parts, and refused; so the static one plans, whatever the client says.
fn planning(config: SessionConfig) -> EngineResult<SessionState> {
    let state = default_session_builder(config.with_ballista_adaptive_query_planner(false))?;
    let mut known: Vec<_> = state.aggregate_functions().values().cloned().collect();
    known.extend(functions());
    let builder = SessionStateBuilder::new_from_existing(state);
    Ok(builder.with_aggregate_functions(known).with_physical_optimizer_rules(physical_rules()).build())
}
