//! The same image without a monitor: what is left is not ours.
#![no_std]
#![no_main]

use core::hint::black_box;

#[inline(never)]
fn tick(r: i32, y: i32, u: i32) {
    black_box((r, y, u));
}

#[board::entry]
fn main() -> ! {
    board::Line::new().text("ram ").number(0).print();
    probe::run::i32(250, tick);
    board::exit(true)
}
