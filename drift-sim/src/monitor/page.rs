//! A run as a report for people: its answer, what it is about, its sections ([`Drawing`]), and what it was judged by.

use drift_core::Channel;

use super::chart::{Chart, file_name};
use super::drawing::Drawing;
use super::screen;
use super::summary::Summary;
use crate::baseline_file::BaselineFile;
use crate::recording::ColumnMap;
use crate::report::{Block, Page, Section};
use crate::sentences::{self, line, plain};

/// The page of a run; `columns` are the recording's names of its signals, `command` is the command line.
pub fn page(
    summary: &Summary,
    chart: &Chart,
    baseline: &BaselineFile,
    columns: &ColumnMap,
    command: String,
) -> Page {
    let clock = summary.clock();
    let drawing = Drawing { summary, chart, columns, clock };
    let name = file_name(summary);
    Page {
        title: format!("Monitoring of {name}"),
        about: format!(
            "{name}, {} s watched; healthy: {}",
            plain(summary.duration_s(), 4),
            healthy_files(baseline)
        ),
        answer: sentences::monitoring(summary, &clock),
        proof: drawing.proof(),
        command,
        facts: facts(summary, baseline),
        sections: vec![
            drawing.found(),
            drawing.signals(),
            drawing.residuals(),
            drawing.planes(),
            thresholds(baseline),
        ],
    }
}

/// The recordings that the baseline was learnt from, by their file's names.
fn healthy_files(baseline: &BaselineFile) -> String {
    let name = |path: &String| {
        std::path::Path::new(path)
            .file_name()
            .map_or(path.clone(), |name| name.to_string_lossy().into_owned())
    };
    let names: Vec<String> = baseline.calibration.files.iter().take(2).map(name).collect();
    match baseline.calibration.files.len().saturating_sub(2) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}

fn facts(summary: &Summary, baseline: &BaselineFile) -> Vec<(String, String)> {
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let mut facts = vec![
        fact("Recording", summary.recording.clone()),
        fact(
            "Length",
            format!(
                "{} s, one sample every {} s",
                plain(summary.duration_s(), 6),
                plain(summary.sample_time_s, 4)
            ),
        ),
        fact("Reading", summary.quality.to_string()),
        fact(
            "Windows",
            format!(
                "{} s, a decision every {} s: {} decisions, {} with enough valid samples",
                plain(summary.window_s, 4),
                plain(summary.hop_s, 4),
                summary.hops,
                summary.valid_hops
            ),
        ),
    ];
    if let Some(left_out) = screen::excluded(summary) {
        facts.push(fact("Left out", left_out));
    }
    facts.push(fact("Baseline from", baseline.calibration.files.join(", ")));
    facts
}

/// What the run was judged by.
fn thresholds(baseline: &BaselineFile) -> Section {
    let learned = baseline.channels.iter().map(|entry| &entry.channel).filter(|c| c.baseline.sigma > 0.0);
    let rows = learned.map(threshold_row).collect();
    let head = [
        "channel",
        "healthy line",
        "scatter (sigma)",
        "independent windows",
        "x seen",
        "alarm of one window outside",
        "CUSUM: allowance k, threshold h",
        "EWMA: weight, limit",
        "SPRT",
    ];
    let mut blocks = vec![Block::table(head, rows)];
    if let Some(promise) = &baseline.promise {
        blocks.push(Block::Text(format!(
            "The thresholds are made for one false alarm in {} h on average ({} decisions) of all channels and detectors \
             together; {} of 100 calibrations like this one are aimed to keep that.",
            plain(promise.false_alarm_every_h, 4),
            plain(promise.decisions, 4),
            plain(100.0 * promise.confidence, 3)
        )));
    }
    Section::new("Baseline and thresholds", blocks)
}

/// A channel's line and what watches it, as in the head above.
fn threshold_row(channel: &Channel) -> Vec<String> {
    let (b, d) = (&channel.baseline, &channel.detectors);
    let none = || "\u{2013}".to_owned();
    let mut row = vec![screen::label(channel.kind)];
    let between = |low: f32, high: f32| format!("{} to {}", plain(low.into(), 3), plain(high.into(), 3));
    row.push(line(b.b0.into(), b.b1.into()));
    row.extend([b.sigma, b.windows].map(|x| plain(x.into(), 3)));
    row.push(between(b.x_min, b.x_max));
    row.push(d.shewhart.map_or_else(none, |s| between(s.lower, s.upper)));
    row.push(
        d.cusum.map_or_else(none, |c| format!("k {}, h {}", plain(c.k.into(), 3), plain(c.h.into(), 3))),
    );
    row.push(
        d.ewma.map_or_else(none, |e| format!("{}, {}", plain(e.lambda.into(), 3), plain(e.limit.into(), 3))),
    );
    row.push(d.sprt.map_or_else(none, |s| between(s.lower, s.upper)));
    row
}
