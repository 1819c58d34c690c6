//! The report as lines of text.

use board::Line;
use drift_core::{ChannelKind, Location, Moved, Report, Side, Verdict};

/// Commissioning is done.
pub fn learnt(windows: u32) {
    Line::new().text("learnt from ").number(windows).text(" windows").print();
}

/// The verdict is another than before.
pub fn changed(report: &Report<3>) {
    let mut line = Line::new();
    line.text("hop ").number(report.hop).text(": ").text(verdict(report.verdict));
    line.text(", ").text(location(report.location()));
    for channel in &report.channels {
        let side = match channel.side {
            None => continue,
            Some(Side::High) => " high",
            Some(Side::Low) => " low",
        };
        line.text(", ").text(kind(channel.kind)).text(side).text(" (z ").decimal(channel.z).text(")");
    }
    line.print();
}

/// The curves at the end.
pub fn last(report: &Report<3>) {
    for channel in &report.channels {
        let Some(curve) = &channel.fault_curve else { continue };
        let mut line = Line::new();
        line.text(kind(channel.kind)).text(": b0 ").decimal(curve.b0).text(", b1 ").decimal(curve.b1);
        line.text(", shift ").decimal(curve.shift).text(", moved: ").text(moved(curve.moved)).print();
    }
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Healthy => "healthy",
        Verdict::Disturbance => "disturbance",
        Verdict::Recovered => "recovered",
        Verdict::Suspect => "suspect",
        Verdict::Drift => "drift",
    }
}

fn location(location: Location) -> &'static str {
    match location {
        Location::Nowhere => "nowhere",
        Location::OperatingPoint => "operating point",
        Location::Friction => "friction",
        Location::Dynamics => "dynamics",
        Location::Tracking => "tracking",
        Location::Several => "several",
    }
}

fn kind(kind: ChannelKind) -> &'static str {
    kind.name()
}

fn moved(moved: Moved) -> &'static str {
    match moved {
        Moved::Undecided => "undecided",
        Moved::Intercept => "intercept",
        Moved::Slope => "slope",
        Moved::Both => "both",
    }
}
