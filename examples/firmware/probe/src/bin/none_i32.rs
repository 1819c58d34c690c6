//! The same image without a monitor: what is left is not ours.
#![no_std]
#![no_main]

use core::hint::black_box;

use drift_core::{Channel, ChannelKind, Config, Index, Input};

#[inline(never)]
fn tick(r: i32, y: i32, u: i32) {
    black_box((r, y, u));
}

#[inline(never)]
fn without(manual: bool) {
    black_box(manual);
}

static TIMING: Config<i32, 1> =
    Config::new(0.001, 250, 8, [Channel::unlearned(ChannelKind::EnergyError(Index::Iae))]);

#[board::entry]
fn main() -> ! {
    board::Line::new().text("ram ").number(0).print();
    probe::run::i32(&TIMING, |input| match input {
        Input::Sample { r, y, u } => tick(r, y, u),
        other => without(other == Input::Manual),
    });
    board::exit(true)
}
