//! An executor: Ballista's own, which knows drift's functions by their names.

use std::path::Path;
use std::sync::Arc;

use ballista_core::config::TaskSchedulingPolicy;
use ballista_core::registry::BallistaFunctionRegistry;
use ballista_executor::executor_process::{ExecutorProcessConfig, start_executor_process};
use drift_fleet::session::functions;
use drift_sim::{Error, Result};

use crate::{LOOPBACK, from_ballista};

/// How often an executor says that it is alive, s.
pub const HEARTBEAT_S: u64 = 1;

/// How long it looks for its scheduler, s.
const CONNECT_S: u16 = 30;

/// How an executor runs.
#[derive(Debug, Clone)]
pub struct Executor<'a> {
    /// The port of its scheduler.
    pub scheduler_port: u16,
    /// Where it keeps what it hands over to others.
    pub folder: &'a Path,
    /// Parts of the work that it does side by side.
    pub threads: usize,
    /// What its sorts may take in all, bytes.
    pub memory_limit_bytes: u64,
}

impl Executor<'_> {
    /// Works until the process ends.
    ///
    /// # Errors
    /// There is no scheduler, or the network refuses.
    pub async fn serve(&self) -> Result<()> {
        let mut registry = BallistaFunctionRegistry::default();
        for function in functions() {
            registry.aggregate_functions.insert(function.name().to_owned(), function);
        }
        let [port, grpc_port] = free_ports()?;
        let config = ExecutorProcessConfig {
            bind_host: LOOPBACK.into(),
            external_host: Some(LOOPBACK.into()),
            port,
            grpc_port,
            scheduler_host: LOOPBACK.into(),
            scheduler_port: self.scheduler_port,
            scheduler_connect_timeout_seconds: CONNECT_S,
            vcores: self.threads,
            task_scheduling_policy: TaskSchedulingPolicy::PushStaged,
            work_dir: Some(self.folder.to_string_lossy().into_owned()),
            executor_heartbeat_interval_seconds: HEARTBEAT_S,
            memory_pool_size: Some(self.memory_limit_bytes),
            override_function_registry: Some(Arc::new(registry)),
            ..ExecutorProcessConfig::default()
        };
        start_executor_process(Arc::new(config)).await.map_err(|e| from_ballista(&e))
    }
}

/// Two ports that nobody listened on a moment ago: Ballista wants to be told them. Who takes one in between makes the executor fail aloud.
fn free_ports() -> Result<[u16; 2]> {
    let find = || -> std::io::Result<[u16; 2]> {
        let one = std::net::TcpListener::bind((LOOPBACK, 0))?;
        let other = std::net::TcpListener::bind((LOOPBACK, 0))?;
        Ok([one.local_addr()?.port(), other.local_addr()?.port()])
    };
    find().map_err(|e| Error::new(format!("no free port on {LOOPBACK}: {e}")))
}
