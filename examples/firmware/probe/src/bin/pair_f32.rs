//! `scenario::PAIR_F32` timed.
#![no_std]
#![no_main]

use core::hint::black_box;

use drift_core::Report;
use scenario::{PAIR_F32, PairF32};

/// What a loop's interrupt would call, and nothing else of ours.
#[inline(never)]
fn tick(monitor: &mut PairF32<'_>, r: f32, y: f32, u: f32) {
    if let Some(report) = &monitor.tick(r, y, u) {
        hand_over(report);
    }
}

/// Where the report would go to a low-priority task.
#[inline(never)]
fn hand_over(report: &Report<1>) {
    black_box(report);
}

#[board::entry]
fn main() -> ! {
    board::Line::new().text("ram ").number(size_of::<PairF32<'_>>() as u32).print();
    let Ok(mut monitor) = PairF32::new(&PAIR_F32) else { board::exit(false) };
    probe::run::f32(125, |r, y, u| tick(&mut monitor, r, y, u));
    board::exit(true)
}
