//! A calibration as a report for people: each channel's line with its bands and windows, the residuals under their
//! thresholds, and the recordings that it was learnt from.

use drift_core::Channel;

use super::detector;
use super::{Calibration, ChannelFit, Signals};
use crate::plot::{Colour, Figure, Layer, Marker, Panel};
use crate::recording::ColumnMap;
use crate::report::{self, Block, Cloud, Page, Proof, Section};
use crate::sentences::{self, ends, plain};

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
            about: format!("learnt from {}", names.join(", ")),
            answer: sentences::calibration(self),
            proof: self.proof(),
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

    /// The channel whose line is the sharpest: its windows, line and bands.
    fn proof(&self) -> Option<Proof> {
        let sharpest = self.channels.iter().max_by(|a, b| a.fit.r2.total_cmp(&b.fit.r2))?;
        let name = sharpest.kind.name().replace('_', " ");
        let panels = vec![self.plane(sharpest), self.residual_panel(sharpest)];
        let mut panels: Vec<Panel> =
            panels.into_iter().map(|p| Panel { title: String::new(), ..p }).collect();
        if let Some(last) = panels.last_mut() {
            last.x_label = "window".into();
        }
        Some(Proof {
            figure: Figure::grid("", 1, panels),
            title: format!("The healthy windows of the channel {name}, and its line"),
            caption: format!(
                "The channel {name}. Above: one point a window, the healthy line, and the band in which 95 % of healthy windows lie. \
                 Below: how far each window lies from the line, with the limits beyond which a window is an alarm."
            ),
        })
    }

    fn facts(&self, recordings: &[Signals<'_>]) -> Vec<(String, String)> {
        let timing = &self.file.timing;
        let mut facts: Vec<(String, String)> = recordings
            .iter()
            .map(|r| {
                let length = plain(r.r.len() as f64 * r.sample_time_s, 6);
                let text = format!("{}: {} samples, {length} s", r.name, r.r.len());
                ("Recording".to_owned(), text)
            })
            .collect();
        let windows = format!(
            "{} s, a decision every {} s; {} left out for too few valid samples",
            plain(timing.window_s(), 4),
            plain(timing.hop_s(), 4),
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
                between(fit.b0_ci95_wide()),
                between(fit.b1_ci95_wide()),
                plain(fit.r2, 3),
                plain(fit.rmse, 3),
                plain(c.lag1, 2),
                plain(c.n_effective, 3),
                plain(c.skewness, 2),
            ]
        };
        let head = [
            "channel",
            "b0, 95 % interval",
            "b1, 95 % interval",
            "R\u{b2}",
            "scatter",
            "correlation with the window before",
            "independent windows",
            "skewness",
        ];
        let mut blocks = vec![Block::table(head, self.channels.iter().map(row).collect())];
        if !self.warnings.is_empty() {
            let (asked, known): (Vec<String>, Vec<String>) =
                self.warnings.iter().cloned().partition(|warning| sentences::asks_for_action(warning));
            for (title, list) in [("What could be better", asked), ("What the thresholds allow for", known)] {
                if !list.is_empty() {
                    blocks.push(Block::Text(title.into()));
                    blocks.push(Block::List(list));
                }
            }
        }
        blocks.push(Block::Note(
            "A channel's value is b0 + b1 x, give or take the scatter. The intervals allow for correlated windows and unequal \
             scatter (Newey and West 1987). Independent windows: what all windows are worth, for neighbours resemble each other."
                .into(),
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

    /// One in so many windows is drawn.
    fn every(&self) -> usize {
        self.windows.len().div_ceil(PLANE).max(1)
    }

    fn plane(&self, fit: &ChannelFit) -> Panel {
        let points = self.points(fit).into_iter().step_by(self.every()).collect();
        let cloud =
            Cloud { name: "healthy window".into(), colour: Colour::Grey, marker: Marker::Dot, points };
        report::plane(&fit.entry().channel, vec![cloud], &[])
    }

    fn planes(&self) -> Section {
        let every = self.every();
        let panels = self.channels.iter().map(|fit| self.plane(fit)).collect();
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
                 one channel is found after {} decisions ({} s) on average, {} of the healthy loop.",
                plain(promise.false_alarm_every_h, 4),
                plain(promise.decisions, 4),
                plain(self.cost.delay, 3),
                plain(self.cost.delay * self.file.timing.hop_s(), 3),
                sentences::lateness(self.cost.delay / self.cost.delay_exact)
            )));
        }
        Section::new("Thresholds", blocks)
    }

    fn residuals(&self, names: &[&str]) -> Section {
        let panels: Vec<Panel> = self.channels.iter().map(|fit| self.residual_panel(fit)).collect();
        let mut caption =
            "How far each healthy window lies from the line, over the healthy scatter. Beyond the dashed limits a single window is an alarm.".to_owned();
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
        let mut layers = vec![Layer::line("one window", Colour::Purple, points)];
        if let Some(s) = detectors.shewhart {
            for (y, name) in [(s.upper, "limits of one window"), (s.lower, "")] {
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
            y_label: "distance / sigma".into(),
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

fn between([low, high]: [f64; 2]) -> String {
    ends(low, high)
}

fn file_name(path: &str) -> &str {
    std::path::Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or(path)
}
