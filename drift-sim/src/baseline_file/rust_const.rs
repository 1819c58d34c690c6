//! The configuration as Rust source, for a firmware that holds its baseline in flash.

use drift_core::{Channel, ChannelKind, DetectorRow, Detectors};

use super::{BaselineFile, ChannelEntry, PointColumns};

pub(super) fn write(file: &BaselineFile) -> String {
    let (timing, samples, decision) = (&file.timing, &file.samples, &file.decision);
    let saturation = option(samples.saturation.as_ref(), |s| {
        format!("drift_core::Saturation {{ u_min: {:?}, u_max: {:?} }}", s.u_min, s.u_max)
    });
    let blanking = option(samples.blanking.as_ref(), |b| {
        format!("drift_core::Blanking {{ reference_step: {:?}, ticks: {} }}", b.reference_step, b.ticks)
    });
    let point = file.operating_point.as_ref().map(operating_point).unwrap_or_default();
    let channels: String = file.channels.iter().map(channel).collect();
    format!(
        "/// The healthy loop's baseline, from `drift calibrate`.
pub const CONFIG: drift_core::Config<f32, 3> = drift_core::Config {{
    sample_time_s: {:?},
    block_ticks: {},
    window_blocks: {},
    hop_blocks: {},
    min_valid: {:?},
    y_unit: 1.0,
    u_unit: 1.0,
    saturation: {saturation},
    blanking: {blanking},
    decision: drift_core::Decision {{ confirm_hops: {}, log_odds: {:?}, smallest_shift: {:?} }},
    channels: [
{channels}    ],
}};
{point}",
        timing.sample_time_s,
        timing.block_ticks,
        timing.window_blocks,
        timing.hop_blocks,
        samples.min_valid,
        decision.confirm_hops,
        decision.log_odds,
        decision.smallest_shift,
    )
}

fn channel(entry: &ChannelEntry) -> String {
    let kind = kind(entry.channel.kind);
    if !entry.learned() {
        return format!("        drift_core::Channel::unlearned({kind}),\n");
    }
    let b = &entry.channel.baseline;
    format!(
        "        drift_core::Channel {{
            kind: {kind},
            baseline: drift_core::Baseline {{
                b0: {:?},
                b1: {:?},
                sigma: {:?},
                windows: {:?},
                x_mean: {:?},
                x_ss: {:?},
                x_min: {:?},
                x_max: {:?},
            }},
            memory: {},
            operating_point: {},
            detectors: drift_core::Detectors {{
{}            }},
        }},
",
        b.b0,
        b.b1,
        b.sigma,
        b.windows,
        b.x_mean,
        b.x_ss,
        b.x_min,
        b.x_max,
        memory(&entry.channel),
        weight(&entry.channel),
        detectors(&entry.channel),
    )
}

fn detectors(channel: &Channel) -> String {
    let line = |row: &DetectorRow| {
        let mut numbers = Vec::new();
        (row.numbers)(&channel.detectors, &mut |x| numbers.push(x)).then(|| {
            let pairs: Vec<String> =
                row.fields.iter().zip(&numbers).map(|(name, x)| format!("{name}: {x:?}")).collect();
            let (name, kind) = (row.name, row.type_name);
            format!("                {name}: Some(drift_core::{kind} {{ {} }}),\n", pairs.join(", "))
        })
    };
    let lines: String = Detectors::ROWS.iter().filter_map(line).collect();
    lines + "                ..drift_core::Detectors::NONE\n"
}

fn memory(channel: &Channel) -> String {
    let m = &channel.memory;
    if m.order == 0 {
        return "drift_core::Memory::NONE".to_owned();
    }
    format!("drift_core::Memory {{ order: {}, x: {:?}, value: {:?} }}", m.order, m.x, m.value)
}

fn weight(channel: &Channel) -> String {
    let p = &channel.operating_point;
    if !p.counts() {
        return "drift_core::OperatingPoint::NONE".to_owned();
    }
    format!(
        "drift_core::OperatingPoint {{
                weight: {:?},
                mean: {:?},
                per_x: {:?},
                ss: {:?},
                min: {:?},
                max: {:?},
            }}",
        p.weight, p.mean, p.per_x, p.ss, p.min, p.max
    )
}

/// The monitor's number from the measured ones, for `tick_at` of a `drift_core::FullAt` monitor.
fn operating_point(point: &PointColumns) -> String {
    let names: Vec<String> = (1..=point.columns.len()).map(|k| format!("x{k}")).collect();
    let lines: String = names
        .iter()
        .zip(&point.columns)
        .map(|(name, column)| format!("/// * {name}: {}\n", column.replace(['\n', '\r'], " ")))
        .collect();
    let arguments: Vec<String> = names.iter().map(|name| format!("{name}: f32")).collect();
    let terms: Vec<String> =
        point.scales.iter().zip(&names).map(|(scale, name)| format!("{scale:?} * {name}")).collect();
    format!(
        "
/// The operating point of a tick, for `tick_at` of a monitor with `drift_core::FullAt`, from
{lines}pub const fn operating_point({}) -> f32 {{
    {}
}}
",
        arguments.join(", "),
        terms.join(" + ")
    )
}

fn kind(kind: ChannelKind) -> String {
    let row = ChannelKind::ROWS.iter().find(|row| row.kind.name() == kind.name());
    let variant = row.map_or("", |row| row.variant);
    let index = kind.index().map(|index| format!("(drift_core::Index::{index:?})"));
    format!("drift_core::ChannelKind::{variant}{}", index.unwrap_or_default())
}

fn option<T>(of: Option<&T>, write: impl FnOnce(&T) -> String) -> String {
    of.map_or("None".to_owned(), |x| format!("Some({})", write(x)))
}
