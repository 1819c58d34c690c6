//! What charts and reports show of a run, collected while the recording is read, in bounded memory; and the picture: reference
//! and output, controller output, and each channel's standardised residual with its thresholds. Events are shaded over the
//! signals, a channel's own courses over its residual.

use drift_core::{Channel, Config, Verdict};

use super::events::EventKind;
use super::run::Hop;
use super::summary::Summary;
use super::thinned::Thinned;
use crate::plot::terminal::{farthest, row, stretches};
use crate::plot::{Colour, Figure, Layer, Panel};
use crate::recording::Samples;
use crate::sentences::{Clock, sigmas};
use crate::terminal::Terminal;

/// Windows kept of each channel's plane; beyond, every second one, every fourth ...
const PLANE: usize = 4096;
/// Changes of verdict kept of each channel, and alarms.
const CHANGES: usize = 8192;

/// Collects the signals of a run.
#[derive(Debug, Clone)]
pub struct Chart {
    pub(super) r: Thinned,
    pub(super) y: Thinned,
    pub(super) u: Thinned,
    pub(super) e: Thinned,
    /// Whether the four above are collected.
    has_signals: bool,
    pub(super) channels: [ChannelChart; 3],
    /// Begin and end of the first window, s, and the last decision.
    pub(super) first: Option<(f64, f64)>,
    pub(super) last_s: f64,
}

/// One channel's part.
#[derive(Debug, Clone)]
pub(super) struct ChannelChart {
    pub channel: Channel,
    pub z: Thinned,
    /// Upwards, downwards.
    pub cusum: [Thinned; 2],
    pub sprt: [Thinned; 2],
    /// Decision, s, and z, of each alarm.
    pub alarms: Vec<(f64, f64)>,
    /// From when on, s, it said what.
    pub verdicts: Vec<(f64, Said)>,
    /// x, value and what was said of a window; one in `every`.
    pub plane: Vec<(f64, f64, Said)>,
    pub every: u64,
    seen: u64,
    /// The CUSUM's sums at the last decision.
    sums: [f32; 2],
}

/// What a channel said of a window, as charts tell it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Said {
    /// Nothing: too few samples, or no baseline.
    NotJudged,
    /// On the baseline, or back on it.
    Healthy,
    /// Away, and not yet known whether to stay.
    Suspect,
    /// Away to stay.
    Drift,
}

impl ChannelChart {
    fn new(channel: Channel) -> Self {
        let new = Thinned::new;
        Self {
            channel,
            z: new(),
            cusum: [new(), new()],
            sprt: [new(), new()],
            alarms: Vec::new(),
            verdicts: Vec::new(),
            plane: Vec::new(),
            every: 1,
            seen: 0,
            sums: [0.0; 2],
        }
    }

    fn hop(&mut self, to_s: f64, begin_s: f64, report: &drift_core::ChannelReport) {
        let z = f64::from(report.z);
        self.z.add(to_s, z);
        let (cusum, sprt) = (self.crossing(z, report), report.detectors.sprt);
        let of_cusum = self.cusum.iter_mut().zip(cusum);
        for (thinned, value) in of_cusum.chain(self.sprt.iter_mut().zip([sprt.high, sprt.low])) {
            thinned.add(to_s, f64::from(value));
        }
        self.sums = [report.detectors.cusum.high, report.detectors.cusum.low];
        if report.alarms.side().is_some() && self.alarms.len() < CHANGES {
            self.alarms.push((to_s, z));
        }
        let said = Said::of(report.verdict, z);
        if self.verdicts.last().is_none_or(|last| last.1 != said) && self.verdicts.len() < CHANGES {
            self.verdicts.push((begin_s, said));
        }
        let x = f64::from(report.x);
        self.add_to_plane(x, self.on_plane(x, report), said);
    }

    /// The value beside its line: where the relation remembers earlier windows or a measured operating point, less what these carry.
    fn on_plane(&self, x: f64, report: &drift_core::ChannelReport) -> f64 {
        let baseline = &self.channel.baseline;
        let residual = f64::from(report.residual);
        if self.learned() && (residual.is_finite() || self.channel.memory.order > 0) {
            f64::from(baseline.b0) + f64::from(baseline.b1) * x + residual
        } else {
            f64::from(report.value)
        }
    }

    /// The CUSUM's two sums as a chart should show them: where one has alarmed and begun anew, with what it had reached.
    fn crossing(&self, z: f64, report: &drift_core::ChannelReport) -> [f32; 2] {
        let now = [report.detectors.cusum.high, report.detectors.cusum.low];
        let Some(cusum) = self.channel.detectors.cusum.filter(|_| z.is_finite()) else { return now };
        let reached = |i: usize, step: f32| {
            let (before, now) =
                (self.sums.get(i).copied().unwrap_or(0.0), now.get(i).copied().unwrap_or(f32::NAN));
            let sum = before + step - cusum.k;
            if sum >= cusum.h && now < sum { sum } else { now }
        };
        [reached(0, z as f32), reached(1, -z as f32)]
    }

    fn add_to_plane(&mut self, x: f64, value: f64, said: Said) {
        if x.is_finite() && value.is_finite() {
            if self.seen.is_multiple_of(self.every) {
                self.plane.push((x, value, said));
            }
            self.seen += 1;
        }
        if self.plane.len() > PLANE {
            let mut keep = false;
            self.plane.retain(|_| {
                keep = !keep;
                keep
            });
            self.every *= 2;
        }
    }

    /// Whether it has a baseline to be judged by.
    pub fn learned(&self) -> bool {
        self.channel.baseline.sigma > 0.0
    }
}

impl Said {
    fn of(verdict: Verdict, z: f64) -> Self {
        match verdict {
            Verdict::Drift => Self::Drift,
            Verdict::Suspect => Self::Suspect,
            _ if z.is_nan() => Self::NotJudged,
            _ => Self::Healthy,
        }
    }
}

impl Chart {
    /// A chart without any sample, with the limits of this configuration.
    pub fn new(config: &Config<f32, 3>) -> Self {
        let new = Thinned::new;
        Self {
            r: new(),
            y: new(),
            u: new(),
            e: new(),
            has_signals: true,
            channels: config.channels.map(ChannelChart::new),
            first: None,
            last_s: f64::NAN,
        }
    }

    /// The same for [`Self::rows`] alone, which show no signals: samples are passed over.
    pub fn of_residuals(config: &Config<f32, 3>) -> Self {
        Self { has_signals: false, ..Self::new(config) }
    }

    /// The next sample; NaN where there is none.
    #[inline]
    pub fn sample(&mut self, t_s: f64, r: f64, y: f64, u: f64) {
        if !self.has_signals {
            return;
        }
        self.r.add(t_s, r);
        self.y.add(t_s, y);
        self.u.add(t_s, u);
        self.e.add(t_s, r - y);
    }

    /// The next samples, all of which are there.
    pub fn samples(&mut self, samples: &Samples<'_>) {
        if !self.has_signals {
            return;
        }
        let Samples { t_s, r, y, u } = *samples;
        for (((t_s, r), y), u) in t_s.iter().zip(r).zip(y).zip(u) {
            self.sample(*t_s, *r, *y, *u);
        }
    }

    /// The next decision.
    pub fn hop(&mut self, hop: &Hop) {
        self.first.get_or_insert((hop.from_s, hop.to_s));
        self.last_s = hop.to_s;
        for (chart, report) in self.channels.iter_mut().zip(&hop.report.channels) {
            chart.hop(hop.to_s, hop.new_from_s, report);
        }
    }

    /// Each channel's residual over the run: times of decisions, s, and sigmas, thinned, in the configuration's order.
    pub fn residuals(&self) -> [Vec<(f64, f64)>; 3] {
        self.channels.each_ref().map(|channel| channel.z.points())
    }

    /// Each judged channel's residual over the run as a row of text: of each stretch the value farthest from zero, all rows
    /// between the same limits.
    pub fn rows(&self, summary: &Summary, terminal: &Terminal) -> String {
        let channels = self.channels.iter().zip(&summary.channels).filter(|(_, c)| c.learned && c.judged > 0);
        let rows: Vec<(&str, Vec<f64>)> = channels
            .map(|(chart, channel)| {
                let values: Vec<f64> = chart.z.points().into_iter().map(|(_, z)| z).collect();
                (channel.kind.name(), stretches(&values, terminal.chart_columns(), farthest))
            })
            .collect();
        let most = rows.iter().flat_map(|(_, z)| z).map(|z| z.abs()).fold(0.0, f64::max);
        if most == 0.0 {
            return String::new();
        }
        let mut text = format!("\ndistance from healthy, up to {} either way\n", sigmas(most));
        for (name, z) in &rows {
            text += &format!("  {name:<16} {}\n", row(z, (-most, most), terminal.signs));
        }
        text
    }

    /// Draws it.
    pub fn figure(&self, summary: &Summary) -> Figure {
        let end_s = summary.start_s + summary.duration_s();
        let clock = summary.clock();
        let events = || events(summary, &clock);
        let x_dates = clock.zero_s.is_some();
        let panel =
            |y_label: &str, layers| Panel { y_label: y_label.into(), layers, x_dates, ..Panel::default() };
        let mut panels = vec![
            panel(
                "r, y",
                vec![
                    Layer::line("y", Colour::Blue, scaled(&self.y, &clock)),
                    Layer::dashed("r", Colour::Black, scaled(&self.r, &clock)),
                ]
                .into_iter()
                .chain(events())
                .collect(),
            ),
            panel(
                "u",
                std::iter::once(Layer::line("u", Colour::Green, scaled(&self.u, &clock)))
                    .chain(events())
                    .collect(),
            ),
        ];
        for chart in &self.channels {
            let kind = chart.channel.kind;
            let mut layers = vec![Layer::line(
                format!("{} residual, sigmas", kind.name()),
                Colour::Purple,
                scaled(&chart.z, &clock),
            )];
            layers.extend(shewhart_limits(&chart.channel, "limits of one window"));
            let courses = summary.events.iter().flat_map(|e| &e.courses).filter(|c| c.kind == kind);
            layers.extend(courses.map(|c| {
                shade(c.outcome, clock.axis(c.from_s), clock.axis(c.to_s.unwrap_or(end_s)), String::new())
            }));
            panels.push(panel(&format!("{} z", kind.name()), layers));
        }
        if let Some(last) = panels.last_mut() {
            last.x_label = clock.label().into();
        }
        Figure::stacked(file_name(summary), panels)
    }
}

/// The recording's name without its folders.
pub(super) fn file_name(summary: &Summary) -> String {
    let path = std::path::Path::new(&summary.recording);
    path.file_name().map_or(summary.recording.clone(), |n| n.to_string_lossy().into_owned())
}

/// Points on the recording's clock.
pub(super) fn scaled(thinned: &Thinned, clock: &Clock) -> Vec<(f64, f64)> {
    thinned.points().into_iter().map(|(t, x)| (clock.axis(t), x)).collect()
}

/// The events as shades.
pub(super) fn events<'a>(summary: &'a Summary, clock: &'a Clock) -> impl Iterator<Item = Layer> + 'a {
    let end_s = summary.start_s + summary.duration_s();
    summary.events.iter().map(move |e| {
        let to_s = e.to_s().unwrap_or(end_s);
        shade(e.kind(), clock.axis(e.from_s()), clock.axis(to_s), String::new())
    })
}

/// The limits of a single residual; `name` for the legend.
pub(super) fn shewhart_limits(channel: &Channel, name: &str) -> Vec<Layer> {
    let Some(limits) = channel.detectors.shewhart else { return Vec::new() };
    [(limits.upper, name), (limits.lower, "")]
        .map(|(limit, name)| Layer::HorizontalLine {
            y: f64::from(limit),
            name: name.into(),
            colour: Colour::Vermilion,
            dashed: true,
        })
        .into()
}

/// A stretch of time, shaded.
pub(super) fn shade(kind: EventKind, from: f64, to: f64, name: String) -> Layer {
    let colour = match kind {
        EventKind::Disturbance => Colour::Yellow,
        EventKind::Suspect => Colour::Orange,
        EventKind::Drift => Colour::Vermilion,
    };
    Layer::Span { from, to, name, colour }
}
