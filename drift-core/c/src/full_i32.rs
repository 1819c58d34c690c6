//! All indices, three channels, of counts.

use drift_core::Full;

use crate::codes::{drift_code_t, drift_without_t};
use crate::config::drift_config_t;
use crate::handle::Storage;
use crate::report::drift_report_t;

type Kind = Storage<i32, Full, 3>;

/// 64-bit words of a monitor.
pub const DRIFT_FULL_I32_WORDS: usize = 320;
const _: () = assert!(size_of::<Kind>() <= 8 * DRIFT_FULL_I32_WORDS && align_of::<Kind>() <= 8);

/// All indices, three channels, of counts.
#[repr(C)]
pub struct drift_full_i32_t {
    /// Not to be touched.
    pub words: [u64; DRIFT_FULL_I32_WORDS],
}

/// Starts a monitor. The configuration is copied.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_full_i32_init(
    monitor: *mut drift_full_i32_t,
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
pub unsafe extern "C" fn drift_full_i32_tick(
    monitor: *mut drift_full_i32_t,
    r: i32,
    y: i32,
    u: i32,
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
pub unsafe extern "C" fn drift_full_i32_tick_without(
    monitor: *mut drift_full_i32_t,
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
pub unsafe extern "C" fn drift_full_i32_acknowledge(monitor: *mut drift_full_i32_t) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { Kind::acknowledge(monitor.cast()) }
}

/// Saves the state into capacity bytes; the bytes used, or a negative code. 8*DRIFT_FULL_I32_WORDS*2 always suffice.
///
/// # Safety
/// As for tick; into points to capacity writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_full_i32_save(
    monitor: *mut drift_full_i32_t,
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
pub unsafe extern "C" fn drift_full_i32_restore(
    monitor: *mut drift_full_i32_t,
    from: *const u8,
    length: u32,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { Kind::restore(monitor.cast(), from, length) }
}
