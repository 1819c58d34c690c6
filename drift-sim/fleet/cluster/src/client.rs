//! A session whose queries run on a cluster. The fleet's own commands run on it: they don't know where.

use ballista::prelude::{SessionConfigExt, SessionContextExt};
use datafusion::execution::SessionStateBuilder;
use datafusion::prelude::SessionContext;
use drift_fleet::from_engine;
use drift_fleet::session::{self, Engine, functions};
use drift_sim::{Error, Result};

/// A session on the cluster whose scheduler listens at `scheduler`, `HOST:PORT`. `engine.threads` is the number of parts that the loops are divided
/// into; what sorts may take is the executors' affair.
///
/// # Errors
/// Nobody listens there.
pub async fn session(scheduler: &str, engine: &Engine) -> Result<SessionContext> {
    // Asked here, since Ballista's own line comes from within a query and says less.
    tokio::net::TcpStream::connect(scheduler).await.map_err(|e| {
        Error::new(format!("no scheduler at {scheduler}: {e}"))
            .allowed("`drift-fleet-cluster start`, which says where it listens")
    })?;
    // Ballista's own settings first, then the fleet's.
    let config = session::config(engine).upgrade_for_ballista();
    let state = SessionStateBuilder::new().with_config(config).with_default_features().build();
    let session = SessionContext::remote_with_state(&format!("df://{scheduler}"), state)
        .await
        .map_err(|e| from_engine(&e))?;
    for function in functions() {
        session.register_udaf(function.as_ref().clone());
    }
    Ok(session)
}
