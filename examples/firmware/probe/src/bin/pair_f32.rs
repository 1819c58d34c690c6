//! `scenario::PAIR_F32` timed.
#![no_std]
#![no_main]

use core::hint::black_box;

use drift_core::Input;
use scenario::{PAIR_F32, PairF32, PairReport};

/// What a loop's interrupt would call, and nothing else of ours.
#[inline(never)]
fn tick(state: &mut PairF32, r: f32, y: f32, u: f32) {
    if let Some(report) = PAIR_F32.tick(state, r, y, u) {
        hand_over(report);
    }
}

/// What it would call without a sample.
#[inline(never)]
fn without(state: &mut PairF32, input: Input<f32>) {
    if let Some(report) = PAIR_F32.tick_input(state, input) {
        hand_over(report);
    }
}

/// Where the report would go to a low-priority task.
#[inline(never)]
fn hand_over(report: &PairReport) {
    black_box(report);
}

#[board::entry]
fn main() -> ! {
    board::Line::new().text("ram ").number(size_of::<PairF32>() as u32).print();
    let mut state = PAIR_F32.start();
    probe::run::f32(PAIR_F32.config(), |input| match input {
        Input::Sample { r, y, u } => tick(&mut state, r, y, u),
        other => without(&mut state, other),
    });
    board::exit(true)
}
