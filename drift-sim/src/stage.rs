//! What long work is at: a stage, and how many of its steps are done. Whoever shows it listens; where nobody does, it costs
//! nothing to speak of.

use std::sync::OnceLock;

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// A stage began, of so many steps; 0 where that is not known.
    Begins(&'static str, usize),
    /// One step of it is done.
    Step,
}

static LISTENER: OnceLock<Box<dyn Fn(Stage) + Send + Sync>> = OnceLock::new();

/// Hears all that follows, from any thread. The first listener of a process stays the only one.
pub fn listen(listener: impl Fn(Stage) + Send + Sync + 'static) {
    let _ = LISTENER.set(Box::new(listener));
}

/// A stage of so many steps begins; 0 where their number is not known.
pub(crate) fn begins(name: &'static str, steps: usize) {
    tell(Stage::Begins(name, steps));
}

/// One step more is done.
pub(crate) fn step() {
    tell(Stage::Step);
}

fn tell(stage: Stage) {
    if let Some(listener) = LISTENER.get() {
        listener(stage);
    }
}
