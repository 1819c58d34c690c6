//! Commissioning with a memory: what the windows before add to one channel, learnt in place.

use core::mem::MaybeUninit;

use drift_core::{MemoryCommissioning, NotReady, OrderAt};

use crate::codes::{
    DRIFT_BAD_CONFIG, DRIFT_NO_SCATTER, DRIFT_OK, DRIFT_POINT_STANDS_STILL, DRIFT_TOO_FEW_WINDOWS,
    drift_code_t,
};
use crate::config::{DRIFT_CHANNELS, drift_config_t};
use crate::monitor::aligned;
use crate::report::drift_report_t;

type Learning = MemoryCommissioning<OrderAt<3>>;

/// 64-bit words of a commissioning with a memory.
pub const DRIFT_MEMORY_COMMISSIONING_WORDS: usize = 36;
const _: () = assert!(size_of::<Learning>() <= 8 * DRIFT_MEMORY_COMMISSIONING_WORDS);

/// What was learnt so far of one channel.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_memory_commissioning_t {
    /// Not to be touched.
    pub words: [u64; DRIFT_MEMORY_COMMISSIONING_WORDS],
}

/// Nothing learnt yet of the channel at this place, from 0: the effort channel's, as a rule.
///
/// # Safety
/// A pointer that is neither null nor misaligned points to memory of its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_memory_commissioning_start(
    learning: *mut drift_memory_commissioning_t,
    channel: u32,
) -> drift_code_t {
    if let Err(code) = aligned(learning) {
        return code;
    }
    if channel as usize >= DRIFT_CHANNELS {
        return DRIFT_BAD_CONFIG;
    }
    // SAFETY: checked above; the words are large and aligned enough.
    unsafe {
        learning.cast::<MaybeUninit<Learning>>().write(MaybeUninit::new(Learning::of_channel(channel as u8)));
    }
    DRIFT_OK
}

/// Adds one healthy decision. Give it every report in order, of windows that do not overlap: one that is not valid, or left
/// out, is a hole that the memory does not reach across.
///
/// # Safety
/// As for drift_memory_commissioning_start, which was called before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_memory_commissioning_learn(
    learning: *mut drift_memory_commissioning_t,
    report: *const drift_report_t,
) -> drift_code_t {
    if let Err(code) = aligned(learning).and_then(|()| aligned(report)) {
        return code;
    }
    // SAFETY: checked above and promised by the caller.
    let (learning, report) = unsafe { (&mut *learning.cast::<Learning>(), &*report) };
    let (x, value) = match report.channels.get(usize::from(learning.place())) {
        Some(channel) if report.valid == 1 => (channel.x, channel.value),
        _ => (f32::NAN, f32::NAN),
    };
    learning.learn_window(report.hop, x, value, report.operating_point);
    DRIFT_OK
}

/// Writes baseline and memory of that channel into the configuration, and, where the reports came with an operating point, what it
/// adds. The order is the one that pays, 0 to 3: DRIFT_NOT_LINKED from an init says that its kind has no memory.
/// DRIFT_TOO_FEW_WINDOWS (100 with three windows before them are needed, 200 for an order of 3), DRIFT_NO_SCATTER or
/// DRIFT_POINT_STANDS_STILL, and nothing written, where they can't be had.
///
/// # Safety
/// As for drift_memory_commissioning_learn.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_memory_commissioning_finish(
    learning: *const drift_memory_commissioning_t,
    config: *mut drift_config_t,
) -> drift_code_t {
    if let Err(code) = aligned(learning).and_then(|()| aligned(config)) {
        return code;
    }
    // SAFETY: checked above and promised by the caller.
    let (learning, config) = unsafe { (&*learning.cast::<Learning>(), &mut *config) };
    let Some(channel) = config.channels.get_mut(usize::from(learning.place())) else {
        return DRIFT_BAD_CONFIG;
    };
    match learning.relation() {
        Ok((baseline, point, memory)) => {
            (channel.baseline, channel.operating_point, channel.memory) =
                ((&baseline).into(), (&point).into(), (&memory).into());
            DRIFT_OK
        }
        Err(NotReady::NoScatter { .. }) => DRIFT_NO_SCATTER,
        Err(NotReady::PointStandsStill { .. }) => DRIFT_POINT_STANDS_STILL,
        Err(_) => DRIFT_TOO_FEW_WINDOWS,
    }
}
