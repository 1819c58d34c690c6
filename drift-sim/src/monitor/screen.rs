//! A run on one screen, in words.

use std::fmt::Write;

use drift_core::{ChannelKind, Side};

use super::detectable::{Detectable, PROBABILITY};
use super::events::{Course, Event, EventKind, Raised};
use super::summary::{ChannelSummary, Summary};
use crate::baseline_file::Promise;
use crate::calibrate::detector::ROWS;

/// Events that fit on the screen.
const SHOWN: usize = 12;

/// The summary as lines of plain text, without colour; with what the thresholds promise, where that is known.
pub fn screen(summary: &Summary, promise: Option<&Promise>) -> String {
    let mut text = String::new();
    // Writing to a String can't fail.
    let _ = write_screen(&mut text, summary, promise);
    text
}

fn write_screen(out: &mut String, summary: &Summary, promise: Option<&Promise>) -> std::fmt::Result {
    writeln!(
        out,
        "{}: {} at {} s, from {} s; window {} s, {} decisions",
        printable(&summary.recording),
        seconds(summary.duration_s()),
        summary.sample_time_s,
        short(summary.start_s),
        short(summary.window_s),
        summary.hops
    )?;
    writeln!(out, "{}", summary.quality)?;
    write_excluded(out, summary)?;
    if let Some(promise) = promise {
        writeln!(
            out,
            "thresholds: one false alarm in {} h on average, kept by {} % of calibrations like this one; {} h were watched",
            short(promise.false_alarm_every_h),
            short(100.0 * promise.confidence),
            short(summary.duration_s() / 3600.0)
        )?;
    }
    writeln!(out, "\n{}\n", verdict(summary))?;
    if let Some(text) = pinned(summary) {
        writeln!(out, "{text}\n")?;
    }
    write_channels(out, &summary.channels)?;
    write_events(out, summary)
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

fn write_excluded(out: &mut String, summary: &Summary) -> std::fmt::Result {
    if let Some(reasons) = excluded(summary) {
        writeln!(out, "left out: {reasons}")?;
    }
    let unjudged = summary.hops - summary.valid_hops;
    if unjudged > 0 {
        writeln!(out, "{unjudged} decisions without enough valid samples")?;
    }
    Ok(())
}

/// The whole run in a sentence or two.
pub(super) fn verdict(summary: &Summary) -> String {
    let open = summary.events.iter().find(|e| e.to_s().is_none());
    let mut drifts = summary.events.iter().rev().filter(|e| e.kind() == EventKind::Drift);
    let passed = summary.events.len() as u64 + summary.more_events;
    match (summary.worst, open) {
        (None, _) if summary.channels.iter().all(|c| !c.learned) => {
            "NOT JUDGED: no channel has a baseline.".into()
        }
        (None, _) if summary.channels.iter().all(|c| c.judged == 0) => {
            "NOT JUDGED: no window had enough valid samples.".into()
        }
        (None, _) => format!("HEALTHY: every channel with a baseline stays on it.{}", unseen(summary)),
        (Some(EventKind::Drift), Some(event)) if event.kind() == EventKind::Drift => {
            format!("DRIFT since about {} s, {}. {}", short(event.from_s()), sides(event), meaning(event))
        }
        (Some(EventKind::Drift), _) => match drifts.next() {
            Some(event) => format!(
                "DRIFT that ended: from about {} s to {} s, {}. {}",
                short(event.from_s()),
                event.to_s().map_or_else(|| "the end".into(), short),
                sides(event),
                meaning(event)
            ),
            None => "DRIFT among the events that are not listed.".into(),
        },
        (Some(EventKind::Suspect), Some(event)) => format!(
            "SUSPECT since about {} s, {}: the recording ends before a disturbance can be told from a drift. {}",
            short(event.from_s()),
            sides(event),
            meaning(event)
        ),
        (Some(_), _) => format!(
            "DISTURBED: {passed} {} that came back to the baseline; no drift.",
            if passed == 1 { "deviation" } else { "deviations" }
        ),
    }
}

/// A controller that has nothing left to give.
pub(super) fn pinned(summary: &Summary) -> Option<String> {
    summary.pinned.map(|p| {
        format!(
            "PINNED: u stands at its limit of {} from {} s to {} s, and e does not vanish: {} on average.",
            short(p.limit),
            short(p.from_s),
            short(p.to_s),
            short(p.mean_e)
        )
    })
}

/// What the run could not have shown.
fn unseen(summary: &Summary) -> String {
    let effort = summary.channels.iter().find(|c| c.kind == ChannelKind::Effort && c.learned);
    let Some(effort) = effort.filter(|c| c.judged > 0) else { return String::new() };
    let (judged, percent) = (effort.judged, 100.0 * PROBABILITY);
    match effort.detectable {
        None => format!(" With {judged} windows no lasting shift of u would have shown."),
        Some(Detectable { value, y, .. }) => {
            let of_y = y.map_or_else(String::new, |y| format!(", or of y of less than {},", short(y)));
            format!(
                " A lasting shift of u of less than {}{of_y} would not have shown with {percent} % in these {judged} windows.",
                short(value),
            )
        }
    }
}

/// The courses that make the event what it is: of a drift, those that were called drift.
fn leading(event: &Event) -> impl Iterator<Item = &Course> {
    let kind = event.kind();
    event.courses.iter().filter(move |c| c.outcome == kind)
}

/// What the event means.
fn meaning(event: &Event) -> &'static str {
    let mut leading = leading(event);
    let Some(first) = leading.next() else { return "" };
    if leading.any(|c| c.kind != first.kind) {
        return "Several channels are away: the operating point and the dynamics of the loop changed together.";
    }
    match (first.kind, first.side) {
        (ChannelKind::Effort, Side::High) => {
            "It takes more effort to hold y than it did: a load, a leak, lost gain, or a sensor that reads low."
        }
        (ChannelKind::Effort, Side::Low) => {
            "It takes less effort to hold y than it did: a load is gone, the gain grew, or a sensor reads high."
        }
        (ChannelKind::MotionEffort, Side::High) => {
            "It takes more effort to move than it did: friction, a load against the motion, or lost drive gain."
        }
        (ChannelKind::MotionEffort, Side::Low) => {
            "It takes less effort to move than it did: less friction, a load along the motion, or more drive gain."
        }
        (ChannelKind::Activity, _) => {
            "The controller works differently for the same reference: changed dynamics, gain or noise."
        }
        (ChannelKind::EnergyError(_), Side::High) => {
            "The loop tracks worse for the energy that it spends: slower dynamics, a disturbance, or noise."
        }
        (ChannelKind::EnergyError(_), Side::Low) => {
            "The loop tracks better for the energy that it spends, or spends energy that the error does not ask for."
        }
    }
}

fn sides(event: &Event) -> String {
    let mut parts: Vec<String> = Vec::new();
    for course in leading(event) {
        let part = format!("{} {}", label(course.kind), side_name(course.side));
        if !parts.contains(&part) {
            parts.push(part);
        }
    }
    parts.join(", ")
}

fn write_channels(out: &mut String, channels: &[ChannelSummary; 3]) -> std::fmt::Result {
    writeln!(
        out,
        "{:<20} {:>7} {:>8} {:>8} {:>7}  verdict",
        "channel", "judged", "mean z", "max |z|", "alarms"
    )?;
    for channel in channels {
        let verdict = match (channel.learned, channel.worst) {
            (false, _) => "no baseline",
            (true, _) if channel.judged == 0 => "not judged",
            (true, None) => "healthy",
            (true, Some(kind)) => kind.name(),
        };
        write!(
            out,
            "{:<20} {:>7} {:>8} {:>8} {:>7}  {verdict}",
            label(channel.kind),
            channel.judged,
            fixed(channel.mean_z),
            fixed(channel.max_abs_z),
            channel.alarms
        )?;
        if channel.extrapolated > 0 {
            write!(out, " ({} of {} outside the calibrated range)", channel.extrapolated, channel.judged)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn write_events(out: &mut String, summary: &Summary) -> std::fmt::Result {
    if summary.events.is_empty() {
        return Ok(());
    }
    writeln!(out, "\nevents")?;
    for event in summary.events.iter().take(SHOWN) {
        let span = match event.to_s() {
            Some(to_s) => format!("{} .. {} s", short(event.from_s()), short(to_s)),
            None => format!("{} s .. open", short(event.from_s())),
        };
        let courses: Vec<String> = farthest(event)
            .into_iter()
            .map(|(c, times)| if times > 1 { format!("{} ({times} times)", course(c)) } else { course(c) })
            .collect();
        writeln!(out, "  {:<12} {span:<22} {}", event.kind().name(), courses.join(", "))?;
    }
    let more = summary.events.len().saturating_sub(SHOWN) as u64 + summary.more_events;
    if more > 0 {
        writeln!(out, "  and {more} more")?;
    }
    Ok(())
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
    let names = course.detectors.iter().filter_map(spoken);
    names.collect::<Vec<_>>().join("+")
}

fn course(course: &Course) -> String {
    let mut text = format!(
        "{} {} {:.1} sigma, {} at {} s",
        label(course.kind),
        side_name(course.side),
        course.max_z,
        detectors(course),
        short(course.alarm_s)
    );
    if let Some(curve) = &course.fault_curve {
        let _ = write!(
            text,
            "; b0 {} -> {}, b1 {} -> {}",
            sig(course.baseline.b0),
            sig(curve.b0),
            sig(course.baseline.b1),
            sig(curve.b1)
        );
    }
    text
}

pub(super) fn label(kind: ChannelKind) -> String {
    match kind {
        ChannelKind::EnergyError(index) => format!("{} ({index:?})", kind.name()).to_lowercase(),
        _ => kind.name().to_owned(),
    }
}

pub(super) const fn side_name(side: Side) -> &'static str {
    match side {
        Side::High => "high",
        Side::Low => "low",
    }
}

fn fixed(x: f64) -> String {
    if x.is_nan() { "-".into() } else { format!("{x:.2}") }
}

fn sig(x: f32) -> String {
    format!("{x:.3e}").parse::<f64>().map_or_else(|_| x.to_string(), |v| v.to_string())
}

/// At most a millisecond's digits, no trailing zeros.
fn short(x: f64) -> String {
    let text = format!("{x:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn seconds(s: f64) -> String {
    if s >= 7200.0 { format!("{} s ({:.1} h)", short(s), s / 3600.0) } else { format!("{} s", short(s)) }
}

/// A file's name must not reach the terminal with control codes in it.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
