//! The run: every call is timed on its own, the ruler's time taken off; sums, extremes and the stack are printed
//! in timer ticks, which the host turns into instructions.

use core::hint::black_box;

use board::{Line, clock};
use drift_core::{Config, Input};
use scenario::events::{Script, Stretch, WINDOWS};
use scenario::pi::{Pi, PiCounts};
use scenario::plant::Noise;

use crate::rivals;

/// Ticks of a rival that are timed.
const TICKS: u32 = 8000;

#[derive(Clone, Copy)]
struct Tally {
    count: u32,
    sum: u32,
    most: u32,
    /// Outside decisions and block ends.
    usual_least: u32,
    usual_most: u32,
}

impl Tally {
    const NEW: Self = Self { count: 0, sum: 0, most: 0, usual_least: u32::MAX, usual_most: 0 };

    fn add(&mut self, ticks: u32, usual: bool) {
        self.count = self.count.saturating_add(1);
        self.sum = self.sum.saturating_add(ticks);
        self.most = self.most.max(ticks);
        if usual {
            self.usual_least = self.usual_least.min(ticks);
            self.usual_most = self.usual_most.max(ticks);
        }
    }

    fn print(&self, name: &str) {
        let mut line = Line::new();
        line.text(name).text(" ").number(self.count).text(" ").number(self.sum).text(" ").number(self.most);
        line.text(" ")
            .number(self.usual_least.min(self.usual_most))
            .text(" ")
            .number(self.usual_most)
            .print();
    }
}

/// A loop in f32, through the whole script.
pub fn f32<const C: usize>(config: &Config<f32, C>, mut tick: impl FnMut(Input<f32>)) {
    clock::start();
    rivals_f32();
    let mut script = Script::new(config.window_ticks());
    let mut tallies = [Tally::NEW; Stretch::ALL.len()];
    board::repaint_stack();
    let before = board::stack_painted();
    for n in 0..config.window_ticks().saturating_mul(WINDOWS) {
        let (stretch, input) = black_box(script.tick());
        let ruler = clock::time(|| match input {
            Input::Sample { r, y, u } => _ = black_box(rivals::nothing(r, y, u)),
            _ => _ = black_box(rivals::nothing(0.0, 0.0, 0.0)),
        });
        let ticks = clock::time(|| tick(input)).saturating_sub(ruler);
        if let Some(tally) = tallies.get_mut(stretch as usize) {
            tally.add(ticks, !(n + 1).is_multiple_of(config.block_ticks.max(1)));
        }
    }
    print(&tallies, before);
}

/// A loop in counts, through the whole script.
pub fn i32<const C: usize>(config: &Config<i32, C>, mut tick: impl FnMut(Input<i32>)) {
    clock::start();
    rivals_f32();
    rivals_i32();
    let mut script = Script::new(config.window_ticks());
    let mut tallies = [Tally::NEW; Stretch::ALL.len()];
    board::repaint_stack();
    let before = board::stack_painted();
    for n in 0..config.window_ticks().saturating_mul(WINDOWS) {
        let (stretch, input) = black_box(script.tick_counts());
        let ruler = clock::time(|| match input {
            Input::Sample { r, y, u } => _ = black_box(rivals::nothing_counts(r, y, u)),
            _ => _ = black_box(rivals::nothing(0.0, 0.0, 0.0)),
        });
        let ticks = clock::time(|| tick(input)).saturating_sub(ruler);
        if let Some(tally) = tallies.get_mut(stretch as usize) {
            tally.add(ticks, !(n + 1).is_multiple_of(config.block_ticks.max(1)));
        }
    }
    print(&tallies, before);
}

fn print(tallies: &[Tally; Stretch::ALL.len()], stack_before: u32) {
    stack(stack_before);
    for (stretch, tally) in Stretch::ALL.iter().zip(tallies) {
        tally.print(stretch.name());
    }
}

fn stack(before: u32) {
    let used = before.saturating_sub(board::stack_painted());
    Line::new().text("stack ").number(used).print();
}

/// The PI tick in counts.
#[inline(never)]
fn rivals_i32() {
    let mut noise = Noise::new(7);
    let mut pi = PiCounts { kp: 512, ki_ts: 3, u_max: 40_000, integral: 0 };
    let mut tally = Tally::NEW;
    for _ in 0..TICKS {
        let y = black_box(4096 + (noise.bits() >> 22) as i32 - 512);
        let ruler = clock::time(|| _ = black_box(rivals::nothing_counts(4096, y, 0)));
        let ticks = clock::time(|| _ = black_box(rivals::pi_counts_tick(&mut pi, 4096, y)));
        tally.add(ticks.saturating_sub(ruler), true);
    }
    tally.print("pi_counts");
}

#[inline(never)]
fn rivals_f32() {
    let mut noise = Noise::new(7);
    let mut pi = Pi { kp: 2.0, ki_ts: 0.01, u_min: -10.0, u_max: 10.0, integral: 0.0 };
    let mut section = rivals::SECTION;
    let Some(mut nexus) = rivals::nexus() else { return };
    let (mut pi_tally, mut section_tally, mut nexus_tally) = (Tally::NEW, Tally::NEW, Tally::NEW);
    for _ in 0..TICKS {
        let y = black_box(1.0 + 0.1 * noise.uniform());
        let ruler = clock::time(|| _ = black_box(rivals::nothing(1.0, y, 0.0)));
        let of_pi = clock::time(|| _ = black_box(rivals::pi_tick(&mut pi, 1.0, y)));
        let of_section = clock::time(|| _ = black_box(rivals::section_run(&mut section, y)));
        let of_nexus = clock::time(|| _ = black_box(rivals::nexus_update(&mut nexus, y)));
        pi_tally.add(of_pi.saturating_sub(ruler), true);
        section_tally.add(of_section.saturating_sub(ruler), true);
        nexus_tally.add(of_nexus.saturating_sub(ruler), true);
    }
    pi_tally.print("pi");
    section_tally.print("biquad");
    nexus_tally.print("nexus_cusum");
}
