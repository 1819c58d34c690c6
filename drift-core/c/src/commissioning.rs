//! Commissioning: the baselines, and the weight of an operating point, learnt in place from the reports of a healthy loop.

use core::mem::MaybeUninit;

use drift_core::{CommissioningAt, NotReady};

use crate::codes::{
    DRIFT_NO_SCATTER, DRIFT_OK, DRIFT_POINT_STANDS_STILL, DRIFT_TOO_FEW_WINDOWS, drift_code_t,
};
use crate::config::{DRIFT_CHANNELS, drift_config_t};
use crate::monitor::aligned;
use crate::report::drift_report_t;

/// 64-bit words of a commissioning.
pub const DRIFT_COMMISSIONING_WORDS: usize = 23;
const _: () = assert!(size_of::<CommissioningAt<DRIFT_CHANNELS>>() <= 8 * DRIFT_COMMISSIONING_WORDS);

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
            .cast::<MaybeUninit<CommissioningAt<DRIFT_CHANNELS>>>()
            .write(MaybeUninit::new(CommissioningAt::new()))
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
    let (learning, report) = unsafe { (&mut *learning.cast::<CommissioningAt<DRIFT_CHANNELS>>(), &*report) };
    if report.valid == 1 {
        learning.learn_window(report.channels.iter().map(|c| (c.x, c.value)), report.operating_point);
    }
    DRIFT_OK
}

/// Writes the baselines of the first channels channels into the configuration, which a monitor can then be started
/// with, and, where the reports came with an operating point, what it adds to the channels that can depend on it;
/// DRIFT_TOO_FEW_WINDOWS, DRIFT_NO_SCATTER or DRIFT_POINT_STANDS_STILL, and nothing written, where they can't be had.
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
    let (learning, config) = unsafe { (&*learning.cast::<CommissioningAt<DRIFT_CHANNELS>>(), &mut *config) };
    let asked = (channels as usize).min(DRIFT_CHANNELS);
    let mut learned = [None; DRIFT_CHANNELS];
    for (place, (into, channel)) in learned.iter_mut().zip(&config.channels).take(asked).enumerate() {
        let kind = match channel.kind() {
            Ok(kind) => kind,
            Err(code) => return code,
        };
        match learning.relation(place, kind) {
            Ok(relation) => *into = Some(relation),
            Err(NotReady::NoScatter { .. }) => return DRIFT_NO_SCATTER,
            Err(NotReady::PointStandsStill { .. }) => return DRIFT_POINT_STANDS_STILL,
            Err(_) => return DRIFT_TOO_FEW_WINDOWS,
        }
    }
    for (channel, (baseline, point)) in config.channels.iter_mut().zip(learned.iter().flatten()) {
        channel.baseline = baseline.into();
        channel.operating_point = point.into();
    }
    DRIFT_OK
}
