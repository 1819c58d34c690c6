//! The opaque monitor: configuration and monitor side by side in the caller's memory, and what is checked before
//! every use. The monitor refers to the configuration beside it, so it must stay where it is; its own address,
//! kept inside, shows when it was moved or never initialised.

use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut};

use drift_core::{Config, IndexSet, Input, Monitor, Report};

use crate::codes::{
    self, DRIFT_MANUAL, DRIFT_MISALIGNED, DRIFT_MISSING, DRIFT_NOT_INITIALISED, DRIFT_NULL, DRIFT_OK,
    DRIFT_REPORT,
};
use crate::config::{FromLimit, drift_config_t};
use crate::report::drift_report_t;

/// Most blocks per window.
pub const DRIFT_BLOCKS: usize = 16;

/// What lies in the caller's words.
#[repr(C)]
pub(crate) struct Storage<N: FromLimit, S: IndexSet<N>, const C: usize> {
    /// The address of this, once initialised, mixed with a constant that stray memory hardly holds.
    seal: usize,
    config: MaybeUninit<Config<N, C>>,
    monitor: MaybeUninit<Monitor<'static, N, S, DRIFT_BLOCKS, C>>,
}

const SEAL: usize = 0x6472_6966;

fn aligned<T>(pointer: *const T) -> Result<(), i32> {
    if pointer.is_null() {
        Err(DRIFT_NULL)
    } else if !pointer.is_aligned() {
        Err(DRIFT_MISALIGNED)
    } else {
        Ok(())
    }
}

impl<N: FromLimit, S: IndexSet<N>, const C: usize> Storage<N, S, C> {
    /// Checks the configuration and starts the monitor.
    ///
    /// # Safety
    /// Pointers that are neither null nor misaligned point to memory of their type, `this` to writable memory.
    pub unsafe fn init(this: *mut Self, config: *const drift_config_t) -> i32 {
        let start = || -> Result<(), i32> {
            aligned(this)?;
            aligned(config)?;
            // SAFETY: checked above and promised by the caller; any bytes are a valid drift_config_t.
            let config = unsafe { &*config }.convert::<N, C>()?;
            // SAFETY: `this` is valid for writes; field by field, no reference to the whole is made.
            let kept: &'static Config<N, C> = unsafe {
                addr_of_mut!((*this).seal).write(0);
                let place = addr_of_mut!((*this).config);
                place.write(MaybeUninit::new(config));
                // The configuration lives as long as the monitor beside it, and is not written while that does:
                // `seal` makes every other call refuse a monitor that is not initialised at this address.
                (*place).assume_init_ref()
            };
            let monitor = Monitor::new(kept).map_err(codes::of_config)?;
            // SAFETY: as above.
            unsafe {
                addr_of_mut!((*this).monitor).write(MaybeUninit::new(monitor));
                addr_of_mut!((*this).seal).write(this as usize ^ SEAL);
            }
            Ok(())
        };
        start().err().unwrap_or(DRIFT_OK)
    }

    /// The monitor, if it is one.
    ///
    /// # Safety
    /// As for [`Storage::init`], and no other call uses the monitor at the same time.
    unsafe fn monitor<'a>(this: *mut Self) -> Result<&'a mut Monitor<'static, N, S, DRIFT_BLOCKS, C>, i32> {
        aligned(this)?;
        // SAFETY: not null, aligned, and the caller's; the seal is a plain number whatever the bytes are.
        unsafe {
            if addr_of!((*this).seal).read() != this as usize ^ SEAL {
                return Err(DRIFT_NOT_INITIALISED);
            }
            // The seal says that init has written it.
            Ok((*addr_of_mut!((*this).monitor)).assume_init_mut())
        }
    }

    fn answer(report: Option<Report<C>>, into: *mut drift_report_t) -> i32 {
        let Some(report) = &report else { return DRIFT_OK };
        // SAFETY: checked by the calling function before the tick was counted; the caller's memory.
        unsafe { into.write(drift_report_t::of(report)) };
        DRIFT_REPORT
    }

    /// One tick with a sample.
    ///
    /// # Safety
    /// As for [`Storage::monitor`]; `into` as `this`.
    pub unsafe fn tick(this: *mut Self, r: N, y: N, u: N, into: *mut drift_report_t) -> i32 {
        if let Err(code) = aligned(into) {
            return code;
        }
        // SAFETY: the caller's promise.
        match unsafe { Self::monitor(this) } {
            Ok(monitor) => Self::answer(monitor.tick(r, y, u), into),
            Err(code) => code,
        }
    }

    /// One tick without a sample.
    ///
    /// # Safety
    /// As for [`Storage::tick`].
    pub unsafe fn tick_without(this: *mut Self, why: u32, into: *mut drift_report_t) -> i32 {
        let input = match why {
            DRIFT_MANUAL => Input::Manual,
            DRIFT_MISSING => Input::Missing,
            _ => return codes::DRIFT_BAD_CONFIG,
        };
        if let Err(code) = aligned(into) {
            return code;
        }
        // SAFETY: the caller's promise.
        match unsafe { Self::monitor(this) } {
            Ok(monitor) => Self::answer(monitor.tick_input(input), into),
            Err(code) => code,
        }
    }

    /// Forgets alarms and courses.
    ///
    /// # Safety
    /// As for [`Storage::monitor`].
    pub unsafe fn acknowledge(this: *mut Self) -> i32 {
        // SAFETY: the caller's promise.
        unsafe { Self::monitor(this) }.map_or_else(
            |code| code,
            |monitor| {
                monitor.acknowledge();
                DRIFT_OK
            },
        )
    }

    /// Saves; the bytes used (above zero), or a code.
    ///
    /// # Safety
    /// As for [`Storage::monitor`]; `into` points to `capacity` writable bytes.
    pub unsafe fn save(this: *mut Self, into: *mut u8, capacity: u32) -> i32 {
        if into.is_null() {
            return DRIFT_NULL;
        }
        // SAFETY: the caller's promise; the bytes are written before they are read.
        let (monitor, bytes) = unsafe {
            into.write_bytes(0, capacity as usize);
            (Self::monitor(this), core::slice::from_raw_parts_mut(into, capacity as usize))
        };
        match monitor {
            Ok(monitor) => monitor.save(bytes).map_or_else(codes::of_state, |used| used as i32),
            Err(code) => code,
        }
    }

    /// Takes up a saved state, all of it or none.
    ///
    /// # Safety
    /// As for [`Storage::monitor`]; `from` points to `length` readable bytes.
    pub unsafe fn restore(this: *mut Self, from: *const u8, length: u32) -> i32 {
        if from.is_null() {
            return DRIFT_NULL;
        }
        // SAFETY: the caller's promise.
        let (monitor, bytes) =
            unsafe { (Self::monitor(this), core::slice::from_raw_parts(from, length as usize)) };
        match monitor {
            Ok(monitor) => monitor.restore(bytes).map_or_else(codes::of_state, |()| DRIFT_OK),
            Err(code) => code,
        }
    }
}
