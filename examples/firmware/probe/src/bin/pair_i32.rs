//! `scenario::PAIR_I32` timed.
#![no_std]
#![no_main]

use core::hint::black_box;

use drift_core::Input;
use scenario::{PAIR_I32, PairI32, PairReportI32};

/// What a loop's interrupt would call, and nothing else of ours.
#[inline(never)]
fn tick(state: &mut PairI32, r: i32, y: i32, u: i32) {
    if let Some(report) = PAIR_I32.tick(state, r, y, u) {
        hand_over(report);
    }
}

/// What it would call without a sample.
#[inline(never)]
fn without(state: &mut PairI32, input: Input<i32>) {
    if let Some(report) = PAIR_I32.tick_input(state, input) {
        hand_over(report);
    }
}

/// Where the report would go to a low-priority task.
#[inline(never)]
fn hand_over(report: &PairReportI32) {
    black_box(report);
}

#[board::entry]
fn main() -> ! {
    board::Line::new().text("ram ").number(size_of::<PairI32>() as u32).print();
    let mut state = PAIR_I32.start();
    probe::run::i32(PAIR_I32.config(), |input| match input {
        Input::Sample { r, y, u } => tick(&mut state, r, y, u),
        other => without(&mut state, other),
    });
    board::exit(true)
}
