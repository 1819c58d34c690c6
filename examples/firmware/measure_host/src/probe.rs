//! The figures of the probe images: what they print in timer ticks becomes instructions, what they are longer
//! than the image without a monitor is the monitor's text.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

use scenario::events::Stretch;

use crate::build::{emulate, image};
use crate::image::{panics, size};
use crate::targets::Target;

/// One row of the table.
#[derive(Debug, Clone)]
pub struct Row {
    target: &'static str,
    config: String,
    tick_mean: f64,
    /// Worst tick of each stretch of the script.
    worst: Vec<(&'static str, u64)>,
    tick_usual: (u64, u64),
    pi_tick: f64,
    text_bytes: u64,
    of_it_routines: u64,
    ram_bytes: u64,
    stack_bytes: u64,
    panic_symbols: usize,
}

/// (image, image without a monitor, what it is).
pub const PROBES: [(&str, &str, &str); 8] = [
    ("smallest_f32", "none_f32", "smallest: pair f32, CUSUM, known baseline"),
    ("pair_f32", "none_f32", "pair f32, CUSUM, curve, 16 blocks"),
    ("all_f32", "none_f32", "all f32, 3 channels, 4 detectors, 8 blocks"),
    ("back_f32", "none_f32", "the same with a memory of 3 windows"),
    ("learn_f32", "none_f32", "the same, that memory learnt in place at each decision"),
    ("everything_f32", "none_f32", "everything f32: overlap, limits, blanking"),
    ("pair_i32", "none_i32", "pair i32, CUSUM, curve, 8 blocks"),
    ("all_i32", "none_i32", "all i32, 3 channels, 4 detectors, 4 blocks"),
];

/// The same of the C interface.
const C_PROBES: [(&str, &str, &str); 4] = [
    ("c_small", "none_f32", "C: drift_small, CUSUM, known baseline"),
    ("c_pair", "none_f32", "C: drift_pair, CUSUM, curve, 16 blocks"),
    ("c_full", "none_f32", "C: drift_full, 3 channels, 4 detectors, 8 blocks"),
    ("c_pair_i32", "none_i32", "C: drift_pair_i32, CUSUM, curve, 8 blocks"),
];

impl Row {
    /// The worst tick that there is.
    fn tick_max(&self) -> u64 {
        self.worst.iter().map(|(_, worst)| *worst).max().unwrap_or(0)
    }

    /// As JSON.
    pub fn json(row: &Row) -> Value {
        let worst: serde_json::Map<String, Value> =
            row.worst.iter().map(|(name, worst)| ((*name).to_string(), json!(worst))).collect();
        json!({
            "target": row.target, "config": row.config, "tick_mean": row.tick_mean, "tick_max": row.tick_max(),
            "tick_worst": worst, "tick_usual_min": row.tick_usual.0, "tick_usual_max": row.tick_usual.1,
            "pi_tick": row.pi_tick, "text_bytes": row.text_bytes, "text_routines": row.of_it_routines,
            "ram_bytes": row.ram_bytes, "stack_bytes": row.stack_bytes, "panic_symbols": row.panic_symbols,
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
    for (program, empty, config) in PROBES.into_iter().chain(C_PROBES) {
        let path = image(target, program);
        let lines = parse(&emulate(target, &path)?)?;
        let row = row(target, program, empty, config, &lines).with_context(|| path.display().to_string())?;
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
    lines: &BTreeMap<String, Vec<f64>>,
) -> Result<Row> {
    let instructions = |ticks: f64| ticks / ticks_per_instruction(target);
    let whole = |ticks: f64| instructions(ticks).round() as u64;
    let mut worst = Vec::new();
    for stretch in Stretch::ALL {
        let [_, _, most, ..] = numbers::<5>(lines, stretch.name())?;
        worst.push((stretch.name(), whole(most)));
    }
    let healthy = numbers::<5>(lines, Stretch::Healthy.name())?;
    let (with, without) = (size(&image(target, program))?, size(&image(target, empty))?);
    let pi = numbers::<5>(lines, if program.ends_with("i32") { "pi_counts" } else { "pi" })?;
    let one = |name: &str| numbers::<1>(lines, name).map(|[n]| n as u64);
    Ok(Row {
        target: target.triple,
        config: config.to_string(),
        tick_mean: (instructions(healthy[1] / healthy[0]) * 100.0).round() / 100.0,
        worst,
        tick_usual: (whole(healthy[3]), whole(healthy[4])),
        pi_tick: (instructions(pi[1] / pi[0]) * 100.0).round() / 100.0,
        text_bytes: with.text.saturating_sub(without.text),
        of_it_routines: with.routines.saturating_sub(without.routines),
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

/// The table, in Markdown, and where the worst ticks come from.
pub fn print(rows: &[Row]) {
    println!(
        "\n| target | configuration | tick, mean | tick, usual | tick, worst | PI tick | text B | of it routines | RAM B | stack B | panics |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for r in rows {
        println!(
            "| {} | {} | {:.1} | {}-{} | {} | {:.1} | {} | {} | {} | {} | {} |",
            r.target,
            r.config,
            r.tick_mean,
            r.tick_usual.0,
            r.tick_usual.1,
            r.tick_max(),
            r.pi_tick,
            r.text_bytes,
            r.of_it_routines,
            r.ram_bytes,
            r.stack_bytes,
            r.panic_symbols
        );
    }
    println!("\n| target | configuration | {} |", Stretch::ALL.map(Stretch::name).join(" | "));
    println!("|---|---{}|", "|---".repeat(Stretch::ALL.len()));
    for r in rows {
        let worst: Vec<String> = r.worst.iter().map(|(_, worst)| worst.to_string()).collect();
        println!("| {} | {} | {} |", r.target, r.config, worst.join(" | "));
    }
}
