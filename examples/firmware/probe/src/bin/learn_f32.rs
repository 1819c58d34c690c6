//! `scenario::BACK_F32` timed while the effort channel learns a memory of three windows in place: at every decision a window is
//! learnt and the relation asked for, of which a firmware does the second once.
#![no_std]
#![no_main]

use core::hint::black_box;

use drift_core::{Input, MemoryCommissioning, Order};
use scenario::plant::Noise;
use scenario::{BACK_F32, BackF32, BackReport};

/// The monitor and what it learns.
struct Learner {
    monitor: BackF32,
    effort: MemoryCommissioning<Order<3>>,
}

/// What a loop's interrupt would call, and nothing else of ours.
#[inline(never)]
fn tick(state: &mut Learner, r: f32, y: f32, u: f32) {
    if let Some(report) = BACK_F32.tick(&mut state.monitor, r, y, u) {
        learn(&mut state.effort, report);
    }
}

/// What it would call without a sample.
#[inline(never)]
fn without(state: &mut Learner, input: Input<f32>) {
    if let Some(report) = BACK_F32.tick_input(&mut state.monitor, input) {
        learn(&mut state.effort, report);
    }
}

/// What a low-priority task would do; here it is part of the tick.
#[inline(never)]
fn learn(effort: &mut MemoryCommissioning<Order<3>>, report: &BackReport) {
    effort.learn(report);
    _ = black_box(effort.relation());
    black_box(report);
}

/// Windows enough for all orders, so that every one of them is solved from the first decision on.
fn warmed_up() -> MemoryCommissioning<Order<3>> {
    let (mut effort, mut noise) = (MemoryCommissioning::of_channel(1), Noise::new(3));
    let mut value = 0.0;
    for hop in 0..260 {
        let x = noise.uniform();
        value = 0.5 * value + x + 0.1 * noise.uniform();
        effort.learn_window(hop, x, value, 0.0);
    }
    effort
}

#[board::entry]
fn main() -> ! {
    board::Line::new().text("ram ").number(size_of::<Learner>() as u32).print();
    let mut state = Learner { monitor: BACK_F32.start(), effort: warmed_up() };
    probe::run::f32(BACK_F32.config(), |input| match input {
        Input::Sample { r, y, u } => tick(&mut state, r, y, u),
        other => without(&mut state, other),
    });
    board::exit(true)
}
