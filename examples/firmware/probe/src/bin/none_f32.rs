//! The same image without a monitor: what is left is not ours.
#![no_std]
#![no_main]

use core::hint::black_box;

#[inline(never)]
fn tick(r: f32, y: f32, u: f32) {
    black_box((r, y, u));
}

#[board::entry]
fn main() -> ! {
    board::Line::new().text("ram ").number(0).print();
    probe::run::f32(250, tick);
    board::exit(true)
}
