//! The two inner loops by themselves, for `.ci/rivals`, which times them beside others' on the same numbers: the monitor of the
//! paper's pair, tick by tick and on slices, and the paper's loop, step by step and whole. Block sums by hand are the pair's physical
//! limit: nothing is checked, nothing is judged.
//!
//! ```sh
//! cargo run --release -p drift-examples --bin inner_loops -- tick 1000000
//! ```
//!
//! Prints what came out, so that nobody can have left something out: of the pair the decisions and the last window's E_u and IAE, of
//! the loop the sums of y and u over the last round of its reference.

use std::hint::black_box;

use drift_core::{
    Baseline, Channel, ChannelKind, Config, Cusum, Detectors, Iae, Index, PairIndices, PairMonitor,
};
use drift_sim::control_loop::Loop;
use drift_sim::simulate::{Simulation, simulate};

/// Samples that are repeated; 16 blocks of 250 ticks.
const ROUND: usize = 4000;
const BLOCK: usize = 250;
const BLOCKS: usize = 16;
const TICK_S: f32 = 0.001;
/// Rounds that are simulated at once, each time from rest.
const PART_ROUNDS: usize = 100;

type Outcome = Result<String, Box<dyn std::error::Error>>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let usage = "inner_loops tick|ticks|sums|sums-of-slices|step|simulate COUNT";
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [what, count] = arguments.as_slice() else { return Err(usage.into()) };
    let rounds = count.parse::<usize>().map_err(|_| usage)?.div_ceil(ROUND);
    let outcome = match what.as_str() {
        "tick" => tick(rounds),
        "ticks" => ticks(rounds),
        "sums" => Ok(sums(rounds)),
        "sums-of-slices" => Ok(sums_of_slices(rounds)),
        "step" => step(rounds),
        "simulate" => whole(rounds),
        _ => Err(usage.into()),
    };
    println!("{}", outcome?);
    Ok(())
}

/// Numbers in [0, 1), the same in every language: a congruential generator's upper 24 bits.
struct Uniform(u32);

impl Iterator for Uniform {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        Some(f64::from(self.0 >> 8) / f64::from(1 << 24))
    }
}

/// r, y and u of a round.
fn samples() -> [Vec<f32>; 3] {
    let mut uniform = Uniform(1);
    let mut column =
        |scale: f64| uniform.by_ref().take(ROUND).map(|x| (scale * (x - 0.5)) as f32).collect::<Vec<_>>();
    black_box([column(1.0), column(1.0), column(10.0)])
}

fn monitor() -> Result<PairMonitor<f32, Iae, BLOCKS>, drift_core::ConfigError> {
    let detectors = Detectors { cusum: Some(Cusum::new(0.5, 5.07)), ..Detectors::NONE };
    let channel =
        Channel::new(ChannelKind::EnergyError(Index::Iae), Baseline::known(0.12, 5.3e-6, 0.0085), detectors);
    PairMonitor::new(Config::new(TICK_S, BLOCK as u32, BLOCKS as u16, [channel]))
}

fn said(decisions: u64, last: PairIndices) -> String {
    format!("{decisions} {} {}", last.e_u, last.error)
}

fn tick(rounds: usize) -> Outcome {
    let ([r, y, u], mut monitor) = (samples(), monitor()?);
    let (mut decisions, mut last) = (0, PairIndices { e_u: 0.0, error: 0.0 });
    for _ in 0..rounds {
        for ((r, y), u) in r.iter().zip(&y).zip(&u) {
            if let Some(report) = monitor.tick(*r, *y, *u) {
                (decisions, last) = (decisions + 1, report.indices);
            }
        }
    }
    Ok(said(decisions, last))
}

fn ticks(rounds: usize) -> Outcome {
    let ([r, y, u], mut monitor) = (samples(), monitor()?);
    let (mut decisions, mut last) = (0, PairIndices { e_u: 0.0, error: 0.0 });
    for _ in 0..rounds {
        monitor.ticks(&r, &y, &u, |report| (decisions, last) = (decisions + 1, report.indices));
    }
    Ok(said(decisions, last))
}

/// Block sums by hand.
#[derive(Default)]
struct ByHand {
    energy: f32,
    error: f32,
    ticks: usize,
    blocks: [(f32, f32); BLOCKS],
    closed: usize,
    decisions: u64,
}

impl ByHand {
    #[inline(always)]
    fn tick(&mut self, r: f32, y: f32, u: f32) {
        self.energy += u * u;
        self.error += (r - y).abs();
        self.ticks += 1;
        if self.ticks == BLOCK {
            self.close();
        }
    }

    #[inline(never)]
    fn close(&mut self) {
        if let Some(block) = self.blocks.get_mut(self.closed % BLOCKS) {
            *block = (self.energy, self.error);
        }
        (self.energy, self.error, self.ticks) = (0.0, 0.0, 0);
        self.closed += 1;
        self.decisions += u64::from(self.closed.is_multiple_of(BLOCKS));
    }

    fn said(&self) -> String {
        let sum = self.blocks.iter().fold((0.0, 0.0), |sum, block| (sum.0 + block.0, sum.1 + block.1));
        said(self.decisions, PairIndices { e_u: sum.0 * TICK_S, error: sum.1 * TICK_S })
    }
}

fn sums(rounds: usize) -> String {
    let ([r, y, u], mut by_hand) = (samples(), ByHand::default());
    for _ in 0..rounds {
        for ((r, y), u) in r.iter().zip(&y).zip(&u) {
            by_hand.tick(*r, *y, *u);
        }
    }
    by_hand.said()
}

/// In whatever order is quickest: several sums side by side.
#[allow(clippy::needless_range_loop, reason = "three rows at one place")]
fn sums_of_slices(rounds: usize) -> String {
    const SIDE: usize = 10;
    let ([r, y, u], mut by_hand) = (samples(), ByHand::default());
    for _ in 0..rounds {
        for ((r, y), u) in r.chunks_exact(BLOCK).zip(y.chunks_exact(BLOCK)).zip(u.chunks_exact(BLOCK)) {
            let (mut energy, mut error) = ([0.0; SIDE], [0.0; SIDE]);
            let rows =
                r.as_chunks::<SIDE>().0.iter().zip(y.as_chunks::<SIDE>().0).zip(u.as_chunks::<SIDE>().0);
            for ((r, y), u) in rows {
                for i in 0..SIDE {
                    energy[i] += u[i] * u[i];
                    error[i] += (r[i] - y[i]).abs();
                }
            }
            (by_hand.energy, by_hand.error) = (energy.iter().sum(), error.iter().sum());
            by_hand.close();
        }
    }
    by_hand.said()
}

/// The reference of a round of the loop.
fn reference() -> Vec<f64> {
    black_box(Uniform(1).take(ROUND).map(|x| x - 0.4).collect())
}

fn step(rounds: usize) -> Outcome {
    let (reference, mut simulation) = (reference(), Simulation::new(&Loop::paper(), 1)?);
    let mut sums = (0.0, 0.0);
    for _ in 0..rounds {
        sums = (0.0, 0.0);
        for r in &reference {
            let step = simulation.step(*r, &[]);
            sums = (sums.0 + step.y, sums.1 + step.u);
        }
    }
    Ok(format!("{} {}", sums.0, sums.1))
}

fn whole(rounds: usize) -> Outcome {
    let reference = reference().repeat(PART_ROUNDS);
    let (mut y, mut u) = (0.0, 0.0);
    for _ in 0..rounds.div_ceil(PART_ROUNDS) {
        let trace = simulate(&Loop::paper(), &reference, &[], 1, None)?;
        let last = |column: &[f64]| column[column.len() - ROUND..].iter().sum::<f64>();
        (y, u) = (last(&trace.y), last(&trace.u));
    }
    Ok(format!("{y} {u}"))
}
