//! A calibration as a report for people: each channel's line with its bands and windows, the residuals under their
//! thresholds, and the recordings that it was learnt from.

use drift_core::Channel;

use super::detector;
use super::{Calibration, ChannelFit, Signals};
use crate::plot::{Colour, Figure, Layer, Marker, Panel};
use crate::recording::ColumnMap;
use crate::report::{self, Block, Cloud, Page, Section, interval, number};

/// Recordings whose signals are drawn.
const DRAWN: usize = 6;
/// Windows drawn in a plane.
const PLANE: usize = 8192;

impl Calibration {
    /// The page of a calibration on `recordings`; `columns` are their names of the signals, `command` is the command line.
    pub fn page(&self, recordings: &[Signals<'_>], columns: &ColumnMap, command: String) -> Page {
        let names: Vec<&str> = recordings.iter().map(|r| file_name(r.name)).collect();
        Page {
            title: format!("Calibration on {}", names.join(", ")),
            verdict: self.verdict(),
            command,
            facts: self.facts(recordings),
            sections: vec![
                self.lines(),
                self.planes(),
                self.thresholds(),
                self.residuals(&names),
                signals(recordings, columns),
            ],
        }
    }

    fn verdict(&self) -> String {
        let channels: Vec<String> = self.channels.iter().map(|c| c.kind.name().replace('_', " ")).collect();
        let mut text = format!(
            "{} healthy windows of {} s give the baseline of {}.",
            self.file.calibration.windows,
            number(self.file.timing.window_s()),
            channels.join(", ")
        );
        if let Some(promise) = &self.file.promise {
            text += &format!(
                " Its thresholds are made for one false alarm in {} h; {} of 100 such calibrations are aimed to keep that.",
                number(promise.false_alarm_every_h),
                number(100.0 * promise.confidence)
            );
        }
        match self.warnings.len() {
            0 => text,
            1 => text + " There is a warning below.",
            n => text + &format!(" There are {n} warnings below."),
        }
    }

    fn facts(&self, recordings: &[Signals<'_>]) -> Vec<(String, String)> {
        let timing = &self.file.timing;
        let mut facts: Vec<(String, String)> = recordings
            .iter()
            .map(|r| {
                let length = number(r.r.len() as f64 * r.sample_time_s);
                let text = format!("{}: {} samples, {length} s", r.name, r.r.len());
                ("Recording".to_owned(), text)
            })
            .collect();
        let windows = format!(
            "{} s, a decision every {} s; {} left out for too few valid samples",
            number(timing.window_s()),
            number(timing.hop_s()),
            self.invalid_windows
        );
        facts.push(("Windows".into(), windows));
        if let Some(reason) = &self.timing.reason {
            facts.push(("Why".into(), reason.clone()));
        }
        facts
    }

    fn lines(&self) -> Section {
        let row = |c: &ChannelFit| {
            let fit = &c.fit;
            vec![
                c.kind.name().replace('_', " "),
                number(fit.b0),
                interval(fit.b0_ci95_wide()),
                number(fit.b1),
                interval(fit.b1_ci95_wide()),
                number(fit.r2),
                number(fit.rmse),
                number(c.lag1),
                number(c.n_effective),
                number(c.skewness),
            ]
        };
        let head = ["channel", "b0", "95 %", "b1", "95 %", "R\u{b2}", "RMSE", "lag-1", "n_eff", "skewness"];
        let mut blocks = vec![Block::table(head, self.channels.iter().map(row).collect())];
        if !self.warnings.is_empty() {
            blocks.push(Block::Text("Warnings".into()));
            blocks.push(Block::List(self.warnings.clone()));
        }
        blocks.push(Block::Note(
            "value = b0 + b1 x. The intervals allow for correlated windows and unequal scatter (Newey and West 1987). lag-1 is \
             the correlation of neighbouring residuals, n_eff the independent windows that all are worth.".into(),
        ));
        Section::new("The healthy lines", blocks)
    }

    /// Where a channel stands in windows and file.
    fn position(&self, fit: &ChannelFit) -> usize {
        self.file.channels.iter().position(|e| e.channel.kind == fit.kind).unwrap_or(0)
    }

    fn points(&self, fit: &ChannelFit) -> Vec<(f64, f64)> {
        let at = self.position(fit);
        let x = self.windows.iter().map(|w| w.x.get(at).map_or(f64::NAN, |x| f64::from(*x)));
        // The value without what the windows before contribute: what the line is about.
        x.zip(&fit.fit.residuals).map(|(x, residual)| (x, fit.fit.at(x) + residual)).collect()
    }

    fn planes(&self) -> Section {
        let every = self.windows.len().div_ceil(PLANE).max(1);
        let panel = |fit: &ChannelFit| {
            let points = self.points(fit).into_iter().step_by(every).collect();
            let cloud =
                Cloud { name: "healthy window".into(), colour: Colour::Grey, marker: Marker::Dot, points };
            report::plane(&fit.entry().channel, vec![cloud], &[])
        };
        let panels = self.channels.iter().map(panel).collect();
        let mut caption = "One point a window, with the healthy line, the band where the line itself lies (95 % confidence) and \
                           the one where 95 % of healthy windows lie."
            .to_owned();
        if every > 1 {
            caption += &format!(" One window in {every} is drawn.");
        }
        let figure = Figure { panel_height_px: 330, ..Figure::grid("", 2, panels) };
        Section::new("The planes", vec![Block::Chart(report::Chart { figure, caption, axis: None })])
    }

    fn thresholds(&self) -> Section {
        let row = |c: &ChannelFit| {
            let none = || "\u{2013}".to_owned();
            let thresholds =
                detector::ROWS.iter().map(|row| row.thresholds(&c.detectors).unwrap_or_else(none));
            std::iter::once(c.kind.name().replace('_', " ")).chain(thresholds).collect()
        };
        let rows = self.channels.iter().map(row).collect();
        let [a, b, c, d] = detector::ROWS.map(detector::Designed::spoken);
        let mut blocks = vec![Block::table(["channel", a, b, c, d], rows)];
        if let Some(promise) = &self.file.promise {
            blocks.push(Block::Text(format!(
                "One false alarm per {} h is one in {} decisions, of all channels and detectors together. A shift of one sigma in \
                 one channel is found after {} decisions ({} s) on average, {:.0} % later than exact knowledge of the healthy loop \
                 would.",
                number(promise.false_alarm_every_h),
                number(promise.decisions),
                number(self.cost.delay),
                number(self.cost.delay * self.file.timing.hop_s()),
                100.0 * (self.cost.delay / self.cost.delay_exact - 1.0)
            )));
        }
        Section::new("Thresholds", blocks)
    }

    fn residuals(&self, names: &[&str]) -> Section {
        let panels: Vec<Panel> = self.channels.iter().map(|fit| self.residual_panel(fit)).collect();
        let mut caption =
            "Each healthy window's residual in standard deviations, and its Shewhart limits.".to_owned();
        if names.len() > 1 {
            caption += " Upright lines: where a recording ends and the next one begins.";
        }
        let mut figure = Figure::stacked("", panels);
        if let Some(last) = figure.panels.last_mut() {
            last.x_label = "window".into();
        }
        let chart = report::Chart { figure, caption, axis: Some("windows".into()) };
        Section::new("Residuals of the healthy windows", vec![Block::Chart(chart)])
    }

    fn residual_panel(&self, fit: &ChannelFit) -> Panel {
        let Channel { baseline, detectors, .. } = fit.entry().channel;
        let z = |(x, value): (f64, f64)| {
            let (x, value) = (x as f32, value as f32);
            f64::from(baseline.standardise(x, baseline.residual(x, value)))
        };
        let points = self.points(fit).into_iter().enumerate().map(|(i, p)| (i as f64, z(p))).collect();
        let mut layers = vec![Layer::line("residual", Colour::Purple, points)];
        if let Some(s) = detectors.shewhart {
            for (y, name) in [(s.upper, "Shewhart limits"), (s.lower, "")] {
                let y = f64::from(y);
                layers.push(Layer::HorizontalLine {
                    y,
                    name: name.into(),
                    colour: Colour::Vermilion,
                    dashed: true,
                });
            }
        }
        let ends = self.windows.windows(2).enumerate().filter_map(|(i, pair)| match pair {
            [a, b] if a.recording != b.recording => Some(i as f64 + 0.5),
            _ => None,
        });
        layers.extend(ends.map(|x| Layer::VerticalLine {
            x,
            name: String::new(),
            colour: Colour::Grey,
            dashed: false,
        }));
        Panel {
            title: fit.kind.name().replace('_', " "),
            y_label: "z, sigmas".into(),
            layers,
            ..Panel::default()
        }
    }
}

/// r, y, e and u of each recording.
fn signals(recordings: &[Signals<'_>], columns: &ColumnMap) -> Section {
    let mut blocks: Vec<Block> = Vec::new();
    let [r, y, u] = columns.labels();
    for signals in recordings.iter().take(DRAWN) {
        let line =
            |name: String, colour, x: &[f64]| Layer::signal(name, colour, 0.0, signals.sample_time_s, x);
        let panel = |y_label: &str, layers| Panel { y_label: y_label.into(), layers, ..Panel::default() };
        let error: Vec<f64> = signals.r.iter().zip(signals.y).map(|(r, y)| r - y).collect();
        let mut reference = line(r.clone(), Colour::Black, signals.r);
        if let Layer::Line { dashed, .. } = &mut reference {
            *dashed = true;
        }
        let panels = vec![
            panel("r, y", vec![line(y.clone(), Colour::Blue, signals.y), reference]),
            panel("e = r \u{2212} y", vec![line("e".into(), Colour::Purple, &error)]),
            Panel { x_label: "t / s".into(), ..panel("u", vec![line(u.clone(), Colour::Green, signals.u)]) },
        ];
        let caption = format!("{}, time from its first sample.", signals.name);
        blocks.push(Block::Chart(report::Chart { figure: Figure::stacked("", panels), caption, axis: None }));
    }
    if recordings.len() > DRAWN {
        blocks.push(Block::Note(format!("Of {} recordings the first {DRAWN} are drawn.", recordings.len())));
    }
    Section::new("The recordings", blocks)
}

fn file_name(path: &str) -> &str {
    std::path::Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or(path)
}
