//! The sheet of paper: strokes, areas and text in px, drawn by `plotters` into SVG.
//!
//! `plotters` places everything on whole units; the sheet is drawn four times as large and shown at a quarter, so
//! that lines run smoothly.

use plotters::coord::Shift;
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::prelude::{DrawingArea, IntoDrawingArea, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, FontTransform, IntoFont, RGBColor, ShapeStyle, TextStyle, WHITE};

use super::Colour;
use crate::report::escape;
use crate::{Error, Result};

/// Units of the sheet to a px.
const SCALE: f64 = 4.0;
/// `plotters` divides font sizes by this before it writes them.
const FONT_RATIO: f64 = 1.24;
/// The stroke width, in units of the sheet, that stands for a broken line until the sheet is finished: `plotters`
/// can only break lines by drawing each dash by itself, which makes large files.
const BROKEN: u32 = 1009;

/// How text stands to its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Middle,
    Right,
    /// Middle, read from below.
    Upwards,
}

/// A stroke's look.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stroke {
    pub colour: Colour,
    pub opacity: f64,
    pub width_px: f64,
    pub dashed: bool,
}

/// Takes the strokes of one figure.
pub(super) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

fn units(px: f64) -> i32 {
    // Saturates: what is far outside stays outside.
    libm::round(px * SCALE) as i32
}

fn rgb(colour: Colour) -> RGBColor {
    let (r, g, b) = colour.rgb();
    RGBColor(r, g, b)
}

fn refused(e: impl std::fmt::Display) -> Error {
    Error::new(format!("the chart can't be drawn: {e}"))
}

/// What a sheet says to those who can't see it.
pub(super) struct Spoken {
    pub title: String,
    pub description: String,
}

/// Draws on a white sheet of this size, px, and hands back the SVG.
pub(super) fn sheet(
    (width, height): (f64, f64),
    spoken: &Spoken,
    draw: impl FnOnce(&Canvas) -> Result<()>,
) -> Result<String> {
    let mut svg = String::new();
    let size = (units(width).unsigned_abs(), units(height).unsigned_abs());
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).map_err(refused)?;
        let canvas = Canvas { area };
        draw(&canvas)?;
        canvas.area.present().map_err(refused)?;
    }
    let large = format!("width=\"{}\" height=\"{}\" viewBox", size.0, size.1);
    let shown =
        format!("width=\"{width}\" height=\"{height}\" role=\"img\" stroke-linejoin=\"round\" viewBox");
    // Quotes in text are escaped: none of these can be met in a title.
    let broken = format!("stroke-width=\"{BROKEN}\"");
    let dashes =
        format!("stroke-width=\"{}\" stroke-dasharray=\"{} {}\"", units(1.5), units(6.0), units(4.0));
    let svg = svg.replacen(&large, &shown, 1).replace(&broken, &dashes);
    let (title, description) = (escape::text(&spoken.title), escape::text(&spoken.description));
    let Some(at) = svg.find('>') else { return Ok(svg) };
    let (open, rest) = svg.split_at(at + 1);
    Ok(format!("{open}\n<title>{title}</title>\n<desc>{description}</desc>{rest}"))
}

impl Canvas<'_> {
    pub fn line(&self, points: &[(f64, f64)], stroke: Stroke) -> Result<()> {
        let width = if stroke.dashed { BROKEN } else { units(stroke.width_px).unsigned_abs() };
        let style =
            ShapeStyle { color: rgb(stroke.colour).mix(stroke.opacity), filled: false, stroke_width: width };
        // Neighbours that fall on one place say nothing twice.
        let mut path: Vec<(i32, i32)> = points.iter().map(|(x, y)| (units(*x), units(*y))).collect();
        path.dedup();
        if let [only] = path[..] {
            path.push(only);
        }
        self.area.draw(&PathElement::new(path, style)).map_err(refused)
    }

    pub fn area(&self, outline: &[(f64, f64)], colour: Colour, opacity: f64) -> Result<()> {
        let points: Vec<_> = outline.iter().map(|(x, y)| (units(*x), units(*y))).collect();
        self.area.draw(&Polygon::new(points, rgb(colour).mix(opacity).filled())).map_err(refused)
    }

    pub fn rectangle(&self, from: (f64, f64), to: (f64, f64), colour: Colour, opacity: f64) -> Result<()> {
        let corners = [(units(from.0), units(from.1)), (units(to.0), units(to.1))];
        self.area.draw(&Rectangle::new(corners, rgb(colour).mix(opacity).filled())).map_err(refused)
    }

    pub fn dot(&self, at: (f64, f64), radius_px: f64, colour: Colour) -> Result<()> {
        let circle = Circle::new((units(at.0), units(at.1)), units(radius_px), rgb(colour).mix(0.7).filled());
        self.area.draw(&circle).map_err(refused)
    }

    pub fn text(&self, text: &str, at: (f64, f64), size_px: f64, align: Align, bold: bool) -> Result<()> {
        // Control characters are not allowed in XML.
        let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let h = match align {
            Align::Left => HPos::Left,
            Align::Middle | Align::Upwards => HPos::Center,
            Align::Right => HPos::Right,
        };
        let style = if bold { FontStyle::Bold } else { FontStyle::Normal };
        let font = ("sans-serif", size_px * SCALE * FONT_RATIO).into_font().style(style);
        let font = if align == Align::Upwards { font.transform(FontTransform::Rotate270) } else { font };
        let style = TextStyle::from(font).pos(Pos::new(h, VPos::Center)).color(&RGBColor(30, 30, 30));
        self.area.draw(&Text::new(text, (units(at.0), units(at.1)), style)).map_err(refused)
    }
}

/// About how wide text is, px. The reader's font isn't known here; this is a little more than most need.
pub(crate) fn text_width(text: &str, size_px: f64) -> f64 {
    text.chars().map(|c| if "il.,:;|!'()[] ".contains(c) { 0.36 } else { 0.62 }).sum::<f64>() * size_px
}
