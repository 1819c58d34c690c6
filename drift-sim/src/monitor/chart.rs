//! The chart of a run: reference and output, controller output, and each channel's standardised residual with its
//! thresholds. Events are shaded over the signals, a channel's own courses over its residual. What is drawn is thinned while the recording is read.

use drift_core::Config;

use super::events::EventKind;
use super::run::Hop;
use super::summary::Summary;
use super::thinned::Thinned;
use crate::plot::terminal::{COLUMNS, Signs, farthest, row, stretches};
use crate::plot::{Colour, Figure, Layer, Panel};

/// Collects the signals of a run.
#[derive(Debug, Clone)]
pub struct Chart {
    config: Config<f32, 3>,
    r: Thinned,
    y: Thinned,
    u: Thinned,
    z: [Thinned; 3],
}

impl Chart {
    /// A chart without any sample, with the limits of this configuration.
    pub fn new(config: &Config<f32, 3>) -> Self {
        let new = Thinned::new;
        Self { config: *config, r: new(), y: new(), u: new(), z: [new(), new(), new()] }
    }

    /// The next sample; NaN where there is none.
    pub fn sample(&mut self, t_s: f64, r: f64, y: f64, u: f64) {
        self.r.add(t_s, r);
        self.y.add(t_s, y);
        self.u.add(t_s, u);
    }

    /// The next decision.
    pub fn hop(&mut self, hop: &Hop) {
        for (z, channel) in self.z.iter_mut().zip(&hop.report.channels) {
            z.add(hop.to_s, f64::from(channel.z));
        }
    }

    /// Each judged channel's residual over the run as a row of text: of each stretch the value farthest from
    /// zero, all
    /// rows between the same limits.
    pub fn rows(&self, summary: &Summary, signs: Signs) -> String {
        let channels = self.z.iter().zip(&summary.channels).filter(|(_, c)| c.learned && c.judged > 0);
        let rows: Vec<(&str, Vec<f64>)> = channels
            .map(|(z, channel)| {
                let values: Vec<f64> = z.points().into_iter().map(|(_, z)| z).collect();
                (channel.kind.name(), stretches(&values, COLUMNS, farthest))
            })
            .collect();
        let most = rows.iter().flat_map(|(_, z)| z).map(|z| z.abs()).fold(0.0, f64::max);
        if most == 0.0 {
            return String::new();
        }
        let mut text = format!("\nresiduals over the recording, -{most:.1} to {most:.1} sigma\n");
        for (name, z) in &rows {
            text += &format!("  {name:<16} {}\n", row(z, (-most, most), signs));
        }
        text
    }

    /// Draws it.
    pub fn figure(&self, summary: &Summary) -> Figure {
        let end_s = summary.start_s + summary.duration_s();
        let (unit, per_unit) = time_unit(summary.duration_s());
        let scaled = |thinned: &Thinned| -> Vec<(f64, f64)> {
            thinned.points().into_iter().map(|(t, x)| (t / per_unit, x)).collect()
        };
        let shade =
            |kind, from: f64, to: Option<f64>| shade(kind, from / per_unit, to.unwrap_or(end_s) / per_unit);
        let events = || summary.events.iter().map(|e| shade(e.kind(), e.from_s(), e.to_s()));
        let mut panels = vec![
            panel(
                "r, y",
                vec![
                    Layer::line("y", Colour::Blue, scaled(&self.y)),
                    Layer::dashed("r", Colour::Black, scaled(&self.r)),
                ]
                .into_iter()
                .chain(events())
                .collect(),
            ),
            panel(
                "u",
                std::iter::once(Layer::line("u", Colour::Green, scaled(&self.u))).chain(events()).collect(),
            ),
        ];
        for (z, channel) in self.z.iter().zip(&self.config.channels) {
            let mut layers = vec![Layer::line(
                format!("{} residual, sigmas", channel.kind.name()),
                Colour::Purple,
                scaled(z),
            )];
            if let Some(limits) = channel.detectors.shewhart {
                for (limit, name) in [(limits.upper, "Shewhart limits"), (limits.lower, "")] {
                    layers.push(Layer::HorizontalLine {
                        y: f64::from(limit),
                        name: name.into(),
                        colour: Colour::Vermilion,
                        dashed: true,
                    });
                }
            }
            let courses = summary.events.iter().flat_map(|e| &e.courses);
            let own = courses.filter(|c| c.kind == channel.kind);
            layers.extend(own.map(|c| shade(c.outcome, c.from_s, c.to_s)));
            panels.push(panel(&format!("{} z", channel.kind.name()), layers));
        }
        if let Some(last) = panels.last_mut() {
            last.x_label = format!("t / {unit}");
        }
        let path = std::path::Path::new(&summary.recording);
        let name = path.file_name().map_or(summary.recording.clone(), |n| n.to_string_lossy().into_owned());
        Figure::stacked(name, panels)
    }
}

/// The unit in which a recording of this length reads best, and its seconds.
fn time_unit(duration_s: f64) -> (&'static str, f64) {
    match duration_s {
        d if d >= 10.0 * 86_400.0 => ("d", 86_400.0),
        d if d >= 3.0 * 3600.0 => ("h", 3600.0),
        d if d >= 600.0 => ("min", 60.0),
        _ => ("s", 1.0),
    }
}

fn panel(y_label: &str, layers: Vec<Layer>) -> Panel {
    Panel { y_label: y_label.into(), layers, ..Panel::default() }
}

fn shade(kind: EventKind, from: f64, to: f64) -> Layer {
    let colour = match kind {
        EventKind::Disturbance => Colour::Yellow,
        EventKind::Suspect => Colour::Orange,
        EventKind::Drift => Colour::Vermilion,
    };
    Layer::Span { from, to, name: String::new(), colour }
}
