//! The configuration as a C header for `drift.h`, which it includes. Values stand in the order of the structures, each
//! with its name as a comment: designated ones are no C++ before C++20.

use std::fmt::Write as _;

use drift_core::{ChannelKind, Detectors, Index};

use super::{BaselineFile, ChannelEntry, PointColumns};

pub(super) fn write(file: &BaselineFile) -> String {
    let mut text = String::from(
        "/* The healthy loop's baseline, from `drift calibrate`. C99, C++11. */
#ifndef DRIFT_BASELINE_H
#define DRIFT_BASELINE_H
#include \"drift.h\"
",
    );
    // Writing into a String can't fail.
    let _ = config(&mut text, file);
    if let Some(point) = &file.operating_point {
        let _ = operating_point(&mut text, point);
    }
    text.push_str("\n#endif\n");
    text
}

fn config(text: &mut String, file: &BaselineFile) -> std::fmt::Result {
    let (timing, samples, decision) = (&file.timing, &file.samples, &file.decision);
    let (saturation, blanking) = (&samples.saturation, &samples.blanking);
    writeln!(text, "\nstatic const drift_config_t drift_config = {{")?;
    let numbers = [
        ("sample_time_s", float(timing.sample_time_s)),
        ("block_ticks", format!("{}u", timing.block_ticks)),
        ("window_blocks", format!("{}u", timing.window_blocks)),
        ("hop_blocks", format!("{}u", timing.hop_blocks)),
        ("min_valid", float(samples.min_valid)),
        ("y_unit", float(1.0)),
        ("u_unit", float(1.0)),
        ("has_saturation", flag(saturation.is_some())),
        ("u_min", float(saturation.map_or(0.0, |s| s.u_min))),
        ("u_max", float(saturation.map_or(0.0, |s| s.u_max))),
        ("has_blanking", flag(blanking.is_some())),
        ("blank_reference_step", float(blanking.map_or(0.0, |b| b.reference_step))),
        ("blank_ticks", format!("{}u", blanking.map_or(0, |b| b.ticks))),
        ("confirm_hops", format!("{}u", decision.confirm_hops)),
        ("log_odds", float(decision.log_odds)),
        ("smallest_shift", float(decision.smallest_shift)),
    ];
    numbers.iter().try_for_each(|(name, value)| writeln!(text, "    /* {name} */ {value},"))?;
    writeln!(text, "    /* channels */ {{")?;
    file.channels.iter().try_for_each(|entry| channel(text, entry))?;
    writeln!(text, "    }}\n}};")
}

/// The monitor's number from the measured ones, for `drift_operating_point`.
fn operating_point(text: &mut String, point: &PointColumns) -> std::fmt::Result {
    let names: Vec<String> = (1..=point.columns.len()).map(|k| format!("x{k}")).collect();
    let terms: Vec<String> = point
        .scales
        .iter()
        .zip(&names)
        .map(|(scale, name)| format!("{} * ({name})", float(*scale)))
        .collect();
    writeln!(text, "\n/* The operating point of a tick, for drift_operating_point(), from")?;
    for (name, column) in names.iter().zip(&point.columns) {
        writeln!(text, " *   {name}: {}", column.replace("*/", "* /").replace(['\n', '\r'], " "))?;
    }
    writeln!(text, " */")?;
    writeln!(text, "#define DRIFT_OPERATING_POINT_OF({}) ({})", names.join(", "), terms.join(" + "))
}

fn channel(text: &mut String, entry: &ChannelEntry) -> std::fmt::Result {
    let (b, d, m) = (&entry.channel.baseline, &entry.channel.detectors, &entry.channel.memory);
    let p = &entry.channel.operating_point;
    let point = [p.weight, p.mean, p.per_x, p.ss, p.min, p.max];
    let (kind, index) = names(entry.channel.kind);
    let baseline = [b.b0, b.b1, b.sigma, b.windows, b.x_mean, b.x_ss, b.x_min, b.x_max];
    let parts = [
        ("kind", kind.to_owned()),
        ("index", index.to_owned()),
        ("b0, b1, sigma, windows, x_mean, x_ss, x_min, x_max", list(&baseline)),
        ("memory: order, x, value", format!("{{ {}u, {}, {} }}", m.order, list(&m.x), list(&m.value))),
        ("operating_point: weight, mean, per_x, ss, min, max", list(&point)),
    ];
    let mut parts: Vec<(String, String)> =
        parts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    let mut numbers = Vec::new();
    for row in Detectors::ROWS {
        let mut of = Vec::new();
        let is_there = (row.numbers)(d, &mut |x| of.push(x));
        of.resize(row.fields.len(), 0.0);
        parts.push((format!("has_{}", row.name), flag(is_there)));
        numbers.push((format!("{}: {}", row.name, row.fields.join(", ")), list(&of)));
    }
    parts.extend(numbers);
    writeln!(text, "        {{")?;
    parts.iter().try_for_each(|(name, value)| writeln!(text, "            /* {name} */ {value},"))?;
    writeln!(text, "        }},")
}

fn list(numbers: &[f32]) -> String {
    format!("{{ {} }}", numbers.iter().map(|x| float(*x)).collect::<Vec<_>>().join(", "))
}

fn flag(is: bool) -> String {
    u8::from(is).to_string()
}

/// The macros of a kind and of its index; a kind without one has IAE, which is not looked at.
fn names(kind: ChannelKind) -> (String, String) {
    let index = match kind.index().unwrap_or(Index::Iae) {
        Index::Iae => "IAE",
        Index::Ise => "ISE",
        Index::Itae => "ITAE",
        Index::Itse => "ITSE",
    };
    (format!("DRIFT_{}", kind.name().to_uppercase()), format!("DRIFT_{index}"))
}

/// The fewest digits that name the same `float`.
fn float(x: f32) -> String {
    format!("{x:?}f")
}
