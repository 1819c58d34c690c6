//! Long work runs on threads of its own, without the interpreter's lock, while the calling thread listens for signals. Ctrl-C
//! raises `KeyboardInterrupt` at once; the work itself ends at the next stage or step that it speaks of
//! ([`drift_sim::stage`]).

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Once};
use std::time::Duration;

use drift_sim::{Result, stage};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::error::raised;

/// From one look for signals to the next.
const SIGNALS_EVERY: Duration = Duration::from_millis(50);
/// What a main thread has: the same work runs on one in the command.
const STACK_BYTES: usize = 8 << 20;

thread_local! {
    /// Whether the work of this thread's pool is no longer wanted.
    static GIVEN_UP: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// Carried by the unwinding of work that nobody waits for.
struct GivenUp;

fn end_where_given_up() {
    let given_up =
        GIVEN_UP.with_borrow(|flag| flag.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)));
    if given_up {
        // Without the message of a panic: nothing is wrong.
        resume_unwind(Box::new(GivenUp));
    }
}

/// Runs the work and hands back what it comes to.
///
/// # Errors
/// Its own as `DriftError`; whatever a signal raises, as `KeyboardInterrupt`.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T> + Send + 'static,
) -> PyResult<T> {
    static LISTENING: Once = Once::new();
    LISTENING.call_once(|| stage::listen(|_| end_where_given_up()));
    let given_up = Arc::new(AtomicBool::new(false));
    let of_threads = Arc::clone(&given_up);
    // A pool for each piece of work, so that only its own threads end with it.
    let pool = rayon::ThreadPoolBuilder::new()
        .stack_size(STACK_BYTES)
        .thread_name(|_| "drift".into())
        .start_handler(move |_| GIVEN_UP.set(Some(Arc::clone(&of_threads))))
        .build()
        .map_err(|e| PyRuntimeError::new_err(format!("no threads can be started: {e}")))?;
    let (done, mut waiting) = sync_channel(1);
    pool.spawn(move || {
        // Nobody listens any more where it was given up.
        let _ = done.send(catch_unwind(AssertUnwindSafe(work)));
    });
    loop {
        let received;
        (waiting, received) = py.detach(move || {
            let received = waiting.recv_timeout(SIGNALS_EVERY);
            (waiting, received)
        });
        match received {
            Ok(Ok(result)) => return result.map_err(raised),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals().inspect_err(|_| given_up.store(true, Ordering::Relaxed))?
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the work ended without a result"));
            }
        }
    }
}
