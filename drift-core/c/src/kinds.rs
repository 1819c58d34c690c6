//! The kinds of monitor: a row each. A kind's init is all that it adds to the functions of [`crate::monitor`].

use drift_core::{
    Blanks, Cusum, Everything, Excluded, Forgetful, Full, FullAt, Iae, Monitor, Options, Pair, Refitted,
    Shewhart, Smallest, Tumbling,
};

use crate::codes::drift_code_t;
use crate::config::drift_config_t;
use crate::monitor::{Storage, drift_monitor_t};

/// Most blocks of windows that overlap.
pub const DRIFT_BLOCKS: usize = 16;

/// The pair's: CUSUM and Shewhart on windows that follow one another; limits, blanking and gaps.
#[derive(Debug, Clone, Copy)]
struct PairOptions;

impl Options for PairOptions {
    type Window = Tumbling;
    type Detectors = (Cusum, Shewhart);
    type Curve = Refitted;
    type Blanking = Blanks;
    type Excluded = Excluded;
    type Memory = Forgetful;
    const LIMITS: bool = true;
    const GAPS: bool = true;
    const PREDICTION: bool = true;
}

// Written out: cbindgen does not look into macros.

type SmallStorage = Storage<f32, Pair<Iae>, Smallest, 1>;
/// 64-bit words of a monitor that drift_small_init starts.
pub const DRIFT_SMALL_WORDS: usize = 44;
const _: () = assert!(size_of::<SmallStorage>() <= 8 * DRIFT_SMALL_WORDS);

/// The smallest: E_u and IAE, one CUSUM on an exactly known relation; no gaps, no limits, no refitted curve.
/// Checks the configuration, copies it and starts the monitor in so many words of memory.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_small_init(
    memory: *mut drift_monitor_t,
    words: u32,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { SmallStorage::init(memory, words, config) }
}

type PairStorage = Storage<f32, Pair<Iae>, PairOptions, 1>;
/// 64-bit words of a monitor that drift_pair_init starts.
pub const DRIFT_PAIR_WORDS: usize = 52;
const _: () = assert!(size_of::<PairStorage>() <= 8 * DRIFT_PAIR_WORDS);

/// The paper's pair: E_u and IAE; CUSUM and Shewhart, windows that follow one another.
/// Checks the configuration, copies it and starts the monitor in so many words of memory.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_pair_init(
    memory: *mut drift_monitor_t,
    words: u32,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { PairStorage::init(memory, words, config) }
}

type FullStorage = Storage<f32, Full, Everything<DRIFT_BLOCKS>, 3>;
/// 64-bit words of a monitor that drift_full_init starts.
pub const DRIFT_FULL_WORDS: usize = 260;
const _: () = assert!(size_of::<FullStorage>() <= 8 * DRIFT_FULL_WORDS);

/// All indices, three channels, everything that there is; windows of up to DRIFT_BLOCKS blocks may overlap.
/// Checks the configuration, copies it and starts the monitor in so many words of memory.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_full_init(
    memory: *mut drift_monitor_t,
    words: u32,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { FullStorage::init(memory, words, config) }
}

type SmallI32Storage = Storage<i32, Pair<Iae>, Smallest, 1>;
/// 64-bit words of a monitor that drift_small_i32_init starts.
pub const DRIFT_SMALL_I32_WORDS: usize = 44;
const _: () = assert!(size_of::<SmallI32Storage>() <= 8 * DRIFT_SMALL_I32_WORDS);

/// The smallest, of counts.
/// Checks the configuration, copies it and starts the monitor in so many words of memory.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_small_i32_init(
    memory: *mut drift_monitor_t,
    words: u32,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { SmallI32Storage::init(memory, words, config) }
}

type PairI32Storage = Storage<i32, Pair<Iae>, PairOptions, 1>;
/// 64-bit words of a monitor that drift_pair_i32_init starts.
pub const DRIFT_PAIR_I32_WORDS: usize = 52;
const _: () = assert!(size_of::<PairI32Storage>() <= 8 * DRIFT_PAIR_I32_WORDS);

/// The paper's pair, of counts.
/// Checks the configuration, copies it and starts the monitor in so many words of memory.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_pair_i32_init(
    memory: *mut drift_monitor_t,
    words: u32,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { PairI32Storage::init(memory, words, config) }
}

type FullI32Storage = Storage<i32, Full, Everything<DRIFT_BLOCKS>, 3>;
/// 64-bit words of a monitor that drift_full_i32_init starts.
pub const DRIFT_FULL_I32_WORDS: usize = 260;
const _: () = assert!(size_of::<FullI32Storage>() <= 8 * DRIFT_FULL_I32_WORDS);

/// All indices and three channels, of counts.
/// Checks the configuration, copies it and starts the monitor in so many words of memory.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_full_i32_init(
    memory: *mut drift_monitor_t,
    words: u32,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { FullI32Storage::init(memory, words, config) }
}

type FullAtStorage = Storage<f32, FullAt, Everything<DRIFT_BLOCKS>, 3>;
/// 64-bit words of a monitor that drift_full_at_init starts.
pub const DRIFT_FULL_AT_WORDS: usize = 280;
const _: () = assert!(size_of::<FullAtStorage>() <= 8 * DRIFT_FULL_AT_WORDS);

/// As drift_full_init, and a measured operating point, told by drift_operating_point: no tick counts before.
/// Checks the configuration, copies it and starts the monitor in so many words of memory.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_full_at_init(
    memory: *mut drift_monitor_t,
    words: u32,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { FullAtStorage::init(memory, words, config) }
}

type FullAtI32Storage = Storage<i32, FullAt, Everything<DRIFT_BLOCKS>, 3>;
/// 64-bit words of a monitor that drift_full_at_i32_init starts.
pub const DRIFT_FULL_AT_I32_WORDS: usize = 280;
const _: () = assert!(size_of::<FullAtI32Storage>() <= 8 * DRIFT_FULL_AT_I32_WORDS);

/// The same of counts, the operating point too.
/// Checks the configuration, copies it and starts the monitor in so many words of memory.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_full_at_i32_init(
    memory: *mut drift_monitor_t,
    words: u32,
    config: *const drift_config_t,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { FullAtI32Storage::init(memory, words, config) }
}

/// No saved state of any kind is longer.
pub const DRIFT_STATE_BYTES: usize = 1400;
const _: () = assert!(
    drift_core::FullMonitor::<f32, DRIFT_BLOCKS>::STATE_BYTES <= DRIFT_STATE_BYTES
        && drift_core::FullMonitor::<i32, DRIFT_BLOCKS>::STATE_BYTES <= DRIFT_STATE_BYTES
        && Monitor::<f32, FullAt, Everything<DRIFT_BLOCKS>, 3>::STATE_BYTES <= DRIFT_STATE_BYTES
        && Monitor::<i32, FullAt, Everything<DRIFT_BLOCKS>, 3>::STATE_BYTES <= DRIFT_STATE_BYTES
);
