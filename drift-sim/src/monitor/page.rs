//! A run as a report for people: what was found, the signals with their windows and decisions, each channel's residual and
//! detectors, and the channels' planes with the line as it moved.

use drift_core::Channel;

use super::chart::{ChannelChart, Chart, Said, events, file_name, scaled, shade, shewhart_limits, time_unit};
use super::events::{Course, Event, EventKind};
use super::screen;
use super::summary::{ChannelSummary, Summary};
use crate::baseline_file::BaselineFile;
use crate::plot::{Colour, Figure, Layer, Marker, Panel};
use crate::recording::ColumnMap;
use crate::report::{self, Block, Cloud, Moved, Page, Section, number};

/// Events listed.
const LISTED: usize = 200;
/// Windows that are drawn one by one.
const WINDOWS: f64 = 4000.0;
/// The axis that all charts over time share.
const TIME: &str = "time";

/// The page of a run; `columns` are the recording's names of its signals, `command` is the command line.
pub fn page(
    summary: &Summary,
    chart: &Chart,
    baseline: &BaselineFile,
    columns: &ColumnMap,
    command: String,
) -> Page {
    let (unit, per_unit) = time_unit(summary.duration_s());
    let drawing = Drawing { summary, chart, columns, unit, per_unit };
    Page {
        title: format!("Monitoring of {}", file_name(summary)),
        verdict: [Some(screen::verdict(summary)), screen::pinned(summary)]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
            .join(" "),
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

fn facts(summary: &Summary, baseline: &BaselineFile) -> Vec<(String, String)> {
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let mut facts = vec![
        fact("Recording", summary.recording.clone()),
        fact("Length", format!("{} s at {} s", number(summary.duration_s()), number(summary.sample_time_s))),
        fact("Reading", summary.quality.to_string()),
        fact(
            "Windows",
            format!(
                "{} s, a decision every {} s: {} decisions, {} with enough valid samples",
                number(summary.window_s),
                number(summary.hop_s),
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

/// One run and its unit of time.
struct Drawing<'a> {
    summary: &'a Summary,
    chart: &'a Chart,
    columns: &'a ColumnMap,
    unit: &'static str,
    per_unit: f64,
}

impl Drawing<'_> {
    fn found(&self) -> Section {
        let channels = self.summary.channels.iter().map(channel_row).collect();
        let head =
            ["channel", "decisions", "mean z", "largest |z|", "alarms", "outside calibrated x", "verdict"];
        let mut blocks = vec![Block::table(head, channels)];
        let events = &self.summary.events;
        if events.is_empty() {
            blocks.push(Block::Text("No channel left its baseline.".into()));
        } else {
            let unit = self.unit;
            let rows = events.iter().take(LISTED).flat_map(|e| self.event_rows(e)).collect();
            let head = [
                "event".into(),
                format!("from / {unit}"),
                format!("alarm / {unit}"),
                format!("to / {unit}"),
                "channel".into(),
                "side".into(),
                "farthest, sigmas".into(),
                "raised by".into(),
                "line before".into(),
                "line since".into(),
            ];
            blocks.push(Block::table(head, rows));
            let more = events.len().saturating_sub(LISTED) as u64 + self.summary.more_events;
            if more > 0 {
                blocks.push(Block::Note(format!("{more} more events are not listed; --json has them all.")));
            }
            blocks.push(Block::Note(
                "A disturbance came back to the baseline, a drift stays; suspect is what the recording's end left open. The \
                 beginning is estimated from where the sum that alarmed last stood at zero."
                    .into(),
            ));
        }
        Section::new("What was found", blocks)
    }

    fn time(&self, t_s: f64) -> String {
        number(t_s / self.per_unit)
    }

    fn event_rows(&self, event: &Event) -> Vec<Vec<String>> {
        let row = |(i, course): (usize, &Course)| {
            let line = |b0: f32, b1: f32| format!("{} + {} x", number(b0.into()), number(b1.into()));
            vec![
                if i == 0 { event.kind().name().into() } else { String::new() },
                self.time(course.from_s),
                self.time(course.alarm_s),
                course.to_s.map_or_else(|| "open".into(), |t| self.time(t)),
                screen::label(course.kind),
                screen::side_name(course.side).into(),
                format!("{:.1}", course.max_z),
                screen::detectors(course),
                line(course.baseline.b0, course.baseline.b1),
                course.fault_curve.map_or_else(String::new, |c| {
                    format!("{} ({})", line(c.b0, c.b1), format!("{:?}", c.moved).to_lowercase())
                }),
            ]
        };
        event.courses.iter().enumerate().map(row).collect()
    }

    fn signals(&self) -> Section {
        let [r, y, u] = self.columns.labels();
        let line = |name: &str, colour, of| Layer::line(name, colour, scaled(of, self.per_unit));
        let with_events = |mut layers: Vec<Layer>| {
            layers.extend(self.shades());
            layers
        };
        let chart = self.chart;
        let panels = vec![
            panel(
                "r, y",
                with_events(vec![
                    line(&y, Colour::Blue, &chart.y),
                    Layer::dashed(r, Colour::Black, scaled(&chart.r, self.per_unit)),
                ]),
            ),
            panel("e = r \u{2212} y", with_events(vec![line("e", Colour::Purple, &chart.e)])),
            panel("u", with_events(vec![line(&u, Colour::Green, &chart.u)])),
            self.decisions(),
        ];
        let mut caption = format!(
            "Signals in the recording's own units; shades are events. Below: the windows of {} s, and for each channel low: \
             healthy, middle: suspect, high: drift, gap: not judged; crosses are alarms.",
            number(self.summary.window_s)
        );
        if chart.y.length() > 2 {
            caption +=
                &format!(" Of each {} samples the least and the greatest are drawn.", chart.y.length());
        }
        Section::new("Signals, windows and decisions", vec![self.over_time(panels, caption)])
    }

    /// The events, named so that the legend explains the shades.
    fn shades(&self) -> Vec<Layer> {
        let mut named = Vec::new();
        events(self.summary, self.per_unit)
            .zip(&self.summary.events)
            .map(|(mut layer, event)| {
                if let Layer::Span { name, .. } = &mut layer
                    && !named.contains(&event.kind())
                {
                    named.push(event.kind());
                    *name = event.kind().name().into();
                }
                layer
            })
            .collect()
    }

    fn over_time(&self, mut panels: Vec<Panel>, caption: String) -> Block {
        if let Some(last) = panels.last_mut() {
            last.x_label = format!("t / {}", self.unit);
        }
        let figure = Figure::stacked("", panels);
        Block::Chart(report::Chart { figure, caption, axis: Some(TIME.into()) })
    }

    /// Windows as bars that alternate, and a step line for each channel.
    fn decisions(&self) -> Panel {
        let (mut layers, mut y_names) = (self.windows(), Vec::new());
        if !layers.is_empty() {
            y_names.push((-0.75, "windows".to_owned()));
        }
        for (i, channel) in self.chart.channels.iter().filter(|c| c.learned()).enumerate() {
            let foot = i as f64;
            let level = |said: Said| match said {
                Said::NotJudged => f64::NAN,
                Said::Healthy => foot,
                Said::Suspect => foot + 0.35,
                Said::Drift => foot + 0.7,
            };
            let line = self.steps(channel, level);
            let at = |t_s: f64| (t_s / self.per_unit, level(said_at(channel, t_s)));
            let alarms = channel.alarms.iter().map(|(t_s, _)| at(*t_s)).collect();
            layers.push(Layer::line("", Colour::Blue, line));
            layers.push(Layer::points(
                if i == 0 { "alarm" } else { "" },
                Colour::Vermilion,
                Marker::Cross,
                alarms,
            ));
            y_names.push((foot, channel.channel.kind.name().replace('_', " ")));
        }
        let top = y_names.len() as f64 - 0.2;
        Panel { layers, y_names, y_range: Some((-1.2, top.max(0.8))), ..panel("", Vec::new()) }
    }

    /// Two rows of bars, one window after the other; more rows where windows overlap. None where they are too many to see.
    fn windows(&self) -> Vec<Layer> {
        let (Some((from_s, to_s)), hop_s) = (self.chart.first, self.summary.hop_s) else { return Vec::new() };
        let count = libm::round((self.chart.last_s - to_s) / hop_s) + 1.0;
        if count.is_nan() || count > WINDOWS {
            return Vec::new();
        }
        let rows = (libm::ceil((to_s - from_s) / hop_s - 1e-9) as usize + 1).clamp(2, 8);
        let mut bars = vec![Vec::new(); rows];
        for i in 0..count as usize {
            let (begin, end) = (from_s + i as f64 * hop_s, to_s + i as f64 * hop_s);
            let row = i % rows;
            let y = -0.5 - 0.5 * row as f64 / (rows - 1) as f64;
            if let Some(bar) = bars.get_mut(row) {
                let gap = (end + 1e-6 * hop_s) / self.per_unit;
                bar.extend([(begin / self.per_unit, y), (end / self.per_unit, y), (gap, f64::NAN)]);
            }
        }
        bars.into_iter().map(|bar| Layer::line("", Colour::Grey, bar)).collect()
    }

    /// What a channel said, as steps.
    fn steps(&self, channel: &ChannelChart, level: impl Fn(Said) -> f64) -> Vec<(f64, f64)> {
        let mut line = Vec::new();
        let just_before = 1e-6 * self.summary.hop_s;
        let ends = channel.verdicts.iter().skip(1).map(|v| v.0).chain([self.chart.last_s]);
        for ((from_s, said), to_s) in channel.verdicts.iter().zip(ends) {
            let level = level(*said);
            line.extend([(from_s / self.per_unit, level), ((to_s - just_before) / self.per_unit, level)]);
        }
        line
    }

    fn residuals(&self) -> Section {
        let mut panels = Vec::new();
        for channel in self.chart.channels.iter().filter(|c| c.learned()) {
            let kind = channel.channel.kind;
            let name = kind.name().replace('_', " ");
            let courses = self.summary.events.iter().flat_map(|e| &e.courses).filter(|c| c.kind == kind);
            let end_s = self.summary.start_s + self.summary.duration_s();
            let shades: Vec<Layer> = courses
                .map(|c| {
                    let to_s = c.to_s.unwrap_or(end_s);
                    shade(c.outcome, c.from_s / self.per_unit, to_s / self.per_unit, String::new())
                })
                .collect();
            let mut add = |title: String, y_label: &str, mut layers: Vec<Layer>| {
                layers.extend(shades.iter().cloned());
                panels.push(Panel { title, ..panel(y_label, layers) });
            };
            add(name.clone(), "z, sigmas", self.residual(channel));
            if channel.channel.detectors.cusum.is_some() {
                add(format!("{name}: CUSUM"), "CUSUM, sigmas", self.cusum(channel));
            }
            if channel.channel.detectors.sprt.is_some() {
                add(format!("{name}: SPRT"), "log-likelihood", self.sprt(channel));
            }
        }
        let caption = "Each decision's standardised residual, and what its detectors make of it. The CUSUM's lower sum is drawn \
                       downwards; after an alarm a sum starts anew.";
        if panels.is_empty() {
            return Section::new(
                "Residuals and detectors",
                vec![Block::Text("No channel has a baseline: nothing is judged.".into())],
            );
        }
        Section::new("Residuals and detectors", vec![self.over_time(panels, caption.into())])
    }

    fn residual(&self, channel: &ChannelChart) -> Vec<Layer> {
        let alarms = channel.alarms.iter().map(|(t_s, z)| (t_s / self.per_unit, *z)).collect();
        let mut layers = vec![Layer::line("residual", Colour::Purple, scaled(&channel.z, self.per_unit))];
        layers.extend(shewhart_limits(&channel.channel));
        layers.push(Layer::points("alarm", Colour::Vermilion, Marker::Cross, alarms));
        layers
    }

    fn cusum(&self, channel: &ChannelChart) -> Vec<Layer> {
        let [high, low] = channel.cusum.each_ref().map(|t| scaled(t, self.per_unit));
        let low = low.into_iter().map(|(t, x)| (t, -x)).collect();
        let h = channel.channel.detectors.cusum.map_or(f64::NAN, |c| f64::from(c.h));
        two_sides(high, low, [h, -h], "threshold")
    }

    fn sprt(&self, channel: &ChannelChart) -> Vec<Layer> {
        let [high, low] = channel.sprt.each_ref().map(|t| scaled(t, self.per_unit));
        let limits = channel
            .channel
            .detectors
            .sprt
            .map_or([f64::NAN; 2], |s| [f64::from(s.upper), f64::from(s.lower)]);
        two_sides(high, low, limits, "alarm above, restart below")
    }

    fn planes(&self) -> Section {
        let charts: Vec<&ChannelChart> =
            self.chart.channels.iter().filter(|c| c.learned() || !c.plane.is_empty()).collect();
        let panels: Vec<Panel> = charts.iter().map(|c| self.plane(c)).collect();
        let mut caption = "One point a window. The healthy line with the band where it lies itself (95 % confidence) and the one \
                           where 95 % of healthy windows lie; dashed: the line refitted on the windows since an alarm."
            .to_owned();
        if let Some(every) = charts.iter().map(|c| c.every).max().filter(|every| *every > 1) {
            caption += &format!(" One window in {every} is drawn.");
        }
        let figure = Figure { panel_height_px: 330, ..Figure::grid("", 2, panels) };
        Section::new("The lines", vec![Block::Chart(report::Chart { figure, caption, axis: None })])
    }

    fn plane(&self, chart: &ChannelChart) -> Panel {
        let of = |wanted: &[Said]| -> Vec<(f64, f64)> {
            chart.plane.iter().filter(|p| wanted.contains(&p.2)).map(|p| (p.0, p.1)).collect()
        };
        let cloud = |name: &str, colour, marker, points| Cloud { name: name.into(), colour, marker, points };
        let clouds = vec![
            cloud("healthy", Colour::Grey, Marker::Dot, of(&[Said::Healthy, Said::NotJudged])),
            cloud("suspect", Colour::Orange, Marker::Dot, of(&[Said::Suspect])),
            cloud("drift", Colour::Vermilion, Marker::Cross, of(&[Said::Drift])),
        ];
        let courses = self.summary.events.iter().flat_map(|e| &e.courses);
        let moved = courses.filter(|c| c.kind == chart.channel.kind).filter_map(|c| {
            let name = format!("since {} {}", self.time(c.from_s), self.unit);
            Some(Moved { name, curve: c.fault_curve? })
        });
        // The last ones: where the loop is now.
        let all: Vec<Moved> = moved.collect();
        report::plane(&chart.channel, clouds, all.get(all.len().saturating_sub(2)..).unwrap_or(&[]))
    }
}

fn two_sides(high: Vec<(f64, f64)>, low: Vec<(f64, f64)>, limits: [f64; 2], name: &str) -> Vec<Layer> {
    let mut layers =
        vec![Layer::line("upwards", Colour::Blue, high), Layer::dashed("downwards", Colour::Green, low)];
    for (i, y) in limits.into_iter().filter(|y| y.is_finite()).enumerate() {
        let name = if i == 0 { name.to_owned() } else { String::new() };
        layers.push(Layer::HorizontalLine { y, name, colour: Colour::Vermilion, dashed: true });
    }
    layers
}

fn said_at(channel: &ChannelChart, t_s: f64) -> Said {
    channel.verdicts.iter().take_while(|v| v.0 < t_s).last().map_or(Said::NotJudged, |v| v.1)
}

fn panel(y_label: &str, layers: Vec<Layer>) -> Panel {
    Panel { y_label: y_label.into(), layers, ..Panel::default() }
}

fn channel_row(channel: &ChannelSummary) -> Vec<String> {
    let verdict = match (channel.learned, channel.worst) {
        (false, _) => "no baseline",
        (true, _) if channel.judged == 0 => "not judged",
        (true, None) => "healthy",
        (true, Some(kind)) => EventKind::name(kind),
    };
    vec![
        screen::label(channel.kind),
        channel.judged.to_string(),
        number(channel.mean_z),
        number(channel.max_abs_z),
        channel.alarms.to_string(),
        channel.extrapolated.to_string(),
        verdict.into(),
    ]
}

/// What the run was judged by.
fn thresholds(baseline: &BaselineFile) -> Section {
    let learned = baseline.channels.iter().map(|entry| &entry.channel).filter(|c| c.baseline.sigma > 0.0);
    let rows = learned.map(threshold_row).collect();
    let head = ["channel", "b0", "b1", "sigma", "windows' worth", "x seen", "Shewhart", "CUSUM", "SPRT"];
    let mut blocks = vec![Block::table(head, rows)];
    if let Some(promise) = &baseline.promise {
        blocks.push(Block::Text(format!(
            "The thresholds are made for one false alarm in {} h on average ({} decisions) of all channels and detectors \
             together; {} of 100 calibrations like this one are aimed to keep that.",
            number(promise.false_alarm_every_h),
            number(promise.decisions),
            number(100.0 * promise.confidence)
        )));
    }
    Section::new("Baseline and thresholds", blocks)
}

/// A channel's line and what watches it, as in the head above.
fn threshold_row(channel: &Channel) -> Vec<String> {
    let (b, d) = (&channel.baseline, &channel.detectors);
    let none = || "\u{2013}".to_owned();
    let mut row = vec![screen::label(channel.kind)];
    row.extend([b.b0, b.b1, b.sigma, b.windows].map(|x| number(x.into())));
    row.push(report::interval([b.x_min.into(), b.x_max.into()]));
    row.push(d.shewhart.map_or_else(none, |s| report::interval([s.lower.into(), s.upper.into()])));
    row.push(d.cusum.map_or_else(none, |c| format!("k {} h {}", number(c.k.into()), number(c.h.into()))));
    row.push(d.sprt.map_or_else(none, |s| report::interval([s.lower.into(), s.upper.into()])));
    row
}
