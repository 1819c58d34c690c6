//! Reads a recording from the host and prints every report of nine monitors as words: the host computes the same
//! from the same bytes, and every word must agree.
//!
//! `recording.bin`: (r, y, u) in little-endian f32; `counts.bin`: the same in i32 counts.
#![no_std]
#![no_main]

use board::{HostFile, Line};
use drift_core::{IndexSet, Number, Options, Plan, State};
use scenario::words::Words;
use scenario::{
    ALL_F32, ALL_I32, BACK_F32, EVERYTHING_F32, ITAE_F32, ITAE_I32, PAIR_F32, PAIR_I32, SMALLEST_F32,
};

/// Whole ticks per read.
const CHUNK: usize = 12 * 64;

/// Calls `tick` with the three words of every tick in the file.
fn ticks(name: &[u8], mut tick: impl FnMut([u32; 3])) -> bool {
    let Some(mut file) = HostFile::open(name) else { return false };
    let mut bytes = [0u8; CHUNK];
    loop {
        let read = file.read(&mut bytes);
        for sample in bytes.get(..read).unwrap_or(&[]).chunks_exact(12) {
            let mut words = [0u32; 3];
            for (word, bytes) in words.iter_mut().zip(sample.chunks_exact(4)) {
                *word = bytes.iter().rev().fold(0, |word, &byte| word << 8 | u32::from(byte));
            }
            tick(words);
        }
        if read < CHUNK {
            return true;
        }
    }
}

fn print(name: &str, report: &impl Words) {
    let mut line = Line::new();
    let mut column = 0;
    report.words(&mut |word| {
        if column % 16 == 0 {
            if column > 0 {
                line.print();
            }
            line.text(name);
        }
        line.text(" ").word(word);
        column += 1;
    });
    line.print();
}

/// Saves, starts anew and restores: nothing may show of it.
fn reset<N: Number, S: IndexSet<N>, O: Options, const C: usize>(
    plan: &Plan<N, S, O, C>,
    state: &mut State<N, S, O, C>,
) -> bool {
    let mut bytes = [0u8; 1400];
    let Ok(used) = plan.save(state, &mut bytes) else { return false };
    *state = plan.start();
    bytes.get(..used).is_some_and(|bytes| plan.restore(state, bytes).is_ok())
}

/// Runs the plans named over a file; after [`RESET_AT`] ticks each goes through a reset.
macro_rules! replay {
    ($file:literal, $sample:expr, $($name:literal: $plan:ident),*) => {{
        let mut good = true;
        $({
            let mut state = $plan.start();
            let mut n = 0u32;
            good &= ticks($file, |words| {
                let [r, y, u] = $sample(words);
                if let Some(report) = $plan.tick(&mut state, r, y, u) {
                    print($name, report);
                }
                n = n.wrapping_add(1);
                if n == RESET_AT {
                    good &= reset(&$plan, &mut state);
                }
            });
        })*
        good
    }};
}

/// In the middle of a strip, a block and a window of every plan.
const RESET_AT: u32 = 7_777;

#[board::entry]
fn main() -> ! {
    let floats = |words: [u32; 3]| words.map(f32::from_bits);
    let counts = |words: [u32; 3]| words.map(|word| word as i32);
    let good = replay!(b"recording.bin\0", floats,
        "smallest_f32": SMALLEST_F32, "pair_f32": PAIR_F32, "all_f32": ALL_F32, "back_f32": BACK_F32,
        "everything_f32": EVERYTHING_F32, "itae_f32": ITAE_F32);
    let good_counts =
        replay!(b"counts.bin\0", counts, "pair_i32": PAIR_I32, "all_i32": ALL_I32, "itae_i32": ITAE_I32);
    board::exit(good && good_counts)
}
