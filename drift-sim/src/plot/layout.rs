//! Where things stand on the sheet, px.

use super::canvas::text_width;
use super::{Figure, Panel};

/// Font sizes, px.
pub(super) const TITLE_PX: f64 = 17.0;
pub(super) const PANEL_TITLE_PX: f64 = 14.0;
pub(super) const LABEL_PX: f64 = 13.0;
pub(super) const TICK_PX: f64 = 12.0;

const MARGIN: f64 = 16.0;
const TITLE_HEIGHT: f64 = 34.0;
const STRIP_HEIGHT: f64 = 20.0;
const TICKS_HEIGHT: f64 = 22.0;
const LABEL_HEIGHT: f64 = 20.0;
const BETWEEN: f64 = 12.0;
/// The last x number reaches half its width beyond the axis.
const RIGHT_ROOM: f64 = 18.0;
const SMALLEST: f64 = 40.0;

/// A rectangle: its left and upper edge, width and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Frame {
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }
}

/// One panel's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Inside of the axes.
    pub frame: Frame,
    /// Rows above it that title and legend take.
    pub strips: usize,
    /// Whether numbers and label of the x axis are written.
    pub x_axis: bool,
    /// The middle of the y label.
    pub y_label_x: f64,
}

/// The whole sheet's size and each panel's place. `strips` is how many rows each panel's title and legend take,
/// `y_ticks` the width of its widest y number.
pub(super) struct Sheet {
    pub width: f64,
    pub height: f64,
    pub places: Vec<Place>,
}

/// Width between the axes of the panels of one column.
pub(super) fn frame_width(figure: &Figure, y_ticks: &[f64], column: usize) -> f64 {
    (column_width(figure) - left_room(figure, y_ticks, column) - RIGHT_ROOM).max(SMALLEST)
}

/// Width of one column of panels with its labels.
fn column_width(figure: &Figure) -> f64 {
    (f64::from(figure.width_px) - 2.0 * MARGIN) / figure.columns.max(1) as f64
}

pub(super) fn arrange(figure: &Figure, strips: &[usize], y_ticks: &[f64]) -> Sheet {
    let columns = figure.columns.max(1);
    let column_width = column_width(figure);
    let title = if figure.title.is_empty() { 0.0 } else { TITLE_HEIGHT };
    let mut top = MARGIN + title;
    let mut places = Vec::with_capacity(figure.panels.len());
    let rows = figure.panels.len().div_ceil(columns);
    for row in 0..rows {
        let from = row * columns;
        let to = (from + columns).min(figure.panels.len());
        let most_strips = strips.get(from..to).and_then(|s| s.iter().max()).copied().unwrap_or(0);
        let mut lowest: f64 = top;
        for index in from..to {
            let Some(panel) = figure.panels.get(index) else { continue };
            let column = index - from;
            let left_edge = MARGIN + column as f64 * column_width;
            let left = left_edge + left_room(figure, y_ticks, column);
            let x_axis = !figure.shared_x || index + columns >= figure.panels.len();
            let frame_top = top + most_strips as f64 * STRIP_HEIGHT + 6.0;
            let height =
                (f64::from(figure.panel_height_px) - most_strips as f64 * STRIP_HEIGHT).max(SMALLEST);
            let width = frame_width(figure, y_ticks, column);
            let frame = Frame { left, top: frame_top, width, height };
            lowest = lowest.max(frame.bottom() + below(panel, x_axis));
            places.push(Place { frame, strips: most_strips, x_axis, y_label_x: left_edge + 8.0 });
        }
        top = lowest + BETWEEN;
    }
    Sheet { width: f64::from(figure.width_px), height: libm::ceil(top - BETWEEN + MARGIN), places }
}

/// All panels of a column begin at one place.
fn left_room(figure: &Figure, y_ticks: &[f64], column: usize) -> f64 {
    let columns = figure.columns.max(1);
    let of_column = || figure.panels.iter().zip(y_ticks).skip(column).step_by(columns);
    let ticks = of_column().map(|(_, width)| *width).fold(0.0, f64::max);
    let label = if of_column().any(|(panel, _)| !panel.y_label.is_empty()) { 24.0 } else { 4.0 };
    label + ticks + 8.0
}

fn below(panel: &Panel, x_axis: bool) -> f64 {
    match (x_axis, panel.x_label.is_empty()) {
        (false, _) => 0.0,
        (true, true) => TICKS_HEIGHT,
        (true, false) => TICKS_HEIGHT + LABEL_HEIGHT,
    }
}

/// The middle of one of the rows above a panel, counted from the top.
pub(super) fn strip_y(place: &Place, strip: usize) -> f64 {
    place.frame.top - 6.0 - (place.strips.saturating_sub(strip) as f64 - 0.5) * STRIP_HEIGHT
}

/// The middle of the figure's title.
pub(super) fn title_at(figure: &Figure) -> (f64, f64) {
    (f64::from(figure.width_px) / 2.0, MARGIN + 0.4 * TITLE_HEIGHT)
}

/// Width of the widest of some numbers.
pub(super) fn widest<'a>(texts: impl Iterator<Item = &'a str>) -> f64 {
    texts.map(|text| text_width(text, TICK_PX)).fold(0.0, f64::max)
}
