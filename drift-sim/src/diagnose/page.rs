//! The diagnosis as a report for people.

mod charts;

use std::path::Path;

use crate::controller::Controller;
use crate::physics::{self, Term, UnitNames};
use crate::plot::{Colour, Figure, Layer, Panel};
use crate::recording::ColumnMap;
use crate::report::{Block, Page, Proof, Section};
use crate::sentences::{self, ends, fit, number_name, percent, plain};
use crate::simulate::Trace;

use super::drive_charts::within;
use super::shown::Shown;
use super::{Diagnosis, Fits, HELD_OUT, MOST_SAMPLES, Named, Rejected, before_and_after, prove};

/// The axis that charts over the shown recording share.
const TIME: &str = "time";
/// An improvement below, in percentage points, is nothing that a reader could use.
const LEAST_POINTS: f64 = 0.01;

/// What was diagnosed, and what the page calls it.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// The recording that is shown.
    pub first: &'a Shown,
    /// Others with the same fault, pooled with it.
    pub further: &'a [Shown],
    /// The recording that proves, where there is one.
    pub holdout: Option<&'a Shown>,
    /// Recordings without the fault.
    pub healthy: &'a [Shown],
    /// The loop's file; none where nothing was stated.
    pub loop_file: Option<&'a Path>,
    /// What the recordings call their signals.
    pub columns: &'a ColumnMap,
    /// Whether the plant was identified: none of its numbers was given.
    pub is_identified: bool,
}

impl Case<'_> {
    /// The time that onsets count from.
    pub fn start_s(&self) -> f64 {
        self.first.signals.start_s - self.first.signals.origin_s
    }

    /// When a term begins, as the page says it.
    pub(super) fn begins(&self, term: &Term) -> String {
        self.since(term.spans.first().map_or(term.onset_s, |(from, _)| *from))
    }

    /// When an onset was, as the page says it.
    pub(super) fn since(&self, onset_s: f64) -> String {
        if onset_s > 0.0 {
            self.first.clock.says(self.start_s() + onset_s)
        } else {
            "before the recording".into()
        }
    }

    /// Whether a number came with the loop file.
    fn is_given(&self, number: &super::Refitted) -> bool {
        !(self.is_identified && number.is_plants())
    }

    /// The recording that is drawn.
    pub fn drawn(&self) -> &Shown {
        self.holdout.unwrap_or(self.first)
    }
}

/// The whole page; `command` is the command line.
pub fn page(found: &Diagnosis, case: &Case<'_>, command: String) -> Page {
    let writing = Writing { found, case, units: found.nominal.unit_names(), runs: Runs::of(found, case) };
    let name = case.first.name();
    let mut sections = vec![writing.physics()];
    sections.extend(before_and_after::section(found, case));
    sections.extend([writing.fits(), writing.runs()]);
    sections.extend(writing.drive());
    sections.extend([writing.parameters(), writing.rivals(), writing.untold()]);
    Page {
        title: format!("Diagnosis of {name}"),
        about: writing.about(&name),
        answer: sentences::diagnosis(found, &case.first.clock, case.start_s()),
        proof: writing.proof(),
        command,
        facts: writing.facts(),
        sections,
    }
}

/// The closed loop simulated over what is drawn, without what was found and with it.
struct Runs {
    before: Option<Trace>,
    after: Option<Trace>,
}

impl Runs {
    fn of(found: &Diagnosis, case: &Case<'_>) -> Self {
        let run = |model| prove::quiet_run(model, &case.drawn().signals);
        Self { before: run(&found.refitted), after: run(&found.improved) }
    }
}

struct Writing<'a> {
    found: &'a Diagnosis,
    case: &'a Case<'a>,
    units: UnitNames,
    runs: Runs,
}

/// What the simulation as it came is called, and with what was found.
const WITHOUT: &str = "simulated without it";
const WITH: &str = "simulated with it";
/// The same where nothing was found.
const SIMULATED: &str = "simulated";

impl Writing<'_> {
    fn about(&self, name: &str) -> String {
        let case = self.case;
        let length = format!("{name}, {} s", plain(case.first.signals.duration_s(), 4));
        match case.holdout.map(Shown::name) {
            Some(file) => format!("{length}; proved on {file}"),
            None if !self.found.is_held_out() => format!("{length}; nothing held out"),
            None => format!("{length}; proved on its last {} %", plain(100.0 * HELD_OUT, 3)),
        }
    }

    /// Whether something was found that the simulation is run with and without.
    fn differs(&self) -> bool {
        !self.found.physics.is_empty()
    }

    /// u (y where the law is not known) as measured and as simulated, and below what each leaves.
    fn proof(&self) -> Option<Proof> {
        let shown = self.case.drawn();
        let (signals, clock) = (&shown.signals, &shown.clock);
        let known_law = self.found.improved.has_law();
        let (letter, unit, measured) =
            if known_law { ("u", &self.units.u, &signals.u) } else { ("y", &self.units.y, &signals.y) };
        let of = |trace: &Trace| if known_law { trace.u.clone() } else { trace.y.clone() };
        let after = self.runs.after.as_ref().map(&of)?;
        let before = self.runs.before.as_ref().map(&of).filter(|_| self.differs());
        let line = |name: &str, colour, x: &[f64]| shown.line(name, colour, x);
        let off = |x: &[f64]| -> Vec<f64> { measured.iter().zip(x).map(|(a, b)| a - b).collect() };
        let name = if before.is_some() { WITH } else { SIMULATED };
        let mut above = vec![line("measured", Colour::Grey, measured)];
        let mut below = Vec::new();
        for (name, colour, x) in
            before.iter().map(|x| (WITHOUT, Colour::Vermilion, x)).chain([(name, Colour::Blue, &after)])
        {
            above.push(line(name, colour, x));
            below.push(line("", colour, &off(x)));
        }
        let panel = |y_label: String, layers: Vec<Layer>| Panel {
            y_label,
            layers: layers.into_iter().chain(self.onsets()).collect(),
            x_dates: clock.zero_s.is_some(),
            ..Panel::default()
        };
        let difference = format!("{letter} measured \u{2212} simulated");
        let y_range = within(&before.as_deref().map_or_else(|| off(&after), off), 1.5);
        let mut lower =
            Panel { x_label: clock.label().into(), y_range, ..panel(named(&difference, unit), below) };
        // Named above already.
        for layer in &mut lower.layers {
            if let Layer::Span { name, .. } | Layer::VerticalLine { name, .. } = layer {
                name.clear();
            }
        }
        let what = if letter == "u" { "the controller's output u" } else { "the measured y" };
        let title = format!("{letter} as measured and as simulated, and the difference");
        let outside = if y_range.is_some() { " A few spikes lie outside the frame." } else { "" };
        let caption = match &before {
            Some(_) => format!(
                "Above: {what}, measured, and simulated without and with what was found. Below: what each simulation misses. \
                 Where a model is right, only noise is left."
            ),
            None => format!(
                "Above: {what}, measured and simulated. Below: the difference. Where a model is right, only noise is left."
            ),
        };
        let caption = caption + outside;
        Some(Proof {
            figure: Figure::stacked("", vec![panel(named(letter, unit), above), lower]),
            title,
            caption,
        })
    }

    /// What stands for a loop file where there is none.
    fn loop_found(&self) -> String {
        match self.found.nominal.controller {
            Controller::Recorded => "none: u follows no law of the loop file, the plant is identified".into(),
            ref law => format!("none: u follows a {} law, the plant is identified", law.kind()),
        }
    }

    fn facts(&self) -> Vec<(String, String)> {
        let case = self.case;
        let mut facts = vec![("Recording".into(), case.first.says())];
        facts.extend(case.further.iter().map(|further| ("Pooled with it".into(), further.says())));
        facts.extend(case.healthy.iter().map(|healthy| ("Healthy".into(), healthy.says())));
        facts.push((
            "Loop".into(),
            case.loop_file.map_or_else(|| self.loop_found(), |file| file.display().to_string()),
        ));
        if self.found.not_used > 0 {
            let text =
                format!("the last {} samples: a diagnosis takes {}", self.found.not_used, MOST_SAMPLES);
            facts.push(("Not used".into(), text));
        }
        facts.push((
            "Unseen data".into(),
            match case.holdout {
                Some(holdout) => holdout.says(),
                None if !self.found.is_held_out() => "none".into(),
                None => format!("the last {} % of the recording", plain(100.0 * HELD_OUT, 3)),
            },
        ));
        facts.push(("Place".into(), self.found.place.map_or("none".into(), |p| p.name().into())));
        facts.extend(
            self.found
                .located(&case.first.clock, case.start_s())
                .into_iter()
                .map(|(name, what)| (name.to_owned(), what)),
        );
        facts
    }

    fn physics(&self) -> Section {
        let mut blocks = Vec::new();
        if self.found.physics.is_empty() {
            blocks.push(Block::Text("No physics is named.".into()));
        } else {
            let head = ["physics", "place", "number", "value, 95 % interval"];
            let rows = self.found.physics.iter().flat_map(|p| self.parameter_rows(p)).collect();
            blocks.push(Block::table(head, rows));
            let head = ["physics", "begins", "how sure on unseen data"];
            blocks
                .push(Block::table(head, self.found.physics.iter().map(|p| self.evidence_row(p)).collect()));
            blocks.push(Block::Note(
                "How sure: the gain on unseen data over its own standard error; by chance alone it is below 2.".into(),
            ));
        }
        let told = self.found.physics.iter().filter(|named| !named.may_be_nothing());
        for first in told.filter_map(Named::moved_from) {
            let says = (first.kind.says)(&first.parameters, &self.units);
            blocks.push(Block::Note(format!("When it was named, before what was found after it: {says}")));
        }
        for named in self.found.physics.iter().filter(|p| !p.term.spans.is_empty()) {
            let spans = &named.term.spans;
            blocks.push(Block::Folded {
                title: format!("{} acts {}", named.term.kind.name.replace('_', " "), times(spans.len())),
                blocks: vec![Block::table(
                    [
                        format!("from, {}", self.case.first.clock.label()),
                        format!("to, {}", self.case.first.clock.label()),
                    ],
                    spans.iter().map(|(a, b)| vec![self.cell(*a), self.cell(*b)]).collect(),
                )],
            });
        }
        if let Some(law) = &self.found.controller {
            let replayed = "The control law, replayed on the measured r and y,";
            blocks.push(Block::Note(match percent(100.0 * law.relative) {
                missed if missed == percent(0.0) => format!("{replayed} gives the recorded u."),
                missed => format!("{replayed} misses the recorded u by {missed} of its variation."),
            }));
        }
        Section::new("Missing physics", blocks)
    }

    fn parameter_rows(&self, named: &Named) -> Vec<Vec<String>> {
        let kind = named.term.kind;
        let values = kind.parameters.iter().zip(&named.term.parameters).zip(&named.half_widths);
        // What is held at nothing is no news.
        values
            .filter(|((_, value), width)| **value != 0.0 || width.is_finite())
            .map(|((parameter, value), width)| {
                let shown = sentences::parameter(*value, *width, &self.units.unit(parameter.unit));
                let nothing = width.is_finite() && parameter.may_be_neutral(*value, *width);
                vec![
                    kind.name.replace('_', " "),
                    kind.place.name().into(),
                    number_name(parameter.name),
                    match (width.is_finite() || !parameter.fitted, nothing) {
                        (false, _) => format!("{shown} (not determined, or held)"),
                        (true, true) => format!("{shown} (may be nothing)"),
                        (true, false) => shown,
                    },
                ]
            })
            .collect()
    }

    fn evidence_row(&self, named: &Named) -> Vec<String> {
        let sure = match named.holdout_errors {
            errors if errors.is_finite() => plain(errors, 3),
            _ => "not judged there".into(),
        };
        vec![named.term.kind.name.replace('_', " "), self.case.begins(&named.term), sure]
    }

    fn cell(&self, onset_s: f64) -> String {
        self.case.first.clock.cell(self.case.start_s() + onset_s)
    }

    fn fits(&self) -> Section {
        let found = self.found;
        let u = |u: Option<f64>| u.map_or_else(|| "unknown law".into(), fit);
        let rows = |part: &str, fits: &Fits| -> Vec<Vec<String>> {
            [
                ("as it came", fits.nominal),
                ("its own numbers refitted", fits.before),
                ("with what was found", fits.after.filter(|_| self.differs())),
            ]
            .into_iter()
            .filter_map(|(name, found)| {
                found.map(|f| vec![part.into(), name.into(), fit(f.y_pct), u(f.u_pct)])
            })
            .collect()
        };
        let mut all = rows("training", &found.train);
        all.extend(rows("unseen", &found.holdout));
        if let Some(floor) = found.noise_leaves() {
            all.push(vec![
                "unseen".into(),
                "what noise alone leaves".into(),
                fit(floor.y_pct),
                u(floor.u_pct),
            ]);
        }
        let mut blocks = vec![Block::table(["data", "model", "fit of y, %", "fit of u, %"], all)];
        if let Some(period) = self.found.cycle_s {
            blocks.push(Block::Text(format!(
                "The loop cycles by itself. It was simulated anew every {} s, its period, because a phase drifts away however good the model is.",
                plain(period, 4)
            )));
        }
        if let Some([low, high]) = found.improvement.filter(|[low, high]| *low > 0.0 && *high >= LEAST_POINTS)
        {
            blocks.push(Block::Text(format!(
                "On unseen data what was found improves the fit by {} percentage points (95 % interval).",
                ends(low, high)
            )));
        }
        blocks.push(Block::Note(
            "The loop is simulated from r alone (from the recorded u where the law is unknown). 100 % means that every sample is \
             met, 0 % that it is no better than the mean."
                .into(),
        ));
        Section::new("How well the simulated loop fits", blocks)
    }

    fn parameters(&self) -> Section {
        let row = |p: &super::Refitted| {
            // A change that its interval does not carry is none.
            let same = (p.value - p.nominal).abs() <= p.half_width || p.half_width.is_nan();
            let change = if same { "none".into() } else { percent(100.0 * (p.value / p.nominal - 1.0)) };
            let given = self.case.is_given(p);
            vec![
                p.name.clone(),
                if given { plain(p.nominal, 4) } else { "identified".into() },
                sentences::measured(p.value, p.half_width, ""),
                if given { change } else { String::new() },
            ]
        };
        let head = ["number", "as given", "fitted, 95 % interval", "change"];
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
                let smallest = r
                    .smallest
                    .as_ref()
                    .map_or_else(|| "not known".into(), |term| sentences::sizes(term, &self.units));
                vec![r.kind.replace('_', " "), r.why.clone(), smallest]
            };
            let head = ["physics", "why not", "would have shown from about"];
            Block::table(head, self.found.rejected.iter().map(row).collect())
        };
        Section::new("Rivals, and why they lost", vec![block])
    }

    /// What this recording can't tell, and what would.
    fn untold(&self) -> Section {
        let mut blocks = Vec::new();
        let ties: Vec<Vec<String>> = self
            .found
            .physics
            .iter()
            .filter(|p| !p.tied.is_empty())
            .map(|p| {
                vec![
                    p.term.kind.name.replace('_', " "),
                    p.tied.join(", ").replace('_', " "),
                    p.term.kind.experiment.into(),
                ]
            })
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
            .map(|kind| vec![kind.name.replace('_', " "), kind.excitation.into()])
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

fn rejected_rows(of: &[Rejected]) -> Vec<Vec<String>> {
    of.iter().map(|r| vec![r.kind.replace('_', " "), r.why.clone()]).collect()
}

/// An axis' name with its unit.
pub(super) fn named(what: &str, unit: &str) -> String {
    if unit.is_empty() { what.to_owned() } else { format!("{what} / {}", sentences::simple_unit(unit)) }
}

fn times(count: usize) -> String {
    if count == 1 { "once".into() } else { format!("{count} times") }
}
