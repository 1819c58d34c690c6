//! The figures of the probe images: what they print in timer ticks becomes instructions, what they are longer
//! than the image without a monitor is the monitor's text.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

use crate::build::{emulate, image};
use crate::image::{panics, size};
use crate::targets::Target;

/// One row of the table.
#[derive(Debug, Clone)]
pub struct Row {
    target: &'static str,
    config: String,
    tick_mean: f64,
    tick_max: u64,
    tick_usual: (u64, u64),
    hop: u32,
    pi_tick: f64,
    text_bytes: u64,
    ram_bytes: u64,
    stack_bytes: u64,
    panic_symbols: usize,
}

/// (image, image without a monitor, what it is, hop in ticks).
const PROBES: [(&str, &str, &str, u32); 4] = [
    ("pair_f32", "none_f32", "pair f32, CUSUM, 16 blocks", 2000),
    ("all_f32", "none_f32", "all f32, 3 channels, 3 detectors, 8 blocks", 2000),
    ("pair_i32", "none_i32", "pair i32, CUSUM, 8 blocks", 2000),
    ("all_i32", "none_i32", "all i32, 3 channels, 3 detectors, 4 blocks", 2000),
];

impl Row {
    /// As JSON.
    pub fn json(row: &Row) -> Value {
        json!({
            "target": row.target, "config": row.config, "tick_mean": row.tick_mean, "tick_max": row.tick_max,
            "tick_usual_min": row.tick_usual.0, "tick_usual_max": row.tick_usual.1, "hop": row.hop,
            "pi_tick": row.pi_tick, "text_bytes": row.text_bytes, "ram_bytes": row.ram_bytes,
            "stack_bytes": row.stack_bytes, "panic_symbols": row.panic_symbols,
        })
    }
}

/// A line of numbers per name.
fn parse(printed: &[u8]) -> Result<BTreeMap<String, Vec<f64>>> {
    let mut lines = BTreeMap::new();
    for line in String::from_utf8(printed.to_vec())?.lines() {
        let mut words = line.split_whitespace();
        let Some(name) = words.next() else { continue };
        let numbers: Result<Vec<f64>, _> = words.map(str::parse).collect();
        lines.insert(name.to_string(), numbers.with_context(|| line.to_string())?);
    }
    Ok(lines)
}

/// All probes of one target.
pub fn rows(target: &Target) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (program, empty, config, hop) in PROBES {
        let path = image(target, program);
        let lines = parse(&emulate(target, &path)?)?;
        let row =
            row(target, program, empty, config, hop, &lines).with_context(|| path.display().to_string())?;
        if row.panic_symbols > 0 {
            bail!("{}: {}", path.display(), panics(&path)?.join(", "));
        }
        if rows.is_empty() {
            rivals(target, &lines);
        }
        rows.push(row);
    }
    Ok(rows)
}

fn row(
    target: &Target,
    program: &str,
    empty: &str,
    config: &str,
    hop: u32,
    lines: &BTreeMap<String, Vec<f64>>,
) -> Result<Row> {
    let monitor = numbers::<5>(lines, "monitor")?;
    let instructions = |ticks: f64| ticks / ticks_per_instruction(target);
    let (with, without) = (size(&image(target, program))?, size(&image(target, empty))?);
    let ours = |s: crate::image::Size| s.text.saturating_sub(s.routines + s.config);
    let pi = numbers::<5>(lines, if program.ends_with("i32") { "pi_counts" } else { "pi" })?;
    let one = |name: &str| numbers::<1>(lines, name).map(|[n]| n as u64);
    Ok(Row {
        target: target.triple,
        config: config.to_string(),
        tick_mean: (instructions(monitor[1] / monitor[0]) * 100.0).round() / 100.0,
        tick_max: instructions(monitor[2]).round() as u64,
        tick_usual: (instructions(monitor[3]).round() as u64, instructions(monitor[4]).round() as u64),
        hop,
        pi_tick: (instructions(pi[1] / pi[0]) * 100.0).round() / 100.0,
        text_bytes: ours(with).saturating_sub(ours(without)),
        ram_bytes: one("ram")?,
        stack_bytes: one("stack")?,
        panic_symbols: panics(&image(target, program))?.len(),
    })
}

fn numbers<const N: usize>(lines: &BTreeMap<String, Vec<f64>>, name: &str) -> Result<[f64; N]> {
    let found = lines.get(name).with_context(|| format!("the image printed no {name}"))?;
    found.as_slice().try_into().with_context(|| format!("{name}: {found:?}"))
}

/// `-icount shift=10`: 1024 ns an instruction.
fn ticks_per_instruction(target: &Target) -> f64 {
    target.clock_hz * 1024e-9
}

fn rivals(target: &Target, lines: &BTreeMap<String, Vec<f64>>) {
    for (name, what) in
        [("pi", "PI tick"), ("biquad", "one biquad section"), ("nexus_cusum", "nexus-stats CusumF64")]
    {
        if let Ok([count, sum, ..]) = numbers::<5>(lines, name) {
            let mean = sum / count / ticks_per_instruction(target);
            println!("beside    {what} on {}: {mean:.1} instructions", target.core);
        }
    }
}

/// The table, in Markdown.
pub fn print(rows: &[Row]) {
    println!(
        "\n| target | configuration | tick, mean | tick, usual | tick, worst | hop | PI tick | text B | RAM B | stack B | panics |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for r in rows {
        println!(
            "| {} | {} | {:.1} | {}-{} | {} | {} | {:.1} | {} | {} | {} | {} |",
            r.target,
            r.config,
            r.tick_mean,
            r.tick_usual.0,
            r.tick_usual.1,
            r.tick_max,
            r.hop,
            r.pi_tick,
            r.text_bytes,
            r.ram_bytes,
            r.stack_bytes,
            r.panic_symbols
        );
    }
}
