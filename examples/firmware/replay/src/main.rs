//! Reads a recording from the host and prints every report of four monitors as words: the host computes the same
//! from the same bytes, and every word must agree.
//!
//! `recording.bin`: (r, y, u) in little-endian f32; `counts.bin`: the same in i32 counts.
#![no_std]
#![no_main]

use board::{HostFile, Line};
use drift_core::Report;
use scenario::{ALL_F32, ALL_I32, AllF32, AllI32, PAIR_F32, PAIR_I32, PairF32, PairI32, words};

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

fn print<const C: usize>(name: &str, report: &Report<C>) {
    let mut line = Line::new();
    let mut column = 0;
    words::of(report, |word| {
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

#[board::entry]
fn main() -> ! {
    let (Ok(mut pair), Ok(mut all)) = (PairF32::new(&PAIR_F32), AllF32::new(&ALL_F32)) else {
        board::exit(false)
    };
    let good = ticks(b"recording.bin\0", |sample| {
        let [r, y, u] = sample.map(f32::from_bits);
        if let Some(report) = &pair.tick(r, y, u) {
            print("pair_f32", report);
        }
        if let Some(report) = &all.tick(r, y, u) {
            print("all_f32", report);
        }
    });
    let (Ok(mut pair), Ok(mut all)) = (PairI32::new(&PAIR_I32), AllI32::new(&ALL_I32)) else {
        board::exit(false)
    };
    let good = good
        && ticks(b"counts.bin\0", |sample| {
            let [r, y, u] = sample.map(|word| word as i32);
            if let Some(report) = &pair.tick(r, y, u) {
                print("pair_i32", report);
            }
            if let Some(report) = &all.tick(r, y, u) {
                print("all_i32", report);
            }
        });
    board::exit(good)
}
