//! A panel's title and legend, in rows over it: there they cover no data.

use super::canvas::{Align, Canvas, Stroke, text_width};
use super::draw::LINE_PX;
use super::layout::{LABEL_PX, PANEL_TITLE_PX, Place, strip_y};
use super::{Colour, Layer, LegendPosition, Marker, Panel};
use crate::Result;

const SAMPLE_PX: f64 = 22.0;
const GAP_PX: f64 = 6.0;
const BETWEEN_PX: f64 = 18.0;

/// An entry's row from the top and its left edge relative to the panel's.
struct Entry<'a> {
    strip: usize,
    x: f64,
    name: &'a str,
    layer: &'a Layer,
}

/// Rows that title and legend of a panel take, for one of this width.
pub(super) fn strips(panel: &Panel, width: f64) -> usize {
    let entries = entries(panel, width);
    let of_legend = entries.iter().map(|e| e.strip + 1).max().unwrap_or(0);
    of_legend.max(usize::from(!panel.title.is_empty()))
}

/// The entries from left to right after the title, in as many rows as it takes.
fn entries(panel: &Panel, width: f64) -> Vec<Entry<'_>> {
    if panel.legend == LegendPosition::Hidden {
        return Vec::new();
    }
    let title = if panel.title.is_empty() {
        0.0
    } else {
        1.1 * text_width(&panel.title, PANEL_TITLE_PX) + BETWEEN_PX
    };
    let (mut x, mut strip) = (title, 0);
    let mut entries: Vec<Entry> = Vec::new();
    for layer in &panel.layers {
        let name = layer.name();
        // A name that several layers share stands once.
        if name.is_empty() || entries.iter().any(|e| e.name == name && look(e.layer) == look(layer)) {
            continue;
        }
        let wide = SAMPLE_PX + GAP_PX + text_width(name, LABEL_PX);
        if x > 0.0 && x + wide > width {
            (x, strip) = (0.0, strip + 1);
        }
        entries.push(Entry { strip, x, name, layer });
        x += wide + BETWEEN_PX;
    }
    entries
}

pub(super) fn draw(canvas: &Canvas, panel: &Panel, place: &Place) -> Result<()> {
    let frame = place.frame;
    let used = strips(panel, frame.width);
    // Short legends stand right over the panel, where neighbours in the row have longer ones.
    let first = place.strips.saturating_sub(used);
    if !panel.title.is_empty() {
        let at = (frame.left, strip_y(place, first));
        canvas.text(&panel.title, at, PANEL_TITLE_PX, Align::Left, true)?;
    }
    for entry in entries(panel, frame.width) {
        let (x, y) = (frame.left + entry.x, strip_y(place, first + entry.strip));
        sample(canvas, entry.layer, x, y)?;
        canvas.text(entry.name, (x + SAMPLE_PX + GAP_PX, y), LABEL_PX, Align::Left, false)?;
    }
    Ok(())
}

/// A small piece of what the layer looks like.
fn sample(canvas: &Canvas, layer: &Layer, x: f64, y: f64) -> Result<()> {
    let (colour, dashed) = look(layer);
    match layer {
        Layer::Line { .. } | Layer::HorizontalLine { .. } | Layer::VerticalLine { .. } => {
            let stroke = Stroke { colour, opacity: 1.0, width_px: 1.4 * LINE_PX, dashed };
            canvas.line(&[(x, y), (x + SAMPLE_PX, y)], stroke)
        }
        Layer::Points { marker, .. } => {
            super::draw::marker(canvas, *marker, (x + 0.5 * SAMPLE_PX, y), colour)
        }
        Layer::Band { .. } => canvas.rectangle((x, y - 5.0), (x + SAMPLE_PX, y + 5.0), colour, 0.3),
        Layer::Span { .. } => canvas.rectangle((x, y - 5.0), (x + SAMPLE_PX, y + 5.0), colour, 0.2),
        Layer::Bars { .. } => canvas.rectangle((x + 4.0, y - 5.0), (x + SAMPLE_PX, y + 5.0), colour, 0.85),
    }
}

/// What tells layers apart besides their shape.
fn look(layer: &Layer) -> (Colour, bool) {
    match layer {
        Layer::Line { colour, dashed, .. }
        | Layer::HorizontalLine { colour, dashed, .. }
        | Layer::VerticalLine { colour, dashed, .. } => (*colour, *dashed),
        Layer::Points { colour, marker, .. } => (*colour, *marker == Marker::Cross),
        Layer::Band { colour, .. } | Layer::Bars { colour, .. } | Layer::Span { colour, .. } => {
            (*colour, false)
        }
    }
}
