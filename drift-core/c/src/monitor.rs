//! The opaque monitor, and what is checked before every use: plan and state side by side in the caller's memory,
//! behind a head that says which kind of monitor it is.
//!
//! One set of functions serves all kinds: the head refers to the kind's own ones, so that a firmware links those kinds
//! only whose init it calls.

use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut};

use drift_core::{Exclusions, IndexSet, Input, Monitor, Options};

use crate::codes::{
    self, DRIFT_BAD_CONFIG, DRIFT_BUFFER_TOO_SMALL, DRIFT_MANUAL, DRIFT_MISALIGNED, DRIFT_MISSING,
    DRIFT_NOT_INITIALISED, DRIFT_NOT_LINKED, DRIFT_NULL, DRIFT_OK, DRIFT_OTHER_NUMBER, DRIFT_REPORT,
    drift_code_t, drift_without_t,
};
use crate::config::{Sample, drift_config_t};
use crate::report::{ReportedIndices, drift_report_t};

/// One word of a monitor: `static drift_monitor_t monitor[DRIFT_PAIR_WORDS];` is a monitor.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct drift_monitor_t {
    /// Not to be touched.
    pub word: u64,
}

/// What a kind of monitor does.
struct Kind {
    // Numbers one by one: an array would go through memory.
    tick: unsafe fn(*mut Head, f32, f32, f32, *mut drift_report_t) -> i32,
    tick_counts: unsafe fn(*mut Head, i32, i32, i32, *mut drift_report_t) -> i32,
    tick_without: unsafe fn(*mut Head, u32, *mut drift_report_t) -> i32,
    acknowledge: unsafe fn(*mut Head),
    point: unsafe fn(*mut Head, [f32; 3]) -> i32,
    point_counts: unsafe fn(*mut Head, [i32; 3]) -> i32,
    save: unsafe fn(*mut Head, *mut u8) -> i32,
    restore: unsafe fn(*mut Head, &[u8]) -> i32,
    state_bytes: u32,
}

/// What every monitor begins with.
#[repr(C)]
pub(crate) struct Head {
    /// The kind's address, mixed with a constant that stray memory hardly holds.
    seal: usize,
    kind: MaybeUninit<&'static Kind>,
}

#[repr(C)]
pub(crate) struct Storage<N: Sample, S: IndexSet<N>, O: Options, const C: usize> {
    head: Head,
    monitor: MaybeUninit<Monitor<N, S, O, C>>,
}

const SEAL: usize = 0x6472_6966;

/// Neither null nor misaligned.
pub(crate) fn aligned<T>(pointer: *const T) -> Result<(), i32> {
    if pointer.is_null() {
        Err(DRIFT_NULL)
    } else if !pointer.is_aligned() {
        Err(DRIFT_MISALIGNED)
    } else {
        Ok(())
    }
}

impl<N, S, O, const C: usize> Storage<N, S, O, C>
where
    N: Sample,
    S: IndexSet<N, Indices: ReportedIndices>,
    O: Options<Excluded: crate::report::ReportedExclusions>,
    <O::Detectors as drift_core::DetectorSet>::Shown: crate::report::ReportedDetectors,
    <O::Curve as drift_core::Curve>::Shown: crate::report::ReportedCurve,
    O::Excluded: Exclusions,
{
    const KIND: Kind = Kind {
        tick: Self::tick,
        tick_counts: Self::tick_counts,
        tick_without: Self::tick_without,
        acknowledge: Self::acknowledge,
        point: Self::point,
        point_counts: Self::point_counts,
        save: Self::save,
        restore: Self::restore,
        state_bytes: Monitor::<N, S, O, C>::STATE_BYTES as u32,
    };

    /// Checks the configuration and starts the monitor.
    ///
    /// # Safety
    /// `memory` is null or points to `words` words, `config` to a configuration, where they are aligned.
    pub(crate) unsafe fn init(
        memory: *mut drift_monitor_t,
        words: u32,
        config: *const drift_config_t,
    ) -> i32 {
        let this = memory.cast::<Self>();
        let start = || -> Result<(), i32> {
            aligned(memory)?;
            aligned(config)?;
            if (words as usize).saturating_mul(8) < size_of::<Self>() {
                return Err(DRIFT_BUFFER_TOO_SMALL);
            }
            // SAFETY: checked above and promised by the caller; any bytes are a valid drift_config_t.
            let config = unsafe { &*config }.convert::<N, C>()?;
            let monitor = Monitor::new(config).map_err(codes::of_config)?;
            let kind: &'static Kind = const { &Self::KIND };
            // SAFETY: large enough, aligned, and the caller's; field by field, no reference to the whole is made.
            unsafe {
                addr_of_mut!((*this).monitor).write(MaybeUninit::new(monitor));
                addr_of_mut!((*this).head.kind).write(MaybeUninit::new(kind));
                addr_of_mut!((*this).head.seal).write(core::ptr::from_ref(kind) as usize ^ SEAL);
            }
            Ok(())
        };
        start().err().unwrap_or(DRIFT_OK)
    }

    /// # Safety
    /// `head` is that of an initialised monitor of this kind, and no other call uses it at the same time.
    unsafe fn monitor<'a>(head: *mut Head) -> &'a mut Monitor<N, S, O, C> {
        let this = head.cast::<Self>();
        // SAFETY: the head is the storage's first field, and the seal says that init has written the monitor.
        unsafe { (*addr_of_mut!((*this).monitor)).assume_init_mut() }
    }

    /// # Safety
    /// As for [`Storage::monitor`]; `into` is aligned and the caller's.
    #[inline(always)]
    unsafe fn sample(head: *mut Head, sample: Option<[N; 3]>, into: *mut drift_report_t) -> i32 {
        let Some([r, y, u]) = sample else { return DRIFT_OTHER_NUMBER };
        // SAFETY: the caller's promise.
        let monitor = unsafe { Self::monitor(head) };
        match monitor.tick(r, y, u) {
            // SAFETY: the caller's promise.
            Some(report) => unsafe { drift_report_t::fill(into, report) },
            None => return DRIFT_OK,
        }
        DRIFT_REPORT
    }

    unsafe fn tick(head: *mut Head, r: f32, y: f32, u: f32, into: *mut drift_report_t) -> i32 {
        // SAFETY: the caller's promise.
        unsafe { Self::sample(head, N::of_floats([r, y, u]), into) }
    }

    unsafe fn tick_counts(head: *mut Head, r: i32, y: i32, u: i32, into: *mut drift_report_t) -> i32 {
        // SAFETY: the caller's promise.
        unsafe { Self::sample(head, N::of_counts([r, y, u]), into) }
    }

    unsafe fn tick_without(head: *mut Head, why: u32, into: *mut drift_report_t) -> i32 {
        let input = match why {
            DRIFT_MANUAL => Input::Manual,
            DRIFT_MISSING => Input::Missing,
            _ => return DRIFT_BAD_CONFIG,
        };
        // SAFETY: the caller's promise.
        let monitor = unsafe { Self::monitor(head) };
        match monitor.tick_input(input) {
            // SAFETY: the caller's promise.
            Some(report) => unsafe { drift_report_t::fill(into, report) },
            None => return DRIFT_OK,
        }
        DRIFT_REPORT
    }

    unsafe fn acknowledge(head: *mut Head) {
        // SAFETY: the caller's promise.
        unsafe { Self::monitor(head) }.acknowledge();
    }

    /// # Safety
    /// As for [`Storage::monitor`].
    unsafe fn hold(head: *mut Head, point: Option<[N; 3]>) -> i32 {
        let Some([point, ..]) = point else { return DRIFT_OTHER_NUMBER };
        // SAFETY: the caller's promise.
        match unsafe { Self::monitor(head) }.operating_point_place() {
            Some(place) => {
                *place = point;
                DRIFT_OK
            }
            None => DRIFT_NOT_LINKED,
        }
    }

    unsafe fn point(head: *mut Head, point: [f32; 3]) -> i32 {
        // SAFETY: the caller's promise.
        unsafe { Self::hold(head, N::of_floats(point)) }
    }

    unsafe fn point_counts(head: *mut Head, point: [i32; 3]) -> i32 {
        // SAFETY: the caller's promise.
        unsafe { Self::hold(head, N::of_counts(point)) }
    }

    /// `into` has room for the whole state.
    unsafe fn save(head: *mut Head, into: *mut u8) -> i32 {
        let bytes = Monitor::<N, S, O, C>::STATE_BYTES;
        // SAFETY: the caller's promise; the bytes are written before they are read.
        let (monitor, bytes) = unsafe {
            into.write_bytes(0, bytes);
            (Self::monitor(head), core::slice::from_raw_parts_mut(into, bytes))
        };
        monitor.save(bytes).map_or_else(codes::of_state, |used| used as i32)
    }

    unsafe fn restore(head: *mut Head, from: &[u8]) -> i32 {
        // SAFETY: the caller's promise.
        unsafe { Self::monitor(head) }.restore(from).map_or_else(codes::of_state, |()| DRIFT_OK)
    }
}

/// The head of an initialised monitor, and what its kind does.
///
/// # Safety
/// A pointer that is neither null nor misaligned points to a monitor's memory.
unsafe fn opened(monitor: *mut drift_monitor_t) -> Result<(*mut Head, &'static Kind), i32> {
    aligned(monitor)?;
    let head = monitor.cast::<Head>();
    // SAFETY: not null, aligned, and the caller's; the seal is a plain number whatever the bytes are.
    unsafe {
        let address = addr_of!((*head).kind).cast::<usize>().read();
        if address == 0 || addr_of!((*head).seal).read() != address ^ SEAL {
            return Err(DRIFT_NOT_INITIALISED);
        }
        // The seal says that init has written it.
        Ok((head, addr_of!((*head).kind).read().assume_init()))
    }
}

/// One tick of the closed loop in engineering units; DRIFT_REPORT once per hop.
///
/// # Safety
/// Pointers that are neither null nor misaligned point to memory of their type; no other call uses the monitor at the
/// same time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_tick(
    monitor: *mut drift_monitor_t,
    r: f32,
    y: f32,
    u: f32,
    report: *mut drift_report_t,
) -> drift_code_t {
    if let Err(code) = aligned(report) {
        return code;
    }
    // SAFETY: the caller's promise.
    match unsafe { opened(monitor) } {
        // SAFETY: as above.
        Ok((head, kind)) => unsafe { (kind.tick)(head, r, y, u, report) },
        Err(code) => code,
    }
}

/// The same in converter counts, for the i32 kinds.
///
/// # Safety
/// As for drift_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_tick_i32(
    monitor: *mut drift_monitor_t,
    r: i32,
    y: i32,
    u: i32,
    report: *mut drift_report_t,
) -> drift_code_t {
    if let Err(code) = aligned(report) {
        return code;
    }
    // SAFETY: the caller's promise.
    match unsafe { opened(monitor) } {
        // SAFETY: as above.
        Ok((head, kind)) => unsafe { (kind.tick_counts)(head, r, y, u, report) },
        Err(code) => code,
    }
}

/// The operating point from the next tick on, for a monitor of drift_full_at_init; DRIFT_NOT_LINKED for others. Ticks
/// do not count before it is told, nor while it is not finite.
///
/// # Safety
/// As for drift_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_operating_point(monitor: *mut drift_monitor_t, point: f32) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { opened(monitor).map_or_else(|code| code, |(head, kind)| (kind.point)(head, [point; 3])) }
}

/// The same in converter counts, for a monitor of drift_full_at_i32_init.
///
/// # Safety
/// As for drift_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_operating_point_i32(
    monitor: *mut drift_monitor_t,
    point: i32,
) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { opened(monitor).map_or_else(|code| code, |(head, kind)| (kind.point_counts)(head, [point; 3])) }
}

/// One tick without a sample: DRIFT_MANUAL or DRIFT_MISSING.
///
/// # Safety
/// As for drift_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_tick_without(
    monitor: *mut drift_monitor_t,
    why: drift_without_t,
    report: *mut drift_report_t,
) -> drift_code_t {
    if let Err(code) = aligned(report) {
        return code;
    }
    // SAFETY: the caller's promise.
    unsafe { opened(monitor).map_or_else(|code| code, |(head, kind)| (kind.tick_without)(head, why, report)) }
}

/// Forgets alarms and courses, for a fault that was seen to.
///
/// # Safety
/// As for drift_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_acknowledge(monitor: *mut drift_monitor_t) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe {
        opened(monitor).map_or_else(
            |code| code,
            |(head, kind)| {
                (kind.acknowledge)(head);
                DRIFT_OK
            },
        )
    }
}

/// Bytes that drift_save needs, or a negative code.
///
/// # Safety
/// As for drift_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_state_bytes(monitor: *mut drift_monitor_t) -> drift_code_t {
    // SAFETY: the caller's promise.
    unsafe { opened(monitor).map_or_else(|code| code, |(_, kind)| kind.state_bytes as i32) }
}

/// Saves the state into capacity bytes; the bytes used, or a negative code: then nothing is written.
/// DRIFT_STATE_BYTES always suffice.
///
/// # Safety
/// As for drift_tick; into points to capacity writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_save(
    monitor: *mut drift_monitor_t,
    into: *mut u8,
    capacity: u32,
) -> drift_code_t {
    if into.is_null() {
        return DRIFT_NULL;
    }
    // SAFETY: the caller's promise.
    match unsafe { opened(monitor) } {
        Err(code) => code,
        Ok((_, kind)) if kind.state_bytes > capacity => DRIFT_BUFFER_TOO_SMALL,
        // SAFETY: the caller's promise; the capacity was just checked.
        Ok((head, kind)) => unsafe { (kind.save)(head, into) },
    }
}

/// Takes up a saved state, all of it or none.
///
/// # Safety
/// As for drift_tick; from points to length readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn drift_restore(
    monitor: *mut drift_monitor_t,
    from: *const u8,
    length: u32,
) -> drift_code_t {
    if from.is_null() {
        return DRIFT_NULL;
    }
    // SAFETY: the caller's promise.
    unsafe {
        opened(monitor).map_or_else(
            |code| code,
            |(head, kind)| (kind.restore)(head, core::slice::from_raw_parts(from, length as usize)),
        )
    }
}
