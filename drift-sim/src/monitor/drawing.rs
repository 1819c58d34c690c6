//! The sections of a run's page that draw or list it: its proof, events, signals, residuals and planes.

use super::chart::{ChannelChart, Chart, Said, events, scaled, shade, shewhart_limits};
use super::events::{Course, Event, EventKind};
use super::screen;
use super::summary::{ChannelSummary, Summary};
use crate::plot::{Colour, Figure, Layer, Marker, Panel};
use crate::recording::ColumnMap;
use crate::report::{self, Block, Cloud, Moved, Proof, Section};
use crate::sentences::{self, Clock, line, plain};

/// Events listed.
const LISTED: usize = 200;
/// The axis that all charts over time share.
const TIME: &str = "time";

/// One run and its unit of time.
pub(super) struct Drawing<'a> {
    pub summary: &'a Summary,
    pub chart: &'a Chart,
    pub columns: &'a ColumnMap,
    pub clock: Clock,
}

impl Drawing<'_> {
    /// The residual that moved, or the one that is nearest to it, with its limits; what was away is shaded.
    pub fn proof(&self) -> Option<Proof> {
        let moved =
            self.summary.events.iter().max_by_key(|e| (e.kind(), e.to_s().is_none())).and_then(Event::main);
        let farthest = || {
            let judged = self.summary.channels.iter().filter(|c| c.learned && c.max_abs_z.is_finite());
            judged.max_by(|a, b| a.max_abs_z.total_cmp(&b.max_abs_z)).map(|c| c.kind)
        };
        let kind = moved.map(|course| course.kind).or_else(farthest)?;
        let channel = self.chart.channels.iter().find(|c| c.channel.kind == kind)?;
        // Two shades over each other are a third colour.
        let mut layers = if moved.is_some() { Vec::new() } else { self.healthy_band(channel) };
        layers.extend(self.residual(channel).into_iter().filter(|l| !matches!(l, Layer::Points { .. })));
        let first =
            self.summary.events.iter().flat_map(|e| &e.courses).filter(|c| c.kind == kind).map(|c| c.alarm_s);
        if let Some(alarm_s) = first.reduce(f64::min) {
            let x = self.clock.axis(alarm_s);
            layers.push(Layer::VerticalLine {
                x,
                name: "first alarm".into(),
                colour: Colour::Black,
                dashed: true,
            });
        }
        layers.extend(self.courses(kind, true));
        let name = kind.name().replace('_', " ");
        let top = Panel { title: name.clone(), ..panel("distance from healthy / sigma", layers) };
        let [_, _, u] = self.columns.labels();
        let signal = Layer::line(
            if u == "u" { String::new() } else { u },
            Colour::Green,
            scaled(&self.chart.u, &self.clock),
        );
        let mut below = vec![signal];
        below.extend(self.courses(kind, false));
        let mut panels = vec![top, panel("u", below)];
        self.times(&mut panels);
        let healthy = if moved.is_some() { "shaded: where it stayed away" } else { "it stayed within" };
        let caption = format!(
            "Each point is one window of {} s: how far {} lies from what it was when the loop was healthy, in units of its healthy \
             scatter (sigma). Between the dashed limits is normal; {healthy}.",
            plain(self.summary.window_s, 4),
            kind.meaning().looks_at
        );
        let title = format!("How far {name} is from healthy, with its limits");
        Some(Proof { figure: Figure::stacked("", panels), title, caption })
    }

    /// Where healthy windows lie.
    fn healthy_band(&self, channel: &ChannelChart) -> Vec<Layer> {
        let Some(limits) = channel.channel.detectors.shewhart else { return Vec::new() };
        let ends = [self.summary.start_s, self.summary.start_s + self.summary.duration_s()]
            .map(|t| self.clock.axis(t));
        let edge = |y: f32| ends.iter().map(|t| (*t, f64::from(y))).collect();
        vec![Layer::Band {
            lower: edge(limits.lower),
            upper: edge(limits.upper),
            name: String::new(),
            colour: Colour::Sky,
        }]
    }

    /// The stretches in which a channel was away; `named` for the legend.
    fn courses(&self, kind: drift_core::ChannelKind, named: bool) -> Vec<Layer> {
        let end_s = self.summary.start_s + self.summary.duration_s();
        let courses = self.summary.events.iter().flat_map(|e| &e.courses).filter(|c| c.kind == kind);
        let mut seen = Vec::new();
        courses
            .map(|c| {
                let is_new = named && !seen.contains(&c.outcome);
                seen.push(c.outcome);
                let name = if is_new { c.outcome.name().to_owned() } else { String::new() };
                shade(c.outcome, self.clock.axis(c.from_s), self.clock.axis(c.to_s.unwrap_or(end_s)), name)
            })
            .collect()
    }

    /// Time under the lowest panel.
    fn times(&self, panels: &mut [Panel]) {
        for panel in &mut *panels {
            panel.x_dates = self.clock.zero_s.is_some();
        }
        if let Some(last) = panels.last_mut() {
            last.x_label = self.clock.label().into();
        }
    }

    pub fn found(&self) -> Section {
        let channels = self.summary.channels.iter().map(channel_row).collect();
        let head = [
            "channel",
            "windows judged",
            "mean distance, sigma",
            "farthest, sigma",
            "alarms",
            "outside what was calibrated",
            "verdict",
        ];
        let mut blocks = vec![Block::table(head, channels)];
        let events = &self.summary.events;
        if events.is_empty() {
            blocks.push(Block::Text("No channel left its baseline.".into()));
        } else {
            let unit = self.clock.label();
            let rows = events.iter().take(LISTED).flat_map(|e| self.event_rows(e)).collect();
            let head = [
                "event".into(),
                format!("from, {unit}"),
                format!("alarm, {unit}"),
                format!("to, {unit}"),
                "channel".into(),
                "side".into(),
                "farthest".into(),
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
        self.clock.cell(t_s)
    }

    fn event_rows(&self, event: &Event) -> Vec<Vec<String>> {
        let row = |(i, course): (usize, &Course)| {
            let line = |b0: f32, b1: f32| line(b0.into(), b1.into());
            vec![
                if i == 0 { event.kind().name().into() } else { String::new() },
                self.time(course.from_s),
                self.time(course.alarm_s),
                course.to_s.map_or_else(|| "open".into(), |t| self.time(t)),
                screen::label(course.kind),
                sentences::side_name(course.side).into(),
                unbroken(&sentences::sigmas(course.max_z.into())),
                screen::detectors(course),
                unbroken(&line(course.baseline.b0, course.baseline.b1)),
                course.fault_curve.map_or_else(String::new, |c| {
                    format!("{} ({})", unbroken(&line(c.b0, c.b1)), sentences::moved_name(c.moved))
                }),
            ]
        };
        event.courses.iter().enumerate().map(row).collect()
    }

    pub fn signals(&self) -> Section {
        let [r, y, u] = self.columns.labels();
        let line = |name: &str, colour, of| Layer::line(name, colour, scaled(of, &self.clock));
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
                    Layer::dashed(r, Colour::Black, scaled(&chart.r, &self.clock)),
                ]),
            ),
            panel("e = r \u{2212} y", with_events(vec![line("e", Colour::Purple, &chart.e)])),
            panel("u", with_events(vec![line(&u, Colour::Green, &chart.u)])),
            self.decisions(),
        ];
        let mut caption = format!(
            "Signals in the recording's own units; shades are events. The lowest panel has a row for each channel: pale while it is \
             healthy, orange while it is suspect, red in a drift, empty where it was not judged; crosses are alarms. A window is {} s.",
            plain(self.summary.window_s, 4)
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
        events(self.summary, &self.clock)
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
        self.times(&mut panels);
        let figure = Figure::stacked("", panels);
        Block::Chart(report::Chart { figure, caption, axis: Some(TIME.into()) })
    }

    /// A row of bars for each channel, coloured by what it said.
    fn decisions(&self) -> Panel {
        let (mut layers, mut y_names) = (Vec::new(), Vec::new());
        let learned: Vec<&ChannelChart> = self.chart.channels.iter().filter(|c| c.learned()).collect();
        for (i, channel) in learned.iter().enumerate() {
            let row = (learned.len() - 1 - i) as f64;
            for (said, name, colour) in [
                (Said::Healthy, "healthy", Colour::Sky),
                (Said::Suspect, "suspect", Colour::Orange),
                (Said::Drift, "drift", Colour::Vermilion),
            ] {
                let edge = |y: f64| self.stretches(channel, said, row + y);
                let (lower, upper) = (edge(0.12), edge(0.88));
                if !lower.is_empty() {
                    let name = if i == 0 { name.to_owned() } else { String::new() };
                    layers.push(Layer::Band { lower, upper, name, colour });
                }
            }
            let alarms = channel.alarms.iter().map(|(t_s, _)| (self.clock.axis(*t_s), row + 0.5)).collect();
            let name = if i == 0 { "alarm" } else { "" };
            layers.push(Layer::points(name, Colour::Black, Marker::Cross, alarms));
            y_names.push((row + 0.5, channel.channel.kind.name().replace('_', " ")));
        }
        Panel { layers, y_names, y_range: Some((0.0, learned.len().max(1) as f64)), ..panel("", Vec::new()) }
    }

    /// An edge of the bars over all stretches in which a channel said this; broken between them.
    fn stretches(&self, channel: &ChannelChart, wanted: Said, y: f64) -> Vec<(f64, f64)> {
        let mut edge = Vec::new();
        let ends = channel.verdicts.iter().skip(1).map(|v| v.0).chain([self.chart.last_s]);
        for ((from_s, said), to_s) in channel.verdicts.iter().zip(ends) {
            if *said == wanted {
                let (from, to) = (self.clock.axis(*from_s), self.clock.axis(to_s));
                let after = to + 1e-6 * self.summary.hop_s;
                edge.extend([(from, y), (to, y), (after, f64::NAN)]);
            }
        }
        edge
    }

    pub fn residuals(&self) -> Section {
        let mut panels = Vec::new();
        for channel in self.chart.channels.iter().filter(|c| c.learned()) {
            let kind = channel.channel.kind;
            let name = kind.name().replace('_', " ");
            let shades = self.courses(kind, false);
            let mut add = |title: String, y_label: &str, mut layers: Vec<Layer>| {
                layers.extend(shades.iter().cloned());
                panels.push(Panel { title, ..panel(y_label, layers) });
            };
            add(name.clone(), "distance / sigma", self.residual(channel));
            if channel.channel.detectors.cusum.is_some() {
                add(format!("{name}: sum of distances"), "sum / sigma", self.cusum(channel));
            }
            if channel.channel.detectors.sprt.is_some() {
                add(format!("{name}: evidence of a shift"), "log-likelihood", self.sprt(channel));
            }
        }
        let caption = "Distance: how far each window lies from the healthy relation, over its healthy scatter; a single window \
                       beyond the dashed limits is an alarm. Sum of distances (CUSUM): what lies off to one side adds up, less an \
                       allowance, until it crosses the threshold; the sum of what lies below is drawn downwards; after an alarm it \
                       starts anew. A small lasting shift shows there first.";
        let has_sprt = self.chart.channels.iter().any(|channel| channel.channel.detectors.sprt.is_some());
        let evidence = " Evidence of a shift (SPRT): how much likelier a shift is than health, as a logarithm; above the upper line \
                        is an alarm, below the lower one it starts anew.";
        let caption = if has_sprt { caption.to_owned() + evidence } else { caption.to_owned() };
        if panels.is_empty() {
            return Section::new(
                "Residuals and detectors",
                vec![Block::Text("No channel has a baseline: nothing is judged.".into())],
            );
        }
        Section::new("Residuals and detectors", vec![self.over_time(panels, caption)])
    }

    fn residual(&self, channel: &ChannelChart) -> Vec<Layer> {
        let alarms = channel.alarms.iter().map(|(t_s, z)| (self.clock.axis(*t_s), *z)).collect();
        let mut layers = vec![Layer::line("one window", Colour::Purple, scaled(&channel.z, &self.clock))];
        layers.extend(shewhart_limits(&channel.channel, "limits of one window"));
        layers.push(Layer::points("alarm", Colour::Vermilion, Marker::Cross, alarms));
        layers
    }

    fn cusum(&self, channel: &ChannelChart) -> Vec<Layer> {
        let [high, low] = channel.cusum.each_ref().map(|t| scaled(t, &self.clock));
        let low = low.into_iter().map(|(t, x)| (t, -x)).collect();
        let h = channel.channel.detectors.cusum.map_or(f64::NAN, |c| f64::from(c.h));
        two_sides(high, low, [h, -h], "threshold")
    }

    fn sprt(&self, channel: &ChannelChart) -> Vec<Layer> {
        let [high, low] = channel.sprt.each_ref().map(|t| scaled(t, &self.clock));
        let limits = channel
            .channel
            .detectors
            .sprt
            .map_or([f64::NAN; 2], |s| [f64::from(s.upper), f64::from(s.lower)]);
        two_sides(high, low, limits, "alarm above, restart below")
    }

    pub fn planes(&self) -> Section {
        let charts: Vec<&ChannelChart> =
            self.chart.channels.iter().filter(|c| c.learned() || !c.plane.is_empty()).collect();
        let panels: Vec<Panel> = charts.iter().map(|c| self.plane(c)).collect();
        let mut caption = "One point a window. Solid: the healthy line, with the narrow band in which the line itself lies and the \
                           wide one in which 95 % of healthy windows lie. Dashed: the line through the windows since an alarm."
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
            let name = format!("since {}", self.clock.says(c.from_s));
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
        plain(channel.mean_z, 3),
        plain(channel.max_abs_z, 3),
        channel.alarms.to_string(),
        channel.extrapolated.to_string(),
        verdict.into(),
    ]
}

/// A number with its unit, or a line, stays on one line of its cell: the words beside it have room to wrap.
fn unbroken(text: &str) -> String {
    text.replace(' ', "\u{a0}")
}
