//! Writes a made plant: `make_plant FOLDER LOOPS HEALTHY_SAMPLES LATER_SAMPLES [ROWS_BY_TURNS]` makes `healthy.parquet` of [`KINDS`] loops and
//! `later.parquet` of all of them. Loops beyond the first [`KINDS`] are copies of those under other names, so that a plant of thousands is made
//! in a minute; fewer are written as they are made, and may be of any length. With `ROWS_BY_TURNS` the loops take turns with so many rows each,
//! as a historian writes them; else one follows the other. The measurements of docs/fleets.md stand on it.
#![allow(clippy::unwrap_used, clippy::expect_used, dead_code)]

#[path = "../tests/made_loops/mod.rs"]
mod made_loops;

use made_loops::{Making, Run, run, tag, write_parquet};

/// Loops that differ.
const KINDS: usize = 20;
/// Samples that are made and written at once.
const PART: usize = 1 << 20;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((folder, numbers)) = arguments.split_first().filter(|(_, n)| matches!(n.len(), 3 | 4)) else {
        eprintln!("make_plant FOLDER LOOPS HEALTHY_SAMPLES LATER_SAMPLES [ROWS_BY_TURNS]");
        std::process::exit(2);
    };
    let numbers: Vec<usize> = numbers.iter().map(|n| n.parse().expect("a number")).collect();
    let (loops, samples, turns) = (numbers[0], numbers[2], numbers.get(3).copied().unwrap_or(0));
    let folder = std::path::Path::new(folder);
    std::fs::create_dir_all(folder).unwrap();
    let kinds = loops.min(KINDS);
    write_parquet(&folder.join("healthy.parquet"), &mut (0..kinds).map(|n| run(n, numbers[1], true)), 0);
    let later = folder.join("later.parquet");
    if loops <= KINDS && turns == 0 {
        let parts = |n: usize| {
            let mut making = Making::new(n, samples, false);
            (0..samples).step_by(PART).map(move |from| making.part(PART.min(samples - from)))
        };
        write_parquet(&later, &mut (0..loops).flat_map(parts), 0);
        return;
    }
    let made: Vec<Run> = (0..kinds).map(|n| run(n, samples, false)).collect();
    let mut all = (0..loops).map(|n| Run { tag: tag(n), ..made[n % kinds].clone() });
    write_parquet(&later, &mut all, turns);
}
