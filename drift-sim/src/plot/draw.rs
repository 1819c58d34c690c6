//! Draws a figure: axes first, then shades, then the rest in its order.

use super::axis::Axis;
use super::canvas::{Align, Canvas, Spoken, Stroke, sheet};
use super::layout::{Frame, LABEL_PX, Place, TICK_PX, TITLE_PX, arrange, frame_width, title_at, widest};
use super::{Colour, Figure, Layer, Marker, Panel, legend, thin};
use crate::Result;

/// Width of a line that shows data, px.
pub(super) const LINE_PX: f64 = 1.5;
/// What lies further out than this, px, might as well be infinitely far.
const FAR_PX: f64 = 1e7;
/// Markers nearer to each other than this, px, are drawn once.
const MARKER_CELL_PX: f64 = 1.5;

pub(super) fn figure(figure: &Figure) -> Result<String> {
    let y_axes: Vec<Axis> = figure.panels.iter().map(|panel| y_axis(panel, figure)).collect();
    let y_ticks: Vec<f64> =
        y_axes.iter().map(|axis| widest(axis.visible_ticks().map(|(_, text)| text))).collect();
    let columns = figure.columns.max(1);
    let widths = (0..figure.panels.len()).map(|index| frame_width(figure, &y_ticks, index % columns));
    let strips: Vec<usize> =
        figure.panels.iter().zip(widths).map(|(panel, width)| legend::strips(panel, width)).collect();
    let arranged = arrange(figure, &strips, &y_ticks);
    let spoken = Spoken { title: figure.says(), description: figure.description() };
    sheet((arranged.width, arranged.height), &spoken, |canvas| {
        if !figure.title.is_empty() {
            canvas.text(&figure.title, title_at(figure), TITLE_PX, Align::Middle, true)?;
        }
        for (index, place) in arranged.places.iter().enumerate() {
            let (Some(panel), Some(y)) = (figure.panels.get(index), y_axes.get(index)) else { continue };
            let x = x_axis(figure, index, place.frame.width);
            let axes = Axes { canvas, frame: place.frame, x: &x, y };
            axes.draw_grid(panel, place)?;
            axes.draw_layers(panel)?;
            legend::draw(canvas, panel, place)?;
        }
        Ok(())
    })
}

fn y_axis(panel: &Panel, figure: &Figure) -> Axis {
    let ticks = (f64::from(figure.panel_height_px) / 28.0) as usize;
    Axis::over(y_values(panel), panel.y_range, panel.y_log, 0.05, ticks.clamp(2, 10)).named(&panel.y_names)
}

fn x_axis(figure: &Figure, index: usize, width: f64) -> Axis {
    let columns = figure.columns.max(1);
    let sharing = |i: usize| if figure.shared_x { i % columns == index % columns } else { i == index };
    let panels = || figure.panels.iter().enumerate().filter(|(i, _)| sharing(*i)).map(|(_, panel)| panel);
    let wanted = panels().find_map(|panel| panel.x_range);
    let log = panels().any(|panel| panel.x_log);
    // A line over time fills its panel; single points and bars keep off the edges.
    let is_line = |layer: &Layer| matches!(layer, Layer::Line { .. });
    let has_points = |layer: &Layer| matches!(layer, Layer::Points { .. } | Layer::Bars { .. });
    let layers = || panels().flat_map(|panel| &panel.layers);
    let pad = if layers().any(has_points) || !layers().any(is_line) { 0.03 } else { 0.0 };
    let count = |px: f64, most: usize| ((width / px) as usize).clamp(2, most);
    let axis = Axis::over(panels().flat_map(x_values), wanted, log, pad, count(60.0, 12));
    let axis = if panels().any(|panel| panel.x_dates) { axis.of_dates(count(110.0, 8)) } else { axis };
    let names: &[_] = figure.panels.get(index).map_or(&[], |panel| &panel.x_names);
    axis.named(names)
}

/// All y that a panel shows.
fn y_values(panel: &Panel) -> impl Iterator<Item = f64> {
    let visible = |x: f64| panel.x_range.is_none_or(|(low, high)| (low..=high).contains(&x));
    panel.layers.iter().flat_map(move |layer| -> Box<dyn Iterator<Item = f64> + '_> {
        match layer {
            Layer::Line { points, .. } | Layer::Points { points, .. } => {
                Box::new(points.iter().filter(move |(x, _)| visible(*x)).map(|(_, y)| *y))
            }
            Layer::Bars { points, .. } => {
                Box::new(points.iter().map(|(_, y)| *y).chain((!panel.y_log).then_some(0.0)))
            }
            Layer::Band { lower, upper, .. } => {
                Box::new(lower.iter().chain(upper).filter(move |(x, _)| visible(*x)).map(|(_, y)| *y))
            }
            Layer::HorizontalLine { y, .. } => Box::new(std::iter::once(*y)),
            Layer::VerticalLine { .. } | Layer::Span { .. } => Box::new(std::iter::empty()),
        }
    })
}

/// All x that a panel shows; lines and spans that mark a place don't widen it, unless there is nothing else.
fn x_values(panel: &Panel) -> impl Iterator<Item = f64> {
    let only_marks =
        panel.layers.iter().all(|l| matches!(l, Layer::VerticalLine { .. } | Layer::Span { .. }));
    panel.layers.iter().flat_map(move |layer| -> Box<dyn Iterator<Item = f64> + '_> {
        match layer {
            Layer::Line { points, .. } | Layer::Points { points, .. } => {
                Box::new(points.iter().filter(|(_, y)| y.is_finite()).map(|(x, _)| *x))
            }
            Layer::Bars { points, width, .. } => {
                Box::new(points.iter().flat_map(move |(x, _)| [x - 0.5 * width, x + 0.5 * width]))
            }
            Layer::Band { lower, upper, .. } => Box::new(lower.iter().chain(upper).map(|(x, _)| *x)),
            Layer::VerticalLine { x, .. } if only_marks => Box::new(std::iter::once(*x)),
            Layer::Span { from, to, .. } if only_marks => Box::new([*from, *to].into_iter()),
            _ => Box::new(std::iter::empty()),
        }
    })
}

/// One panel's axes on the sheet.
struct Axes<'a, 'sheet> {
    canvas: &'a Canvas<'sheet>,
    frame: Frame,
    x: &'a Axis,
    y: &'a Axis,
}

impl Axes<'_, '_> {
    fn x_px(&self, x: f64) -> Option<f64> {
        self.x.place(x).map(|at| (at * self.frame.width).clamp(-FAR_PX, FAR_PX))
    }

    fn y_px(&self, y: f64) -> Option<f64> {
        self.y.place(y).map(|at| ((1.0 - at) * self.frame.height).clamp(-FAR_PX, FAR_PX))
    }

    /// The place inside the frame; `None` where the point can't be shown.
    fn place(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        Some((self.x_px(x)?, self.y_px(y)?))
    }

    fn on_sheet(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.frame.left + x, self.frame.top + y)
    }

    fn draw_grid(&self, panel: &Panel, place: &Place) -> Result<()> {
        let frame = self.frame;
        let grid = Stroke { colour: Colour::Grey, opacity: 0.25, width_px: 0.75, dashed: false };
        for (at, text) in self.x.visible_ticks() {
            let x = frame.left + at * frame.width;
            if panel.x_names.is_empty() {
                self.canvas.line(&[(x, frame.top), (x, frame.bottom())], grid)?;
            }
            if place.x_axis {
                self.canvas.text(text, (x, frame.bottom() + 12.0), TICK_PX, Align::Middle, false)?;
            }
        }
        for (at, text) in self.y.visible_ticks() {
            let y = frame.bottom() - at * frame.height;
            self.canvas.line(&[(frame.left, y), (frame.right(), y)], grid)?;
            self.canvas.text(text, (frame.left - 7.0, y), TICK_PX, Align::Right, false)?;
        }
        let edge = Stroke { colour: Colour::Grey, opacity: 1.0, width_px: 1.0, dashed: false };
        let corners =
            [(frame.left, frame.top), (frame.left, frame.bottom()), (frame.right(), frame.bottom())];
        self.canvas.line(&corners, edge)?;
        if place.x_axis && !panel.x_label.is_empty() {
            let at = (frame.left + 0.5 * frame.width, frame.bottom() + 31.0);
            self.canvas.text(&panel.x_label, at, LABEL_PX, Align::Middle, false)?;
        }
        if !panel.y_label.is_empty() {
            let at = (place.y_label_x, frame.top + 0.5 * frame.height);
            self.canvas.text(&panel.y_label, at, LABEL_PX, Align::Upwards, false)?;
        }
        Ok(())
    }

    fn draw_layers(&self, panel: &Panel) -> Result<()> {
        let is_shade = |layer: &&Layer| matches!(layer, Layer::Span { .. } | Layer::Band { .. });
        let shades = panel.layers.iter().filter(is_shade);
        let rest = panel.layers.iter().filter(|layer| !is_shade(layer));
        shades.chain(rest).try_for_each(|layer| self.draw_layer(layer))
    }

    fn draw_layer(&self, layer: &Layer) -> Result<()> {
        let (width, height) = (self.frame.width, self.frame.height);
        match layer {
            Layer::Line { points, colour, dashed, .. } => self.draw_line(points, *colour, *dashed),
            Layer::Points { points, colour, marker: shape, .. } => {
                let inside = |(x, y): &(f64, f64)| (0.0..=width).contains(x) && (0.0..=height).contains(y);
                let places = points.iter().filter_map(|point| self.place(*point)).filter(inside);
                let places = thin::apart(places, MARKER_CELL_PX);
                places.iter().try_for_each(|at| marker(self.canvas, *shape, self.on_sheet(*at), *colour))
            }
            Layer::Band { lower, upper, colour, .. } => self.draw_band(lower, upper, *colour),
            Layer::Bars { points, width, colour, .. } => {
                points.iter().try_for_each(|(x, y)| self.draw_bar(*x, *y, *width, *colour))
            }
            Layer::HorizontalLine { y, colour, dashed, .. } => match self.y_px(*y) {
                Some(y) => self.draw_pieces([Some((0.0, y)), Some((width, y))], *colour, *dashed),
                None => Ok(()),
            },
            Layer::VerticalLine { x, colour, dashed, .. } => match self.x_px(*x) {
                Some(x) => self.draw_pieces([Some((x, 0.0)), Some((x, height))], *colour, *dashed),
                None => Ok(()),
            },
            Layer::Span { from, to, colour, .. } => match (self.x_px(*from), self.x_px(*to)) {
                (Some(from), Some(to)) if from.max(to) > 0.0 && from.min(to) < width => {
                    let (from, to) = (from.min(to).max(0.0), from.max(to).min(width));
                    self.canvas.rectangle(
                        self.on_sheet((from, 0.0)),
                        self.on_sheet((to, height)),
                        *colour,
                        0.2,
                    )
                }
                _ => Ok(()),
            },
        }
    }

    fn draw_line(&self, points: &[(f64, f64)], colour: Colour, dashed: bool) -> Result<()> {
        self.draw_pieces(points.iter().map(|point| self.place(*point)), colour, dashed)
    }

    fn draw_pieces(
        &self,
        points: impl IntoIterator<Item = Option<(f64, f64)>>,
        colour: Colour,
        dashed: bool,
    ) -> Result<()> {
        let stroke = Stroke { colour, opacity: 1.0, width_px: LINE_PX, dashed };
        for piece in thin::pieces(points.into_iter(), self.frame.width, self.frame.height) {
            let piece: Vec<_> = piece.into_iter().map(|at| self.on_sheet(at)).collect();
            self.canvas.line(&piece, stroke)?;
        }
        Ok(())
    }

    /// There along the upper edge, back along the lower.
    fn draw_band(&self, lower: &[(f64, f64)], upper: &[(f64, f64)], colour: Colour) -> Result<()> {
        let (width, height) = (self.frame.width, self.frame.height);
        let edge = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
            let inside = |(x, y): (f64, f64)| (x.clamp(0.0, width), y.clamp(0.0, height));
            let places = points.iter().filter_map(|point| self.place(*point)).map(|at| Some(inside(at)));
            thin::pieces(places, width, height).concat()
        };
        let (mut outline, mut back) = (edge(upper), edge(lower));
        if outline.is_empty() || back.is_empty() {
            return Ok(());
        }
        back.reverse();
        outline.extend(back);
        let outline: Vec<_> = outline.into_iter().map(|at| self.on_sheet(at)).collect();
        self.canvas.area(&outline, colour, 0.3)
    }

    fn draw_bar(&self, x: f64, y: f64, wide: f64, colour: Colour) -> Result<()> {
        let (Some(from), Some(to), Some(top)) =
            (self.x_px(x - 0.5 * wide), self.x_px(x + 0.5 * wide), self.y_px(y))
        else {
            return Ok(());
        };
        let (width, height) = (self.frame.width, self.frame.height);
        let foot = ((1.0 - self.y.foot()) * height).clamp(0.0, height);
        let top = top.clamp(0.0, height);
        let corners = [(from.clamp(0.0, width), top.min(foot)), (to.clamp(0.0, width), top.max(foot))];
        self.canvas.rectangle(self.on_sheet(corners[0]), self.on_sheet(corners[1]), colour, 0.85)
    }
}

pub(super) fn marker(canvas: &Canvas, shape: Marker, (x, y): (f64, f64), colour: Colour) -> Result<()> {
    match shape {
        Marker::Dot => canvas.dot((x, y), 2.5, colour),
        Marker::Cross => {
            const ARM: f64 = 3.5;
            let stroke = Stroke { colour, opacity: 1.0, width_px: LINE_PX, dashed: false };
            canvas.line(&[(x - ARM, y - ARM), (x + ARM, y + ARM)], stroke)?;
            canvas.line(&[(x - ARM, y + ARM), (x + ARM, y - ARM)], stroke)
        }
    }
}
