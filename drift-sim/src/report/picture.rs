//! A figure as inline SVG for a page: its colours are the page's, so that it follows light and dark; text is as large as the text
//! around it; a title and a description say what it shows. Drawn for one width.

use std::fmt::Write as _;

use super::{chart_data, escape};
use crate::plot::{Axis, Figure, Layer, Marker, Panel, text_width};

/// What is drawn, and how wide.
#[derive(Debug, Clone, Copy)]
pub(super) struct Size {
    /// Of the whole, px.
    pub width: f64,
    /// Of one panel with its legend, without the numbers under the lowest, px.
    pub panel_height: f64,
    /// Of its text, px.
    pub text: f64,
}

/// For a desktop's page.
pub(super) const WIDE: Size = Size { width: 1080.0, panel_height: 180.0, text: 13.0 };
/// For a telephone's page.
pub(super) const NARROW: Size = Size { width: 376.0, panel_height: 150.0, text: 12.0 };

/// Between panels that stand side by side, px.
const GAP: f64 = 16.0;
/// Room for another point right of the frame, px.
const RIGHT: f64 = 12.0;
/// Mean width of a digit or a letter over its height.
const LETTER: f64 = 0.58;

/// The figure as SVG; `id` sets it apart from all others on the page.
pub(super) fn svg(figure: &Figure, size: Size, id: &str, title: &str, description: &str) -> String {
    let columns = figure.columns.max(1).min(figure.panels.len().max(1));
    let rows = figure.panels.len().div_ceil(columns);
    let width = (size.width - GAP * (columns - 1) as f64) / columns as f64;
    let foot = 2.9 * size.text;
    let mut pen = Pen { out: String::new(), size, told: Vec::new() };
    // Panels over one x axis begin at one place.
    let lefts: Vec<f64> = figure.panels.iter().map(|panel| left_of(panel, size, width)).collect();
    let widest = lefts.iter().copied().fold(0.0, f64::max);
    let mut y = 0.0;
    for row in 0..rows {
        let last = !figure.shared_x || row + 1 == rows;
        let height = size.panel_height + if last { foot } else { 0.4 * size.text };
        for column in 0..columns {
            let Some(panel) = figure.panels.get(row * columns + column) else { continue };
            let x = column as f64 * (width + GAP);
            let shared: Vec<&Panel> =
                if figure.shared_x { figure.panels.iter().collect() } else { vec![panel] };
            let frame = Frame { x, y, width, height: size.panel_height };
            let left = match figure.shared_x {
                true => widest,
                false => lefts.get(row * columns + column).copied().unwrap_or(widest),
            };
            pen.panel(panel, &frame, left, &x_axis(&shared, size, width), last.then(|| x_label(&shared)));
        }
        y += height;
    }
    let body = pen.out;
    let (title, description) = (escape::text(title), escape::text(description));
    format!(
        "<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\" aria-labelledby=\"{id}t {id}d\">\
         <title id=\"{id}t\">{title}</title><desc id=\"{id}d\">{description}</desc>{body}</svg>",
        px(size.width),
        px(y)
    )
}

/// Room for the numbers beside a panel, px.
fn left_of(panel: &Panel, size: Size, width: f64) -> f64 {
    let axis = y_axis(panel, size.panel_height / size.text);
    let longest = axis.visible_ticks().map(|(_, text)| text.chars().count()).max().unwrap_or(1);
    (longest as f64 * LETTER * size.text + 8.0).clamp(34.0, 0.4 * width)
}

fn x_label<'a>(panels: &[&'a Panel]) -> &'a str {
    panels.iter().rev().map(|p| p.x_label.as_str()).find(|label| !label.is_empty()).unwrap_or_default()
}

/// Where a panel stands.
struct Frame {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

struct Pen<'a> {
    out: String,
    size: Size,
    /// Names and colours that a legend further up has.
    told: Vec<(&'a str, &'static str)>,
}

impl<'a> Pen<'a> {
    /// Writing to a String can't fail.
    fn put(&mut self, markup: std::fmt::Arguments<'_>) {
        let _ = self.out.write_fmt(markup);
    }

    fn panel(&mut self, panel: &'a Panel, frame: &Frame, left: f64, x_axis: &Axis, x_label: Option<&str>) {
        let text = self.size.text;
        let y_axis = y_axis(panel, frame.height / text);
        let left = frame.x + left;
        let right = frame.x + frame.width - RIGHT;
        let top = frame.y + self.legend(panel, frame) + 4.0;
        let bottom = frame.y + frame.height;
        let (x_at, y_at) = (|at: f64| left + at * (right - left), |at: f64| bottom - at * (bottom - top));
        for (at, label) in y_axis.visible_ticks() {
            let (y, label) = (y_at(at), escape::text(label));
            self.put(format_args!(
                "<path class=\"g\" d=\"M{} {}H{}\"/><text x=\"{}\" y=\"{}\" text-anchor=\"end\">{label}</text>",
                px(left), px(y), px(right), px(left - 5.0), px(y + 0.35 * text)
            ));
        }
        for (at, label) in x_axis.visible_ticks() {
            let x = x_at(at);
            self.put(format_args!("<path class=\"g\" d=\"M{} {}V{}\"/>", px(x), px(top), px(bottom)));
            if x_label.is_some() {
                let half = 0.5 * LETTER * text * label.chars().count() as f64;
                let x = x.clamp(left + half.min(8.0), (frame.x + frame.width - half).max(left));
                self.put(format_args!(
                    "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                    px(x),
                    px(bottom + 1.25 * text),
                    escape::text(label)
                ));
            }
        }
        if let Some(label) = x_label {
            self.put(format_args!(
                "<text class=\"l\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
                px(right),
                px(bottom + 2.5 * text),
                escape::text(label)
            ));
        }
        // An inner picture shows nothing beyond its frame.
        let (width, height) = (px(right - left), px(bottom - top));
        let (from, to) = (px(left), px(top));
        self.put(format_args!(
            "<svg x=\"{from}\" y=\"{to}\" width=\"{width}\" height=\"{height}\" viewBox=\"{from} {to} {width} {height}\">"
        ));
        let drawing = Drawing {
            x: |x: f64| x_axis.place(x).map(|at| x_at(at.clamp(-1e3, 1e3))),
            y: |y: f64| y_axis.place(y).map(|at| y_at(at.clamp(-1e3, 1e3))),
            top,
            bottom,
            left,
            right,
            foot: y_at(y_axis.foot()),
        };
        for back in [true, false] {
            for layer in panel.layers.iter().filter(|layer| is_behind(layer) == back) {
                drawing.layer(self, layer);
            }
        }
        self.out.push_str("</svg>");
    }

    /// Title, unit, and the names that no panel further up has; hands back how high it is.
    fn legend(&mut self, panel: &'a Panel, frame: &Frame) -> f64 {
        let text = self.size.text;
        let row = 1.45 * text;
        let (mut x, mut y) = (frame.x, frame.y + text);
        let mut place = |words: &str, swatch: f64| {
            let bold = if swatch == 0.0 { 1.1 } else { 1.0 };
            let length = swatch + bold * text_width(words, text);
            if x > frame.x && x + length > frame.x + frame.width {
                (x, y) = (frame.x, y + row);
            }
            let at = (x, y);
            x += length + 14.0;
            at
        };
        let head: Vec<&str> =
            [panel.title.as_str(), panel.y_label.as_str()].into_iter().filter(|t| !t.is_empty()).collect();
        let head = head.join(", ");
        if !head.is_empty() {
            let (x, y) = place(&head, 0.0);
            let head = escape::text(&head);
            let _ = write!(self.out, "<text class=\"h\" x=\"{}\" y=\"{}\">{head}</text>", px(x), px(y));
        }
        for layer in &panel.layers {
            let look = (layer.name(), colour(layer));
            if look.0.is_empty() || self.told.contains(&look) {
                continue;
            }
            self.told.push(look);
            let (x, y) = place(look.0, 22.0);
            let swatch = swatch(layer, x, y - 0.35 * text);
            let words = escape::text(look.0);
            let _ = write!(self.out, "{swatch}<text x=\"{}\" y=\"{}\">{words}</text>", px(x + 22.0), px(y));
        }
        y - frame.y + 0.2 * text
    }
}

/// Where numbers lie in a panel.
struct Drawing<X, Y> {
    x: X,
    y: Y,
    top: f64,
    bottom: f64,
    left: f64,
    right: f64,
    foot: f64,
}

impl<X: Fn(f64) -> Option<f64>, Y: Fn(f64) -> Option<f64>> Drawing<X, Y> {
    fn layer(&self, pen: &mut Pen<'_>, layer: &Layer) {
        let ink = colour(layer);
        let most = (3.0 * (self.right - self.left)) as usize;
        match layer {
            Layer::Line { points, dashed, .. } => {
                let path = self.path(&chart_data::shortened(points, most), 'M');
                // What was measured is a broad shade behind what was simulated.
                let class = match (*dashed, ink) {
                    (true, _) => "s d",
                    (false, "grey") => "s m",
                    _ => "s",
                };
                pen.put(format_args!("<path class=\"{class}\" stroke=\"var(--{ink})\" d=\"{path}\"/>"));
            }
            Layer::Band { lower, upper, .. } => {
                let mut path = String::new();
                for (upper, lower) in stretches(upper).zip(stretches(lower)) {
                    let mut back = chart_data::shortened(lower, most);
                    back.reverse();
                    path += &self.path(&chart_data::shortened(upper, most), 'M');
                    path += &self.path(&back, 'L');
                    path.push('Z');
                }
                pen.put(format_args!("<path class=\"b\" fill=\"var(--{ink})\" d=\"{path}\"/>"));
            }
            Layer::Points { points, marker, .. } => {
                let mut path = String::new();
                for (x, y) in self.places(points) {
                    let _ = match marker {
                        Marker::Dot => write!(path, "M{} {}h0", px(x), px(y)),
                        Marker::Cross => write!(path, "M{} {}l6 6m-6 0l6-6", px(x - 3.0), px(y - 3.0)),
                    };
                }
                let class = if *marker == Marker::Dot { "p" } else { "s" };
                pen.put(format_args!("<path class=\"{class}\" stroke=\"var(--{ink})\" d=\"{path}\"/>"));
            }
            Layer::Bars { points, width, .. } => {
                for (x, y) in points {
                    let (from, to) = ((self.x)(x - 0.5 * width), (self.x)(x + 0.5 * width));
                    if let (Some(from), Some(to), Some(y)) = (from, to, (self.y)(*y)) {
                        pen.put(format_args!(
                            "<rect class=\"r\" fill=\"var(--{ink})\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
                            px(from), px(y.min(self.foot)), px(to - from), px((y - self.foot).abs())
                        ));
                    }
                }
            }
            Layer::HorizontalLine { y, dashed, .. } => {
                if let Some(y) = (self.y)(*y) {
                    let class = if *dashed { "s d" } else { "s" };
                    pen.put(format_args!(
                        "<path class=\"{class}\" stroke=\"var(--{ink})\" d=\"M{} {}H{}\"/>",
                        px(self.left),
                        px(y),
                        px(self.right)
                    ));
                }
            }
            Layer::VerticalLine { x, dashed, .. } => {
                if let Some(x) = (self.x)(*x) {
                    let class = if *dashed { "s d" } else { "s" };
                    pen.put(format_args!(
                        "<path class=\"{class}\" stroke=\"var(--{ink})\" d=\"M{} {}V{}\"/>",
                        px(x),
                        px(self.top),
                        px(self.bottom)
                    ));
                }
            }
            Layer::Span { from, to, .. } => {
                if let (Some(from), Some(to)) = ((self.x)(*from), (self.x)(*to)) {
                    pen.put(format_args!(
                        "<rect class=\"a\" fill=\"var(--{ink})\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
                        px(from), px(self.top), px((to - from).max(1.0)), px(self.bottom - self.top)
                    ));
                }
            }
        }
    }

    fn places<'a>(&'a self, points: &'a [(f64, f64)]) -> impl Iterator<Item = (f64, f64)> + 'a {
        points.iter().filter_map(|(x, y)| Some(((self.x)(*x)?, (self.y)(*y)?)))
    }

    /// Joined points; what is missing breaks the line.
    fn path(&self, points: &[(f64, f64)], first: char) -> String {
        let (mut path, mut begin) = (String::new(), first);
        for (x, y) in points {
            match ((self.x)(*x), (self.y)(*y)) {
                (Some(x), Some(y)) => {
                    let _ = write!(path, "{begin}{} {}", px(x), px(y));
                    begin = 'L';
                }
                _ => begin = 'M',
            }
        }
        path
    }
}

/// The stretches of an edge between what is missing.
fn stretches(edge: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    edge.split(|(_, y)| !y.is_finite()).filter(|stretch| !stretch.is_empty())
}

fn x_axis(panels: &[&Panel], size: Size, width: f64) -> Axis {
    let first = panels.first();
    let values = panels.iter().flat_map(|panel| &panel.layers).flat_map(layer_x);
    let wanted = panels.iter().find_map(|panel| panel.x_range);
    let apart =
        panels.iter().flat_map(|p| &p.layers).any(|l| matches!(l, Layer::Points { .. } | Layer::Bars { .. }));
    let lines = panels.iter().flat_map(|p| &p.layers).any(|l| matches!(l, Layer::Line { .. }));
    let dates = first.is_some_and(|p| p.x_dates);
    let letters = if dates { 14.0 } else { 7.0 };
    let count = (width / (letters * size.text)).clamp(2.0, 10.0) as usize;
    let pad = if apart && !lines { 0.03 } else { 0.0 };
    let axis = Axis::over(values, wanted, first.is_some_and(|p| p.x_log), pad, count);
    let axis = if dates { axis.of_dates(count) } else { axis };
    first.map_or(axis.clone(), |panel| axis.named(&panel.x_names))
}

fn y_axis(panel: &Panel, lines: f64) -> Axis {
    let values = panel.layers.iter().flat_map(layer_y);
    let count = (lines / 2.6).clamp(2.0, 6.0) as usize;
    Axis::over(values, panel.y_range, panel.y_log, 0.05, count).named(&panel.y_names)
}

fn layer_x(layer: &Layer) -> Vec<f64> {
    match layer {
        Layer::Line { points, .. } | Layer::Points { points, .. } => points.iter().map(|p| p.0).collect(),
        Layer::Band { lower, .. } => lower.iter().map(|p| p.0).collect(),
        Layer::Bars { points, width, .. } => {
            points.iter().flat_map(|p| [p.0 - 0.5 * width, p.0 + 0.5 * width]).collect()
        }
        _ => Vec::new(),
    }
}

fn layer_y(layer: &Layer) -> Vec<f64> {
    match layer {
        Layer::Line { points, .. } | Layer::Points { points, .. } => points.iter().map(|p| p.1).collect(),
        Layer::Band { lower, upper, .. } => lower.iter().chain(upper).map(|p| p.1).collect(),
        Layer::Bars { points, .. } => points.iter().map(|p| p.1).chain([0.0]).collect(),
        Layer::HorizontalLine { y, .. } => vec![*y],
        _ => Vec::new(),
    }
}

fn is_behind(layer: &Layer) -> bool {
    matches!(layer, Layer::Span { .. } | Layer::Band { .. })
}

fn colour(layer: &Layer) -> &'static str {
    match layer {
        Layer::Line { colour, .. }
        | Layer::Points { colour, .. }
        | Layer::Band { colour, .. }
        | Layer::Bars { colour, .. }
        | Layer::HorizontalLine { colour, .. }
        | Layer::VerticalLine { colour, .. }
        | Layer::Span { colour, .. } => colour.name(),
    }
}

/// A legend's sample, 16 px wide, its middle at y.
fn swatch(layer: &Layer, x: f64, y: f64) -> String {
    let ink = colour(layer);
    match layer {
        Layer::Line { dashed, .. }
        | Layer::HorizontalLine { dashed, .. }
        | Layer::VerticalLine { dashed, .. } => {
            let class = if *dashed { "s d" } else { "s" };
            format!("<path class=\"{class}\" stroke=\"var(--{ink})\" d=\"M{} {}h16\"/>", px(x), px(y))
        }
        Layer::Points { marker: Marker::Cross, .. } => {
            format!(
                "<path class=\"s\" stroke=\"var(--{ink})\" d=\"M{} {}l6 6m-6 0l6-6\"/>",
                px(x + 5.0),
                px(y - 3.0)
            )
        }
        Layer::Points { .. } => {
            format!("<path class=\"p\" stroke=\"var(--{ink})\" d=\"M{} {}h0\"/>", px(x + 8.0), px(y))
        }
        Layer::Band { .. } | Layer::Bars { .. } | Layer::Span { .. } => format!(
            "<rect class=\"b\" fill=\"var(--{ink})\" stroke=\"var(--{ink})\" x=\"{}\" y=\"{}\" width=\"16\" height=\"9\"/>",
            px(x),
            px(y - 4.5)
        ),
    }
}

/// To a tenth of a pixel.
fn px(x: f64) -> String {
    let text = format!("{x:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Colour;

    fn figure() -> Figure {
        let line = |f: fn(f64) -> f64| (0..100_000).map(|i| (f64::from(i) * 0.01, f(f64::from(i)))).collect();
        let panel = |y_label: &str, layers| Panel { y_label: y_label.into(), layers, ..Panel::default() };
        let top =
            panel("u / V", vec![Layer::line("measured <u>", Colour::Grey, line(|i| libm::sin(i * 1e-3)))]);
        let limits =
            Layer::HorizontalLine { y: 3.0, name: "limit".into(), colour: Colour::Vermilion, dashed: true };
        let below = panel("e / V", vec![Layer::line("", Colour::Blue, line(|_| f64::NAN)), limits]);
        let mut figure = Figure::stacked("", vec![top, below]);
        figure.panels[1].x_label = "t / s".into();
        figure
    }

    #[test]
    fn every_picture_says_what_it_shows_and_stays_small() {
        for size in [WIDE, NARROW] {
            let svg = svg(&figure(), size, "p0", "u & its limits", &figure().description());
            assert!(svg.contains("<title id=\"p0t\">u &amp; its limits</title>"), "{svg}");
            assert!(svg.contains("<desc id=\"p0d\">u / V: measured &lt;u&gt;. e / V: limit</desc>"));
            assert!(svg.contains(">t / s</text>") && svg.contains("aria-labelledby=\"p0t p0d\""));
            assert!(svg.len() < 60_000, "{} bytes", svg.len());
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
        }
    }

    /// Each stretch of a broken band is an area of its own.
    #[test]
    fn a_broken_band_is_drawn_in_parts() {
        let edge = |y: f64| vec![(0.0, y), (1.0, y), (1.1, f64::NAN), (2.0, y), (3.0, y), (3.1, f64::NAN)];
        let band =
            Layer::Band { lower: edge(0.0), upper: edge(1.0), name: String::new(), colour: Colour::Sky };
        let panel = Panel { layers: vec![band], ..Panel::default() };
        let svg = svg(&Figure::stacked("", vec![panel]), WIDE, "p0", "", "");
        let path = svg.split("class=\"b\"").nth(1).unwrap().split("d=\"").nth(1).unwrap();
        let path = path.split('"').next().unwrap();
        assert_eq!(
            (path.matches('M').count(), path.matches('L').count(), path.matches('Z').count()),
            (2, 6, 2)
        );
    }

    /// The limit lies beyond all values of its panel, and is within the frame.
    #[test]
    fn limits_are_always_in_view() {
        let svg = svg(&figure(), WIDE, "p0", "", "");
        let limit = svg.split("class=\"s d\"").last().unwrap();
        let y: f64 = limit.split("d=\"M").nth(1).unwrap().split([' ', 'H']).nth(1).unwrap().parse().unwrap();
        let height: f64 =
            svg.split("viewBox=\"0 0 1080 ").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
        assert!((0.0..height).contains(&y), "{y} of {height}");
    }
}
