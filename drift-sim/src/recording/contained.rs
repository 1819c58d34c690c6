//! Decoders of other people's that panic on damaged files: that is the file's fault, and one line as every other.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use crate::{Error, Result};

thread_local! {
    static UNPACKS: Cell<bool> = const { Cell::new(false) };
}

/// Runs a decoder; a panic in it is an error that says this.
pub(super) fn contained<T>(damaged: &str, unpack: impl FnOnce() -> Result<T>) -> Result<T> {
    static SILENCED: Once = Once::new();
    SILENCED.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !UNPACKS.get() {
                usual(info);
            }
        }));
    });
    UNPACKS.set(true);
    let unpacked = panic::catch_unwind(AssertUnwindSafe(unpack));
    UNPACKS.set(false);
    unpacked.unwrap_or_else(|_| Err(Error::new(damaged)))
}
