//! What changed since the loop was healthy, as a page shows it: both recordings side by side on the same axes, with the healthy loop simulated over each;
//! what changed and from when on; what did not, and how much of it would have shown.

use crate::control_loop::Loop;
use crate::physics::UnitNames;
use crate::plot::{Colour, Figure, Layer, Panel};
use crate::report::{Block, Chart, Section};
use crate::sentences;
use crate::simulate::Trace;

use super::page::{Case, named};
use super::shown::Shown;
use super::{Diagnosis, prove};
use crate::estimate::signals::Signals;

/// The section; none without a healthy recording.
pub(super) fn section(found: &Diagnosis, case: &Case<'_>) -> Option<Section> {
    let then = case.healthy.first()?;
    let blocks = vec![side_by_side(found, then, case), changed(found, case), unchanged(found)];
    Some(Section::new("Before and after", blocks))
}

/// One recording beside the healthy loop.
struct Side<'a> {
    title: String,
    shown: &'a Shown,
    simulated: Option<Trace>,
}

/// One row of panels: a label, and what of a recording and its simulation is drawn.
type Row<'a> = (String, Box<dyn Fn(&Side<'_>) -> Vec<Layer> + 'a>);

/// r and y, u, and what the healthy loop misses of u (of y, where the law is unknown); the healthy recording to the left, the one that is diagnosed to the right.
fn side_by_side(found: &Diagnosis, then: &Shown, case: &Case<'_>) -> Block {
    let healthy = as_it_was(found);
    let side = |when: &str, shown| Side {
        title: format!("{when}: {}", Shown::name(shown)),
        shown,
        simulated: prove::quiet_run(&healthy, &shown.signals),
    };
    let sides = [side("before", then), side("after", case.first)];
    let is_open = !healthy.has_law();
    let rows = rows(&found.nominal.unit_names(), is_open);
    let last = rows.len() - 1;
    let panels = rows.iter().enumerate().flat_map(|(i, (y_label, layers))| {
        let mut row = sides.each_ref().map(|side| Panel {
            title: if i == 0 { side.title.clone() } else { String::new() },
            x_label: if i == last { side.shown.clock.label().into() } else { String::new() },
            y_label: y_label.clone(),
            layers: layers(side),
            x_dates: side.shown.clock.zero_s.is_some(),
            ..Panel::default()
        });
        on_one_scale(&mut row);
        row
    });
    let figure = Figure { panel_height_px: 220, ..Figure::grid("", 2, panels.collect()) };
    let caption = format!(
        "Grey: measured. Blue: the loop simulated as it was when it was healthy. Lowest: what that misses of {}. What is larger, or \
         has another shape, on the right has changed.",
        if is_open { "y" } else { "u" }
    );
    Block::Chart(Chart { figure, caption, axis: None })
}

/// The loop without what was found.
fn as_it_was(found: &Diagnosis) -> Loop {
    let mut healthy = found.improved.clone();
    healthy.physics.retain(|term| !found.physics.iter().any(|named| named.term.kind == term.kind));
    Loop { controller: found.nominal.controller.clone(), ..healthy }
}

fn rows<'a>(units: &UnitNames, is_open: bool) -> [Row<'a>; 3] {
    let outputs = |side: &Side<'_>| {
        let Signals { r, y, .. } = &side.shown.signals;
        let mut layers =
            vec![side.shown.line("r", Colour::Green, r), side.shown.line("measured", Colour::Grey, y)];
        layers.extend(side.simulated.iter().map(|run| side.shown.line(HEALTHY, Colour::Blue, &run.y)));
        layers
    };
    let efforts = |side: &Side<'_>| {
        let mut layers = vec![side.shown.line("", Colour::Grey, &side.shown.signals.u)];
        layers.extend(side.simulated.iter().map(|run| side.shown.line("", Colour::Blue, &run.u)));
        layers
    };
    let missed = move |side: &Side<'_>| {
        let of = |run: &Trace| {
            let Signals { y, u, .. } = &side.shown.signals;
            let (measured, simulated) = if is_open { (y, &run.y) } else { (u, &run.u) };
            let missed: Vec<f64> = measured.iter().zip(simulated).map(|(a, b)| a - b).collect();
            side.shown.line("", Colour::Grey, &missed)
        };
        side.simulated.iter().map(of).collect()
    };
    let (letter, unit) = if is_open { ("y", &units.y) } else { ("u", &units.u) };
    [
        (named("r and y", &units.y), Box::new(outputs)),
        (named("u", &units.u), Box::new(efforts)),
        (named(&format!("{letter} \u{2212} simulated"), unit), Box::new(missed)),
    ]
}

/// What the simulation of the healthy loop is called.
const HEALTHY: &str = "simulated as it was";
/// Part of the range that is left free above and below.
const MARGIN: f64 = 0.05;

/// The same range of y for all panels: sizes compare at a glance.
fn on_one_scale(panels: &mut [Panel]) {
    let measured = panels.iter().flat_map(|panel| &panel.layers).filter_map(|layer| match layer {
        Layer::Line { points, colour: Colour::Grey | Colour::Green, .. } => Some(points),
        _ => None,
    });
    let values = measured.flatten().map(|(_, y)| *y).filter(|y| y.is_finite());
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
    let margin = MARGIN * (high - low);
    if margin > 0.0 {
        panels.iter_mut().for_each(|panel| panel.y_range = Some((low - margin, high + margin)));
    }
}

/// What changed, in whole sentences, and from when on.
fn changed(found: &Diagnosis, case: &Case<'_>) -> Block {
    let told: Vec<_> = found.physics.iter().filter(|named| !named.may_be_nothing()).collect();
    if told.is_empty() {
        return Block::Text("No change is shown.".into());
    }
    let rows = told.iter().map(|named| {
        let what = named.term.kind.name.replace('_', " ");
        vec![what, sentences::says(named, found), case.begins(&named.term)]
    });
    Block::table(["what changed", "how", "since"], rows.collect())
}

/// What did not change, with the size from which on it would have shown.
fn unchanged(found: &Diagnosis) -> Block {
    let units = found.nominal.unit_names();
    let shown =
        found.rejected.iter().filter_map(|rejected| Some((rejected.kind, rejected.smallest.as_ref()?)));
    let rows: Vec<Vec<String>> =
        shown.map(|(kind, term)| vec![kind.replace('_', " "), sentences::sizes(term, &units)]).collect();
    if rows.is_empty() {
        return Block::Text("Of nothing else it is known from which size on it would have shown.".into());
    }
    Block::Folded {
        title: format!("What did not change ({} kinds of physics)", rows.len()),
        blocks: vec![Block::table(["no change of", "would have shown from about"], rows)],
    }
}
