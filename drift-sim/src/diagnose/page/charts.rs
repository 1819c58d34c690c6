//! The sections of a diagnosis's page that are drawn: the loop as measured and as simulated, and the missing drive.

use crate::diagnose::drive_charts::{Cloud, estimate, usual};
use crate::diagnose::shown::Shown;
use crate::diagnose::{HELD_OUT, motion};
use crate::plot::{Colour, Figure, Layer, Panel};
use crate::report::{Block, Chart, Section};
use crate::sentences::{plain, with_unit};
use crate::simulate::Trace;

use super::{SIMULATED, TIME, WITH, WITHOUT, Writing, named};

impl Writing<'_> {
    /// r, y and u of the closed loop, measured and simulated.
    pub(super) fn runs(&self) -> Section {
        let shown = self.case.drawn();
        let (signals, clock) = (&shown.signals, &shown.clock);
        let [r, y, u] = self.case.columns.labels();
        let line = |name: &str, colour, x: &[f64]| shown.line(name, colour, x);
        let simulated = |of: &dyn Fn(&Trace) -> Vec<f64>| -> Vec<Layer> {
            let with = if self.differs() { WITH } else { SIMULATED };
            let before = self.runs.before.as_ref().filter(|_| self.differs());
            let drawn = before.map(|run| line(WITHOUT, Colour::Vermilion, &of(run))).into_iter();
            drawn.chain(self.runs.after.as_ref().map(|run| line(with, Colour::Blue, &of(run)))).collect()
        };
        let error = |t: &Trace| -> Vec<f64> { signals.y.iter().zip(&t.y).map(|(a, b)| a - b).collect() };
        let panel = |what: &str, unit: &str, layers: Vec<Layer>| Panel {
            y_label: named(what, unit),
            layers: layers.into_iter().chain(self.marks()).collect(),
            x_dates: clock.zero_s.is_some(),
            ..Panel::default()
        };
        let mut outputs = vec![
            line(&format!("r ({r})"), Colour::Green, &signals.r),
            line("measured", Colour::Grey, &signals.y),
        ];
        outputs.extend(simulated(&|t| t.y.clone()));
        let control: Vec<f64> = signals.r.iter().zip(&signals.y).map(|(r, y)| r - y).collect();
        let mut controls = vec![line("measured", Colour::Grey, &control)];
        controls.extend(simulated(&|t| signals.r.iter().zip(&t.y).map(|(r, y)| r - y).collect()));
        let mut efforts = vec![line("measured", Colour::Grey, &signals.u)];
        efforts.extend(simulated(&|t| t.u.clone()));
        let y_unit = &self.units.y;
        let panels = vec![
            panel(&format!("r and y ({y})"), y_unit, outputs),
            panel("e = r \u{2212} y", y_unit, controls),
            panel("y \u{2212} \u{177}", y_unit, simulated(&error)),
            Panel { x_label: clock.label().into(), ..panel(&format!("u ({u})"), &self.units.u, efforts) },
        ];
        let caption = match self.case.holdout {
            Some(_) => "The second recording, which no number was fitted on.",
            None => "Nothing was fitted on the part after the upright line.",
        };
        let lines = if self.differs() {
            " Without it: the model with its own numbers refitted; with it: with what was found."
        } else {
            ""
        };
        let caption = format!("{caption}{lines} \u{177} is y as simulated.");
        let mut blocks = vec![Block::Chart(Chart {
            figure: Figure::stacked("", panels),
            caption,
            axis: Some(TIME.into()),
        })];
        let runs: &[(&str, &Option<Trace>)] = if self.differs() {
            &[(" without what was found", &self.runs.before), (" with what was found", &self.runs.after)]
        } else {
            &[("", &self.runs.after)]
        };
        for (which, run) in runs {
            if run.is_none() {
                blocks.push(Block::Note(format!(
                    "The model{which} can't be drawn: it diverges over this recording."
                )));
            }
        }
        Section::new("Measured and simulated", blocks)
    }

    /// When found physics acts, and where the unseen part begins.
    fn marks(&self) -> Vec<Layer> {
        let Shown { signals, clock, .. } = self.case.drawn();
        let mut marks = self.onsets();
        if self.case.holdout.is_none() && self.found.is_held_out() {
            marks.push(Layer::VerticalLine {
                x: clock.axis(signals.start_s + (1.0 - HELD_OUT) * signals.duration_s()),
                name: "unseen from here".into(),
                colour: Colour::Black,
                dashed: false,
            });
        }
        marks
    }

    /// When found physics acts.
    pub(super) fn onsets(&self) -> Vec<Layer> {
        let Shown { signals, clock, .. } = self.case.drawn();
        let at = |onset_s: f64| clock.axis(signals.start_s - signals.origin_s + onset_s);
        let mut marks = Vec::new();
        for found in &self.found.physics {
            let name = found.term.kind.name.replace('_', " ");
            for (i, (from, to)) in found.term.spans.iter().enumerate() {
                let name = if i == 0 { name.clone() } else { String::new() };
                marks.push(Layer::Span { from: at(*from), to: at(*to), name, colour: Colour::Yellow });
            }
            if found.term.onset_s > 0.0 && self.case.holdout.is_none() {
                marks.push(Layer::VerticalLine {
                    x: at(found.term.onset_s),
                    name: format!("{name} begins"),
                    colour: Colour::Purple,
                    dashed: true,
                });
            }
        }
        marks
    }

    /// The missing drive against time; what is part of the machine from the start also against what friction, springs and valves depend on.
    pub(super) fn drive(&self) -> Option<Section> {
        let missing = self.found.missing_drive.as_ref()?;
        let first = self.case.first;
        let train = &first.signals;
        let label = named("missing drive", &self.units.drive);
        let line = |name: &str, colour, x: &[f64]| first.line(name, colour, x);
        let left = self.found.drive_left.as_ref().filter(|_| self.differs());
        let mut layers = vec![estimate(&first.clock, train, missing)];
        layers.push(line("missing", Colour::Grey, &missing.value));
        if let Some(left) = left {
            let explained: Vec<f64> = missing.value.iter().zip(&left.value).map(|(a, b)| a - b).collect();
            layers.push(line("explained", Colour::Blue, &explained));
            if let Layer::Line { points, name, colour, .. } = line("left", Colour::Vermilion, &left.value) {
                layers.push(Layer::dashed(name, colour, points));
            }
        }
        let y_range = usual(&missing.value);
        let in_time = self.found.physics.iter().any(|p| p.term.onset_s > 0.0 || !p.term.spans.is_empty());
        if self.case.holdout.is_none() {
            layers.extend(self.onsets());
        }
        let time = Panel {
            x_label: self.case.first.clock.label().into(),
            x_dates: self.case.first.clock.zero_s.is_some(),
            y_label: label.clone(),
            layers,
            y_range,
            ..Panel::default()
        };
        let axis = if self.case.holdout.is_none() { TIME } else { "training time" };
        let over_time = Chart {
            figure: Figure::stacked("", vec![time]),
            caption: format!(
                "What the recorded motion needed beyond what the refitted model applied{}. The estimate itself scatters by {} \
                 (one standard deviation).",
                if left.is_some() {
                    ", what is explained of it by what was found, and what is left"
                } else {
                    ""
                },
                with_unit(plain(missing.deviation, 2), &self.units.drive)
            ),
            axis: Some(axis.into()),
        };
        if in_time {
            return Some(Section::new("The missing drive", vec![Block::Chart(over_time)]));
        }
        let (position, speed) = motion::motion(&self.found.nominal, train);
        let servo = matches!(self.found.nominal.plant, crate::plant::Plant::Servo(_));
        let (x, v) = if servo { ("position", "speed") } else { ("level of y", "rate of y") };
        let left = left.map(|l| l.value.as_slice());
        let cloud = Cloud { missing: &missing.value, left, label: &label, y_range };
        let against = [
            (&["velocity", "direction"][..], &speed, named(v, &self.units.speed)),
            (&["position", "level"], &position, named(x, &self.units.position)),
            (&["drive", "amplitude"], &train.u, named("u", &self.units.u)),
        ];
        let is_on = |names: &[&str]| self.found.depends_on.iter().any(|d| names.contains(&d.on.as_str()));
        // What it does not depend on shows a cloud that says nothing.
        let any = against.iter().any(|(names, _, _)| is_on(names));
        let panels: Vec<Panel> = against
            .into_iter()
            .filter(|(names, _, _)| !any || is_on(names))
            .map(|(_, values, label)| cloud.against(values, label))
            .collect();
        let mut caption = "Grey: the missing drive, sample by sample.".to_owned();
        if left.is_some() {
            caption += " Blue: the mean of what the found physics explains of it, with the band that holds 95 % of the samples \
                        around it.";
        }
        let every = cloud.every();
        if every > 1 {
            caption += &format!(" One sample in {every} is drawn.");
        }
        if y_range.is_some() {
            caption += " A few values lie outside the frames: at its start the estimate has yet to settle.";
        }
        let columns = panels.len().clamp(1, 2);
        let figure = Figure { panel_height_px: 300, ..Figure::grid("", columns, panels) };
        let against = Chart { figure, caption, axis: None };
        Some(Section::new("The missing drive", vec![Block::Chart(over_time), Block::Chart(against)]))
    }
}
