//! The diagnosis as a report for people.

use std::path::Path;

use crate::physics::{self, Place, UnitNames, digits, significant};
use crate::plot::{Colour, Figure, Layer, Panel};
use crate::recording::ColumnMap;
use crate::report::{Block, Chart, Page, Section, number};
use crate::simulate::Trace;

use super::drive_charts::{Cloud, estimate, usual};
use super::signals::Signals;
use super::{Diagnosis, Fits, HELD_OUT, MOST_SAMPLES, Named, Rejected, Verdict, features, prove};

/// The axis that charts over the shown recording share.
const TIME: &str = "time";

/// What was diagnosed, and what the page calls it.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// The recording that the numbers come from.
    pub train: &'a Signals,
    /// The second recording, where there is one.
    pub holdout: Option<&'a Signals>,
    /// The recording's file.
    pub recording: &'a Path,
    /// The loop's file.
    pub loop_file: &'a Path,
    /// The second recording's file.
    pub holdout_file: Option<&'a Path>,
    /// What the recordings call their signals.
    pub columns: &'a ColumnMap,
}

/// The whole page; `command` is the command line.
pub fn page(found: &Diagnosis, case: &Case<'_>, command: String) -> Page {
    let writing = Writing { found, case, units: found.nominal.unit_names() };
    let name = case.recording.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut sections = vec![writing.physics(), writing.fits(), writing.runs()];
    sections.extend(writing.drive());
    sections.extend([writing.parameters(), writing.rivals(), writing.untold()]);
    Page {
        title: format!("Diagnosis of {name}"),
        verdict: writing.verdict(),
        command,
        facts: writing.facts(),
        sections,
    }
}

struct Writing<'a> {
    found: &'a Diagnosis,
    case: &'a Case<'a>,
    units: UnitNames,
}

impl Writing<'_> {
    fn verdict(&self) -> String {
        let found = self.found;
        let (data, fits) = match found.holdout.after {
            Some(_) => ("On unseen data", found.holdout),
            None => ("Over the recording, nothing being held out,", found.train),
        };
        let gain = match (fits.before, fits.after) {
            (Some(a), Some(b)) => match (a.u_pct, b.u_pct) {
                (Some(a), Some(b)) => format!(" {data} the fit of u goes from {a:.1} % to {b:.1} %."),
                _ => format!(" {data} the fit of y goes from {:.1} % to {:.1} %.", a.y_pct, b.y_pct),
            },
            _ => String::new(),
        };
        match found.verdict {
            Verdict::NoMismatch | Verdict::Parameters if found.far_off => {
                "Nothing can be said: the plant that could be identified does not follow y where it has not seen it.".into()
            }
            Verdict::Undecided => {
                "This recording can't tell: too little moves in it, or too much is unknown, to prove or to exclude anything.".into()
            }
            Verdict::NoMismatch => {
                "The model explains the recording; nothing is missing that it could show.".into()
            }
            Verdict::Parameters => {
                format!("The model is right, its numbers are not: refitted, it explains the recording.{gain}")
            }
            Verdict::Located => format!(
                "Something is missing at the {}, but this recording can't tell what.",
                found.place.map_or("loop", Place::name)
            ),
            Verdict::MissingPhysics => {
                let rest = if found.far_off {
                    " More is missing: the loop stays far from what was measured."
                } else {
                    ""
                };
                found.physics.iter().map(|p| p.term.says(&self.units)).collect::<Vec<_>>().join(" ")
                    + &gain
                    + rest
            }
        }
    }

    fn facts(&self) -> Vec<(String, String)> {
        let length =
            |signals: &Signals| format!("{} samples at {} s", signals.len(), number(signals.sample_time_s));
        let case = self.case;
        let mut facts = vec![
            ("Recording".into(), format!("{}, {}", case.recording.display(), length(case.train))),
            ("Loop".into(), case.loop_file.display().to_string()),
        ];
        if self.found.not_used > 0 {
            let text =
                format!("the last {} samples: a diagnosis takes {}", self.found.not_used, MOST_SAMPLES);
            facts.push(("Not used".into(), text));
        }
        facts.push((
            "Unseen data".into(),
            match (case.holdout, case.holdout_file) {
                (Some(signals), Some(file)) => format!("{}, {}", file.display(), length(signals)),
                _ => format!("the last {} % of the recording", number(100.0 * HELD_OUT)),
            },
        ));
        facts.push(("Place".into(), self.found.place.map_or("none".into(), |p| p.name().into())));
        facts.extend(self.found.located().into_iter().map(|(name, what)| (name.to_owned(), what)));
        facts
    }

    fn physics(&self) -> Section {
        let mut blocks = Vec::new();
        if self.found.physics.is_empty() {
            blocks.push(Block::Text("No physics is named.".into()));
        } else {
            let head = ["physics", "place", "parameter", "value", "unit", "95 % interval"];
            let rows = self.found.physics.iter().flat_map(|p| self.parameter_rows(p)).collect();
            blocks.push(Block::table(head, rows));
            let head = [
                "physics",
                "begins",
                "gain on unseen data, standard errors",
                "cost-corrected gain (delta BIC)",
            ];
            blocks.push(Block::table(head, self.found.physics.iter().map(evidence_row).collect()));
        }
        for first in self.found.physics.iter().filter_map(Named::moved_from) {
            let says = (first.kind.says)(&first.parameters, &self.units);
            blocks.push(Block::Note(format!("When it was named, before the terms after it: {says}")));
        }
        for named in self.found.physics.iter().filter(|p| !p.term.spans.is_empty()) {
            let spans = &named.term.spans;
            blocks.push(Block::Folded {
                title: format!("{} acts {} times", named.term.kind.name, spans.len()),
                blocks: vec![Block::table(
                    ["from / s", "to / s"],
                    spans.iter().map(|(a, b)| vec![number(*a), number(*b)]).collect(),
                )],
            });
        }
        if let Some(law) = &self.found.controller {
            blocks.push(Block::Note(format!(
                "The stated control law, replayed on the measured signals, differs from the recorded u by {} % of its variation.",
                number(100.0 * law.relative)
            )));
        }
        Section::new("Missing physics", blocks)
    }

    fn parameter_rows(&self, named: &Named) -> Vec<Vec<String>> {
        let kind = named.term.kind;
        let values = kind.parameters.iter().zip(&named.term.parameters).zip(&named.half_widths);
        values
            .map(|((parameter, value), width)| {
                vec![
                    kind.name.replace('_', " "),
                    kind.place.name().into(),
                    parameter.name.replace('_', " "),
                    significant(*value, digits(*value, *width)),
                    self.units.unit(parameter.unit),
                    around(*value, *width, "not determined, or held"),
                ]
            })
            .collect()
    }

    fn fits(&self) -> Section {
        let found = self.found;
        let percent = |x: f64| format!("{x:.3}");
        let u = |u: Option<f64>| u.map_or_else(|| "unknown law".into(), percent);
        let rows = |part: &str, fits: &Fits| -> Vec<Vec<String>> {
            [
                ("as it came", fits.nominal),
                ("before: its own numbers refitted", fits.before),
                ("after: improved", fits.after),
            ]
            .into_iter()
            .filter_map(|(name, fit)| {
                fit.map(|f| vec![part.into(), name.into(), percent(f.y_pct), u(f.u_pct)])
            })
            .collect()
        };
        let mut all = rows("training", &found.train);
        all.extend(rows("unseen", &found.holdout));
        if let Some(floor) = found.noise_floor {
            all.push(vec![
                "unseen".into(),
                "what noise alone leaves".into(),
                percent(floor.y_pct),
                u(floor.u_pct),
            ]);
        }
        let mut blocks = vec![Block::table(["data", "model", "fit of y, %", "fit of u, %"], all)];
        if let Some(period) = self.found.cycle_s {
            blocks.push(Block::Text(format!(
                "The loop cycles by itself: it was simulated anew every {} s, its period, for a phase drifts away however good the model.",
                number(period)
            )));
        }
        if let Some([low, high]) = found.improvement {
            blocks.push(Block::Text(format!(
                "On unseen data the physics improves the fit by {low:.2} to {high:.2} points (95 %)."
            )));
        }
        blocks.push(Block::Note(
            "Closed-loop simulation from r alone (from the recorded u where the law is unknown); 100 % is every sample met, 0 % \
             is no better than the mean."
                .into(),
        ));
        Section::new("How well the simulated loop fits", blocks)
    }

    /// r, y and u of the closed loop, measured and simulated.
    fn runs(&self) -> Section {
        let signals = self.case.holdout.unwrap_or(self.case.train);
        let [r, y, u] = self.case.columns.labels();
        let runs = [
            ("before", Colour::Vermilion, prove::run(&self.found.refitted, signals, 0)),
            ("after", Colour::Blue, prove::run(&self.found.improved, signals, 0)),
        ];
        let line = |name: String, colour, x: &[f64]| {
            Layer::signal(name, colour, signals.start_s, signals.sample_time_s, x)
        };
        let simulated = |of: &dyn Fn(&Trace) -> Vec<f64>| -> Vec<Layer> {
            let drawn = runs.iter().filter_map(|(name, colour, run)| Some((name, *colour, run.as_ref()?)));
            drawn
                .map(|(name, colour, run)| match line((*name).into(), colour, &of(run)) {
                    Layer::Line { points, name, colour, .. } if colour == Colour::Vermilion => {
                        Layer::dashed(name, colour, points)
                    }
                    line => line,
                })
                .collect()
        };
        let error = |t: &Trace| -> Vec<f64> { signals.y.iter().zip(&t.y).map(|(a, b)| a - b).collect() };
        let panel = |what: &str, unit: &str, layers: Vec<Layer>| Panel {
            y_label: with_unit(what, unit),
            layers: layers.into_iter().chain(self.marks()).collect(),
            ..Panel::default()
        };
        let mut outputs = vec![
            line(r, Colour::Green, &signals.r),
            line(format!("{y}, measured"), Colour::Grey, &signals.y),
        ];
        outputs.extend(simulated(&|t| t.y.clone()));
        let control: Vec<f64> = signals.r.iter().zip(&signals.y).map(|(r, y)| r - y).collect();
        let mut controls = vec![line("measured".into(), Colour::Grey, &control)];
        controls.extend(simulated(&|t| signals.r.iter().zip(&t.y).map(|(r, y)| r - y).collect()));
        let mut efforts = vec![line(format!("{u}, measured"), Colour::Grey, &signals.u)];
        efforts.extend(simulated(&|t| t.u.clone()));
        let y_unit = &self.units.y;
        let panels = vec![
            panel("r, y", y_unit, outputs),
            panel("e = r \u{2212} y", y_unit, controls),
            panel("y \u{2212} \u{177}", y_unit, simulated(&error)),
            Panel { x_label: "t / s".into(), ..panel("u", &self.units.u, efforts) },
        ];
        let caption = match self.case.holdout {
            Some(_) => "The second recording, which no number was fitted on.",
            None => "The upright line: from there on nothing was fitted.",
        };
        let caption = format!(
            "{caption} Before: the model with its own numbers refitted; after: with what was found. \u{177}: y as simulated."
        );
        let mut blocks = vec![Block::Chart(Chart {
            figure: Figure::stacked("", panels),
            caption,
            axis: Some(TIME.into()),
        })];
        for (name, ..) in runs.iter().filter(|(.., run)| run.is_none()) {
            blocks.push(Block::Note(format!(
                "The model {name} can't be drawn: it diverges over this recording."
            )));
        }
        Section::new("Measured and simulated", blocks)
    }

    /// When found physics acts, and where the unseen part begins.
    fn marks(&self) -> Vec<Layer> {
        let signals = self.case.holdout.unwrap_or(self.case.train);
        let start_s = signals.start_s - signals.origin_s;
        let mut marks = Vec::new();
        for named in &self.found.physics {
            let name = named.term.kind.name.replace('_', " ");
            for (i, (from, to)) in named.term.spans.iter().enumerate() {
                let name = if i == 0 { name.clone() } else { String::new() };
                marks.push(Layer::Span {
                    from: start_s + from,
                    to: start_s + to,
                    name,
                    colour: Colour::Yellow,
                });
            }
            if named.term.onset_s > 0.0 && self.case.holdout.is_none() {
                marks.push(Layer::VerticalLine {
                    x: start_s + named.term.onset_s,
                    name: format!("{name} begins"),
                    colour: Colour::Purple,
                    dashed: true,
                });
            }
        }
        if self.case.holdout.is_none() {
            let x = signals.start_s + (1.0 - HELD_OUT) * signals.duration_s();
            marks.push(Layer::VerticalLine {
                x,
                name: "unseen from here".into(),
                colour: Colour::Black,
                dashed: false,
            });
        }
        marks
    }

    /// The missing drive against time, and against what friction, springs and valves depend on.
    fn drive(&self) -> Option<Section> {
        let missing = self.found.missing_drive.as_ref()?;
        let train = self.case.train;
        let label = with_unit("missing drive", &self.units.drive);
        let line = |name: &str, colour, x: &[f64]| {
            Layer::signal(name, colour, train.start_s, train.sample_time_s, x)
        };
        let left = self.found.drive_left.as_ref();
        let mut layers = vec![estimate(train, missing)];
        layers.push(line("before", Colour::Grey, &missing.value));
        if let Some(left) = left {
            let explained: Vec<f64> = missing.value.iter().zip(&left.value).map(|(a, b)| a - b).collect();
            layers.push(line("explained", Colour::Blue, &explained));
            if let Layer::Line { points, name, colour, .. } =
                line("left after", Colour::Vermilion, &left.value)
            {
                layers.push(Layer::dashed(name, colour, points));
            }
        }
        let y_range = usual(&missing.value);
        let time =
            Panel { x_label: "t / s".into(), y_label: label.clone(), layers, y_range, ..Panel::default() };
        let axis = if self.case.holdout.is_none() { TIME } else { "training time" };
        let over_time = Chart {
            figure: Figure::stacked("", vec![time]),
            caption: format!(
                "What the recorded motion needed beyond what the refitted model applied, and what the found physics explains of it. \
                 Standard deviation of the estimate: {} {}.",
                number(missing.deviation),
                self.units.drive
            ),
            axis: Some(axis.into()),
        };
        let (position, speed) = features::motion(&self.found.nominal, train);
        let servo = matches!(self.found.nominal.plant, crate::plant::Plant::Servo(_));
        let (x, v) = if servo { ("position", "speed") } else { ("level of y", "rate of y") };
        let left = left.map(|l| l.value.as_slice());
        let cloud = Cloud { missing: &missing.value, left, label: &label, y_range };
        let panels = vec![
            cloud.against(&speed, with_unit(v, &self.units.speed)),
            cloud.against(&position, with_unit(x, &self.units.position)),
            cloud.against(&train.u, with_unit("u", &self.units.u)),
        ];
        let mut caption = "Grey: the missing drive, sample by sample. Blue: the mean of what the found physics explains of it, \
                           with the band that holds 95 % of the samples around it."
            .to_owned();
        let every = cloud.every();
        if every > 1 {
            caption += &format!(" One sample in {every} is drawn.");
        }
        if y_range.is_some() {
            caption += " A few values lie outside the frames: at its start the estimate has yet to settle.";
        }
        let figure = Figure { panel_height_px: 300, ..Figure::grid("", 2, panels) };
        let against = Chart { figure, caption, axis: None };
        Some(Section::new("The missing drive", vec![Block::Chart(over_time), Block::Chart(against)]))
    }

    fn parameters(&self) -> Section {
        let row = |p: &super::Refitted| {
            let share = 100.0 * (p.value / p.nominal - 1.0);
            vec![
                p.name.clone(),
                number(p.nominal),
                significant(p.value, digits(p.value, p.half_width)),
                around(p.value, p.half_width, "not determined"),
                number(share),
            ]
        };
        let head = ["parameter", "as given", "fitted", "95 % interval", "change, %"];
        let rows: Vec<_> = self.found.parameters.iter().map(row).collect();
        let block =
            if rows.is_empty() { Block::Text("None was fitted.".into()) } else { Block::table(head, rows) };
        Section::new("The model's own numbers", vec![block])
    }

    fn rivals(&self) -> Section {
        let block = if self.found.rejected.is_empty() {
            Block::Text("No rival was tried.".into())
        } else {
            let row = |r: &Rejected| {
                let smallest = r.smallest.as_ref().map_or("-".into(), |term| self.sizes(term));
                vec![r.kind.replace('_', " "), r.why.clone(), smallest]
            };
            let head = ["physics", "why not", "would have shown from about"];
            Block::table(head, self.found.rejected.iter().map(row).collect())
        };
        Section::new("Rivals, and why they lost", vec![block])
    }

    /// The numbers of a term in words.
    fn sizes(&self, term: &physics::Term) -> String {
        let parameters = term.kind.parameters.iter().zip(&term.parameters);
        let words = parameters.map(|(p, value)| {
            format!("{} {}", p.name.replace('_', " "), physics::shown(*value, &self.units.unit(p.unit)))
        });
        words.collect::<Vec<_>>().join(", ")
    }

    /// What this recording can't tell, and what would.
    fn untold(&self) -> Section {
        let mut blocks = Vec::new();
        let ties: Vec<Vec<String>> = self
            .found
            .physics
            .iter()
            .filter(|p| !p.tied.is_empty())
            .map(|p| vec![p.term.kind.name.into(), p.tied.join(", "), p.term.kind.experiment.into()])
            .collect();
        if ties.is_empty() {
            blocks.push(Block::Text("No rival is tied with what was named.".into()));
        } else {
            blocks.push(Block::table(["named", "can't be told from", "the experiment to run"], ties));
        }
        let untestable = &self.found.untestable;
        if !untestable.is_empty() {
            blocks.push(Block::Text("Not tested:".into()));
            blocks.push(Block::table(["physics", "why"], rejected_rows(untestable)));
        }
        let kinds = self.found.rejected.iter().chain(untestable);
        let needs: Vec<Vec<String>> = kinds
            .filter_map(|r| physics::Kind::named(r.kind).ok())
            .map(|kind| vec![kind.name.into(), kind.excitation.into()])
            .collect();
        if !needs.is_empty() {
            blocks.push(Block::Folded {
                title: "What a recording needs to show each".into(),
                blocks: vec![Block::table(["physics", "needs"], needs)],
            });
        }
        Section::new("What can't be told", blocks)
    }
}

fn evidence_row(named: &Named) -> Vec<String> {
    let onset = named.term.onset_s;
    vec![
        named.term.kind.name.replace('_', " "),
        if onset > 0.0 { format!("{} s", number(onset)) } else { "before the recording".into() },
        number(named.holdout_errors),
        number(2.0 * named.train_gain),
    ]
}

fn rejected_rows(of: &[Rejected]) -> Vec<Vec<String>> {
    of.iter().map(|r| vec![r.kind.replace('_', " "), r.why.clone()]).collect()
}

fn with_unit(what: &str, unit: &str) -> String {
    if unit.is_empty() { what.to_owned() } else { format!("{what} / {unit}") }
}

fn around(value: f64, half_width: f64, unknown: &str) -> String {
    if half_width.is_finite() {
        let end = |end: f64| significant(end, digits(value, half_width));
        format!("{} to {}", end(value - half_width), end(value + half_width))
    } else {
        unknown.to_owned()
    }
}
