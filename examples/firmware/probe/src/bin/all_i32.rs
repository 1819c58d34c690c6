//! `scenario::ALL_I32` timed.
#![no_std]
#![no_main]

use core::hint::black_box;

use drift_core::Report;
use scenario::{ALL_I32, AllI32};

/// What a loop's interrupt would call, and nothing else of ours.
#[inline(never)]
fn tick(monitor: &mut AllI32<'_>, r: i32, y: i32, u: i32) {
    if let Some(report) = &monitor.tick(r, y, u) {
        hand_over(report);
    }
}

/// Where the report would go to a low-priority task.
#[inline(never)]
fn hand_over(report: &Report<3>) {
    black_box(report);
}

#[board::entry]
fn main() -> ! {
    board::Line::new().text("ram ").number(size_of::<AllI32<'_>>() as u32).print();
    let Ok(mut monitor) = AllI32::new(&ALL_I32) else { board::exit(false) };
    probe::run::i32(500, |r, y, u| tick(&mut monitor, r, y, u));
    board::exit(true)
}
