//! Commissioning: the baselines learnt in place from the reports of a healthy loop.

use core::mem::MaybeUninit;

use drift_core::{Commissioning, NotReady};

use crate::codes::{DRIFT_NO_SCATTER, DRIFT_OK, DRIFT_TOO_FEW_WINDOWS, drift_code_t};
use crate::config::{DRIFT_CHANNELS, drift_config_t};
use crate::monitor::aligned;
use crate::report::drift_report_t;

/// 64-bit words of a commissioning.
pub const DRIFT_COMMISSIONING_WORDS: usize = 12;
const _: () = assert!(size_of::<Commissioning<DRIFT_CHANNELS>>() <= 8 * DRIFT_COMMISSIONING_WORDS);

/// What was learnt so far.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_commissioning_t {
    /// Not to be touched.
    pub words: [u64; DRIFT_COMMISSIONING_WORDS],
}

/// Nothing learnt yet.
///
/// # Safety
/// A pointer that is neither null nor misaligned points to memory of its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_commissioning_start(learning: *mut drift_commissioning_t) -> drift_code_t {
    if let Err(code) = aligned(learning) {
        return code;
    }
    // SAFETY: checked above; the words are large and aligned enough.
    unsafe {
        learning
            .cast::<MaybeUninit<Commissioning<DRIFT_CHANNELS>>>()
            .write(MaybeUninit::new(Commissioning::new()))
    }
    DRIFT_OK
}

/// Adds one healthy decision; a window that was not valid is passed over.
///
/// # Safety
/// As for drift_commissioning_start, which was called before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_commissioning_learn(
    learning: *mut drift_commissioning_t,
    report: *const drift_report_t,
) -> drift_code_t {
    if let Err(code) = aligned(learning).and_then(|()| aligned(report)) {
        return code;
    }
    // SAFETY: checked above and promised by the caller: any bytes are numbers.
    let (learning, report) = unsafe { (&mut *learning.cast::<Commissioning<DRIFT_CHANNELS>>(), &*report) };
    if report.valid == 1 {
        learning.learn_window(report.channels.iter().map(|c| (c.x, c.value)));
    }
    DRIFT_OK
}

/// Writes the baselines of the first channels channels into the configuration, which a monitor can then be started
/// with; DRIFT_TOO_FEW_WINDOWS or DRIFT_NO_SCATTER, and nothing written, where they can't be had.
///
/// # Safety
/// As for drift_commissioning_learn.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_commissioning_finish(
    learning: *const drift_commissioning_t,
    channels: u32,
    config: *mut drift_config_t,
) -> drift_code_t {
    if let Err(code) = aligned(learning).and_then(|()| aligned(config)) {
        return code;
    }
    // SAFETY: checked above and promised by the caller.
    let (learning, config) = unsafe { (&*learning.cast::<Commissioning<DRIFT_CHANNELS>>(), &mut *config) };
    match learning.baselines_of(channels as usize) {
        Ok(baselines) => {
            for (channel, baseline) in config.channels.iter_mut().zip(&baselines).take(channels as usize) {
                channel.baseline = baseline.into();
            }
            DRIFT_OK
        }
        Err(NotReady::NoScatter { .. }) => DRIFT_NO_SCATTER,
        Err(_) => DRIFT_TOO_FEW_WINDOWS,
    }
}
