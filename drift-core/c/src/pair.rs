//! The paper's pair, E_u and IAE, of float samples.

use drift_core::{Iae, Pair};

use crate::codes::{drift_code_t, drift_without_t};
use crate::config::drift_config_t;
use crate::handle::Storage;
use crate::report::drift_report_t;

type Kind = Storage<f32, Pair<Iae>, 1>;

/// 64-bit words of a monitor.
pub const DRIFT_PAIR_WORDS: usize = 60;
const _: () = assert!(size_of::<Kind>() <= 8 * DRIFT_PAIR_WORDS && align_of::<Kind>() <= 8);

/// The paper's pair, E_u and IAE, of float samples.
#[repr(C)]
pub struct drift_pair_t {
    /// Not to be touched.
    pub words: [u64; DRIFT_PAIR_WORDS],
}

/// Starts a monitor. The configuration is copied.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_pair_init(
    monitor: *mut drift_pair_t,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise; the words are as large and aligned as the storage.
    unsafe { Kind::init(monitor.cast(), config) }
}

/// One tick of the closed loop; DRIFT_REPORT once per hop.
///
/// # Safety
/// As for init; no other call uses the monitor at the same time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_pair_tick(
    monitor: *mut drift_pair_t,
    r: f32,
    y: f32,
    u: f32,
    report: *mut drift_report_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { Kind::tick(monitor.cast(), r, y, u, report) }
}

/// One tick without a sample: DRIFT_MANUAL or DRIFT_MISSING.
///
/// # Safety
/// As for tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_pair_tick_without(
    monitor: *mut drift_pair_t,
    why: drift_without_t,
    report: *mut drift_report_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { Kind::tick_without(monitor.cast(), why, report) }
}

/// Forgets alarms and courses, for a fault that was seen to.
///
/// # Safety
/// As for tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_pair_acknowledge(monitor: *mut drift_pair_t) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { Kind::acknowledge(monitor.cast()) }
}

/// Saves the state into capacity bytes; the bytes used, or a negative code. 8*DRIFT_PAIR_WORDS*2 always suffice.
///
/// # Safety
/// As for tick; into points to capacity writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_pair_save(
    monitor: *mut drift_pair_t,
    into: *mut u8,
    capacity: u32,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { Kind::save(monitor.cast(), into, capacity) }
}

/// Takes up a saved state, all of it or none.
///
/// # Safety
/// As for tick; from points to length readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_pair_restore(
    monitor: *mut drift_pair_t,
    from: *const u8,
    length: u32,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { Kind::restore(monitor.cast(), from, length) }
}
