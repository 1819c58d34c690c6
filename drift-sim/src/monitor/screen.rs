//! A run on one screen, in words.

use std::fmt::Write;

use drift_core::ChannelKind;

use super::events::{Course, Event, Raised};
use super::summary::{ChannelSummary, Summary};
use crate::baseline_file::Promise;
use crate::calibrate::detector::ROWS;
use crate::sentences::{Clock, line, monitoring, plain, side_name, sigmas};
use crate::terminal::Terminal;

/// Events that fit on the screen.
const SHOWN: usize = 12;

/// The summary as text for a terminal: the answer, then the channels and events, then how it was read; with what the thresholds
/// promise, where that is known.
pub fn screen(summary: &Summary, promise: Option<&Promise>, terminal: &Terminal) -> String {
    let clock = summary.clock();
    let mut text = terminal.answer(&monitoring(summary, &clock));
    write_channels(&mut text, &summary.channels, terminal);
    write_events(&mut text, summary, &clock, terminal);
    write_reading(&mut text, summary, promise, terminal);
    text
}

fn write_reading(out: &mut String, summary: &Summary, promise: Option<&Promise>, terminal: &Terminal) {
    let mut item = |name: &str, text: &str| *out += &terminal.wrapped(&format!("{name:<11}"), text);
    let clock = summary.clock();
    item(
        "recording",
        &format!(
            "{}: {} s from {}, one sample every {} s; windows of {} s, {} decisions",
            printable(&summary.recording),
            plain(summary.duration_s(), 6),
            clock.says(summary.start_s),
            plain(summary.sample_time_s, 4),
            plain(summary.window_s, 4),
            summary.hops
        ),
    );
    let reading = summary.quality.to_string();
    // As many samples as rows are no news.
    if reading.contains([',', ';']) || summary.quality.rows != summary.quality.samples {
        item("reading", &reading);
    }
    if let Some(reasons) = excluded(summary) {
        item("left out", &reasons);
    }
    let unjudged = summary.hops - summary.valid_hops;
    if unjudged > 0 {
        item("", &format!("{unjudged} decisions without enough valid samples"));
    }
    if let Some(promise) = promise {
        item(
            "thresholds",
            &format!(
                "one false alarm in {} h on average, {} % sure; {} h watched",
                plain(promise.false_alarm_every_h, 4),
                plain(100.0 * promise.confidence, 3),
                plain(summary.duration_s() / 3600.0, 3)
            ),
        );
    }
}

/// Samples that entered no sum, by reason; `None` where there are none.
pub(super) fn excluded(summary: &Summary) -> Option<String> {
    let e = &summary.excluded;
    let reasons: Vec<String> = [
        (e.missing, "missing"),
        (e.non_finite, "not finite"),
        (e.out_of_range, "out of range"),
        (e.saturated, "saturated"),
        (e.manual, "in manual"),
        (e.blanked, "blanked after steps of the reference"),
    ]
    .iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, why)| format!("{n} {why}"))
    .collect();
    (!reasons.is_empty()).then(|| reasons.join(", "))
}

fn write_channels(out: &mut String, channels: &[ChannelSummary; 3], terminal: &Terminal) {
    *out += &format!("\n{:<19} {:>7} {:>14} {:>6}  verdict\n", "channel", "windows", "farthest", "alarms");
    for channel in channels {
        let mut verdict = match (channel.learned, channel.worst) {
            (false, _) => "no baseline",
            (true, _) if channel.judged == 0 => "not judged",
            (true, None) => "healthy",
            (true, Some(kind)) => kind.name(),
        }
        .to_owned();
        if channel.extrapolated > 0 {
            verdict += &format!(", {} not calibrated", channel.extrapolated);
        }
        let before = format!(
            "{:<19} {:>7} {:>14} {:>6}  ",
            label(channel.kind),
            channel.judged,
            farthest_z(channel.max_abs_z),
            channel.alarms
        );
        *out += &terminal.wrapped(&before, &verdict);
    }
}

fn write_events(out: &mut String, summary: &Summary, clock: &Clock, terminal: &Terminal) {
    out.push('\n');
    for event in summary.events.iter().take(SHOWN) {
        let span = match event.to_s() {
            Some(to_s) => clock.span(event.from_s(), to_s),
            None => format!("since {}", clock.says(event.from_s())),
        };
        let courses: Vec<String> =
            farthest(event)
                .into_iter()
                .map(|(c, times)| {
                    if times > 1 { format!("{} ({times} times)", course(c, clock)) } else { course(c, clock) }
                })
                .collect();
        let text = format!("{span}: {}", courses.join("; "));
        *out += &terminal.wrapped(&format!("{:<13}", event.kind().name()), &text);
    }
    let more = summary.events.len().saturating_sub(SHOWN) as u64 + summary.more_events;
    if more > 0 {
        *out += &format!("and {more} more\n");
    }
    if !summary.events.is_empty() {
        out.push('\n');
    }
}

/// Of each channel in the event the course that went farthest, and how many it had.
fn farthest(event: &Event) -> Vec<(&Course, usize)> {
    let mut found: Vec<(&Course, usize)> = Vec::new();
    for course in &event.courses {
        match found.iter_mut().find(|(c, _)| c.kind == course.kind) {
            Some((other, times)) => {
                *times += 1;
                if other.max_z < course.max_z {
                    *other = course;
                }
            }
            None => found.push((course, 1)),
        }
    }
    found
}

/// The detectors that raised a course.
pub(super) fn detectors(course: &Course) -> String {
    let spoken = |name: &Raised| ROWS.iter().find(|row| row.name() == *name).map(|row| row.spoken());
    let names: Vec<&str> = course.detectors.iter().filter_map(spoken).collect();
    match names.as_slice() {
        [most @ .., last] if !most.is_empty() => format!("{} and {last}", most.join(", ")),
        _ => names.concat(),
    }
}

fn course(course: &Course, clock: &Clock) -> String {
    let mut text = format!(
        "{} {}, {}, by {} at {}",
        label(course.kind),
        side_name(course.side),
        sigmas(course.max_z.into()),
        detectors(course),
        clock.says(course.alarm_s)
    );
    if let Some(curve) = &course.fault_curve {
        let (before, since) = (&course.baseline, curve);
        let line = |b0: f32, b1: f32| line(b0.into(), b1.into());
        let _ = write!(text, ", line {}, was {}", line(since.b0, since.b1), line(before.b0, before.b1));
    }
    text
}

pub(super) fn label(kind: ChannelKind) -> String {
    match kind.index() {
        Some(index) => format!("{} ({index:?})", kind.name()).to_lowercase(),
        None => kind.name().to_owned(),
    }
}

fn farthest_z(x: f64) -> String {
    match x {
        x if x.is_nan() => "-".into(),
        x if x >= 100.0 => "over 100 sigma".into(),
        x => sigmas(x),
    }
}

/// A file's name must not reach the terminal with control codes in it.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
