//! The report as defmt frames, written through semihosting.

use core::cell::UnsafeCell;

use drift_core::Report;

struct Encoder(UnsafeCell<defmt::Encoder>);

// SAFETY: one thread, no interrupts: frames are written one after the other.
unsafe impl Sync for Encoder {}

static ENCODER: Encoder = Encoder(UnsafeCell::new(defmt::Encoder::new()));

#[defmt::global_logger]
struct Logger;

// SAFETY: one thread, no interrupts: acquire and release can't nest.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        // SAFETY: as above; nobody else holds the encoder.
        unsafe { (*ENCODER.0.get()).start_frame(board::write) }
    }
    unsafe fn flush() {}
    unsafe fn release() {
        // SAFETY: as above.
        unsafe { (*ENCODER.0.get()).end_frame(board::write) }
    }
    unsafe fn write(bytes: &[u8]) {
        // SAFETY: as above.
        unsafe { (*ENCODER.0.get()).write(bytes, board::write) }
    }
}

/// Commissioning is done.
pub fn learnt(windows: u32) {
    defmt::info!("learnt from {=u32} windows", windows);
}

/// The verdict is another than before.
pub fn changed(report: &Report<3>) {
    defmt::info!("hop {=u32}: {}, {}", report.hop, report.verdict, report.location());
}

/// The whole report, every field.
pub fn last(report: &Report<3>) {
    defmt::info!("{}", report);
}
