//! A figure as data for `charts.js`: every x grid once, numbers with the digits that a zoomed chart can show, long lines
//! thinned to the least and the greatest value of equal stretches.

use serde::Serialize;

use crate::plot::{Figure, Layer, Marker, Panel};

/// Decimal digits of a line's own range: enough for a hundredfold zoom.
const DIGITS: i32 = 6;
/// Part of a step that an x may be off a uniform grid: rounded time stamps.
const OFF_GRID: f64 = 0.01;

/// One figure.
#[derive(Debug, Serialize)]
pub(super) struct FigureData {
    columns: usize,
    shared_x: bool,
    height: u32,
    /// Name of the axis that it shares with other figures.
    axis: Option<String>,
    grids: Vec<Grid>,
    panels: Vec<PanelData>,
}

#[derive(Debug, PartialEq, Serialize)]
#[serde(untagged)]
enum Grid {
    Uniform { start: f64, step: f64, count: usize },
    Listed(Vec<f64>),
}

#[derive(Debug, Serialize)]
struct PanelData {
    title: String,
    x_label: String,
    y_label: String,
    x_range: Option<(f64, f64)>,
    y_range: Option<(f64, f64)>,
    x_log: bool,
    x_dates: bool,
    y_log: bool,
    x_names: Vec<(f64, String)>,
    y_names: Vec<(f64, String)>,
    layers: Vec<LayerData>,
}

/// None is what is missing.
type Values = Vec<Option<f64>>;

#[derive(Debug, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum LayerData {
    Line { grid: usize, y: Values, name: String, colour: &'static str, dashed: bool },
    Band { grid: usize, lower: Values, upper: Values, name: String, colour: &'static str },
    Points { x: Vec<f64>, y: Vec<f64>, name: String, colour: &'static str, marker: &'static str },
    Bars { x: Vec<f64>, y: Vec<f64>, width: f64, name: String, colour: &'static str },
    Horizontal { y: f64, name: String, colour: &'static str, dashed: bool },
    Vertical { x: f64, name: String, colour: &'static str, dashed: bool },
    Span { from: f64, to: f64, name: String, colour: &'static str },
}

/// The figure, and the longest line's points before and after thinning to `most`, where any was thinned.
pub(super) fn of(figure: &Figure, axis: Option<&str>, most: usize) -> (FigureData, Option<(usize, usize)>) {
    let mut grids = Vec::new();
    let mut thinned = None;
    let panels = figure.panels.iter().map(|p| panel(p, most, &mut grids, &mut thinned)).collect();
    let data = FigureData {
        columns: figure.columns.max(1),
        shared_x: figure.shared_x,
        height: figure.panel_height_px,
        axis: axis.map(str::to_owned),
        grids,
        panels,
    };
    (data, thinned)
}

fn panel(of: &Panel, most: usize, grids: &mut Vec<Grid>, thinned: &mut Option<(usize, usize)>) -> PanelData {
    let mut shorter = |points: &[(f64, f64)]| {
        let short = shortened(points, most);
        if short.len() < points.len() && thinned.is_none_or(|(before, _)| before < points.len()) {
            *thinned = Some((points.len(), short.len()));
        }
        short
    };
    let mut layers = Vec::with_capacity(of.layers.len());
    for layer in &of.layers {
        layers.push(match layer {
            Layer::Line { points, name, colour, dashed } => {
                let (x, y) = split(&shorter(points));
                let (name, colour) = (name.clone(), colour.name());
                LayerData::Line { grid: place(grid(x), grids), y: rounded(&y), name, colour, dashed: *dashed }
            }
            Layer::Band { lower, upper, name, colour } => {
                let ((x, low), (_, high)) = (split(&shorter(lower)), split(&shorter(upper)));
                let (name, colour) = (name.clone(), colour.name());
                LayerData::Band {
                    grid: place(grid(x), grids),
                    lower: rounded(&low),
                    upper: rounded(&high),
                    name,
                    colour,
                }
            }
            Layer::Points { points, name, colour, marker } => {
                let (x, y) = split(&finite(points));
                let marker = match marker {
                    Marker::Dot => "dot",
                    Marker::Cross => "cross",
                };
                LayerData::Points {
                    x: digits(&x),
                    y: digits(&y),
                    name: name.clone(),
                    colour: colour.name(),
                    marker,
                }
            }
            Layer::Bars { points, width, name, colour } => {
                let (x, y) = split(&finite(points));
                LayerData::Bars { x, y, width: *width, name: name.clone(), colour: colour.name() }
            }
            Layer::HorizontalLine { y, name, colour, dashed } => {
                LayerData::Horizontal { y: *y, name: name.clone(), colour: colour.name(), dashed: *dashed }
            }
            Layer::VerticalLine { x, name, colour, dashed } => {
                LayerData::Vertical { x: *x, name: name.clone(), colour: colour.name(), dashed: *dashed }
            }
            Layer::Span { from, to, name, colour } => {
                LayerData::Span { from: *from, to: *to, name: name.clone(), colour: colour.name() }
            }
        });
    }
    PanelData {
        title: of.title.clone(),
        x_label: of.x_label.clone(),
        y_label: of.y_label.clone(),
        x_range: of.x_range,
        y_range: of.y_range,
        x_log: of.x_log,
        x_dates: of.x_dates,
        y_log: of.y_log,
        x_names: of.x_names.clone(),
        y_names: of.y_names.clone(),
        layers,
    }
}

/// Points of each line and each edge of a band, which are what thinning shortens.
pub(super) fn line_lengths(figure: &Figure) -> impl Iterator<Item = usize> {
    figure.panels.iter().flat_map(|p| &p.layers).flat_map(|layer| match layer {
        Layer::Line { points, .. } => [points.len(), 0],
        Layer::Band { lower, upper, .. } => [lower.len(), upper.len()],
        _ => [0, 0],
    })
}

fn finite(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
}

fn split(points: &[(f64, f64)]) -> (Vec<f64>, Vec<f64>) {
    points.iter().copied().filter(|(x, _)| x.is_finite()).unzip()
}

/// At most `most` points: the least and the greatest value of each of equal stretches, in the order in which they came, at the
/// stretch's beginning and middle, so that lines over the same times stay over the same times. A stretch without any value
/// breaks the line.
pub(super) fn shortened(points: &[(f64, f64)], most: usize) -> Vec<(f64, f64)> {
    if points.len() <= most {
        return points.to_vec();
    }
    let length = points.len().div_ceil((most / 2).max(1));
    let mut short = Vec::with_capacity(most);
    for stretch in points.chunks(length) {
        let (Some(first), Some(middle)) = (stretch.first(), stretch.get(stretch.len() / 2)) else { continue };
        let known = || stretch.iter().map(|p| p.1).enumerate().filter(|(_, y)| y.is_finite());
        let least = known().min_by(|a, b| a.1.total_cmp(&b.1));
        let greatest = known().max_by(|a, b| a.1.total_cmp(&b.1));
        let (a, b) = match (least, greatest) {
            (Some(least), Some(greatest)) if least.0 <= greatest.0 => (least.1, greatest.1),
            (Some(least), Some(greatest)) => (greatest.1, least.1),
            _ => (f64::NAN, f64::NAN),
        };
        short.push((first.0, a));
        if stretch.len() > 1 {
            short.push((middle.0, b));
        }
    }
    short
}

/// The grid of a line's x. uPlot wants it to rise: what doesn't is moved on by the least that does.
fn grid(mut x: Vec<f64>) -> Grid {
    if let (Some(start), Some(end)) = (x.first().copied(), x.last().copied())
        && x.len() > 2
    {
        let step = (end - start) / (x.len() - 1) as f64;
        let on_grid = |(i, x): (usize, &f64)| (x - (start + i as f64 * step)).abs() <= OFF_GRID * step;
        if step > 0.0 && x.iter().enumerate().all(on_grid) {
            return Grid::Uniform { start, step, count: x.len() };
        }
    }
    for i in 1..x.len() {
        if let [before, here] = x[i - 1..=i]
            && here <= before
        {
            x[i] = before + f64::EPSILON * before.abs().max(1e-300) * 4.0;
        }
    }
    Grid::Listed(x)
}

fn place(grid: Grid, grids: &mut Vec<Grid>) -> usize {
    if let Some(at) = grids.iter().position(|g| *g == grid) {
        return at;
    }
    grids.push(grid);
    grids.len() - 1
}

fn rounded(y: &[f64]) -> Values {
    digits(y).into_iter().map(|y| y.is_finite().then_some(y)).collect()
}

/// Values with so many digits of their range.
fn digits(values: &[f64]) -> Vec<f64> {
    let known = || values.iter().copied().filter(|x| x.is_finite());
    let (low, high) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return values.to_vec();
    }
    let places = DIGITS - libm::ceil(libm::log10(span)) as i32;
    // Powers of ten up to 22 are exact: the shortest text of a rounded value has no more digits.
    let round = |x: f64| match places {
        0..=22 => libm::round(x * libm::pow(10.0, f64::from(places))) / libm::pow(10.0, f64::from(places)),
        -22..0 => libm::round(x / libm::pow(10.0, f64::from(-places))) * libm::pow(10.0, f64::from(-places)),
        _ => x,
    };
    values.iter().map(|x| round(*x)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Colour;

    fn line(n: usize, value: impl Fn(usize) -> f64) -> Vec<(f64, f64)> {
        (0..n).map(|i| (i as f64 * 0.01, value(i))).collect()
    }

    #[test]
    fn a_long_line_is_short_and_keeps_its_spike() {
        let points = line(1_000_000, |i| if i == 654_321 { 9.0 } else { (i % 5) as f64 });
        let short = shortened(&points, 1000);
        assert!(short.len() <= 1000, "{}", short.len());
        let spikes: Vec<_> = short.iter().filter(|p| p.1 == 9.0).collect();
        assert_eq!(spikes.len(), 1);
        assert!((spikes[0].0 - 6543.21).abs() < 20.0, "{spikes:?}");
    }

    #[test]
    fn lines_over_the_same_times_share_their_grid_thinned_or_not() {
        for n in [500, 5000] {
            let panel = |f: fn(usize) -> f64| Panel {
                layers: vec![Layer::line("", Colour::Blue, line(n, f))],
                ..Panel::default()
            };
            let figure = Figure::stacked("", vec![panel(|i| i as f64), panel(|_| 2.0)]);
            let (data, thinned) = of(&figure, None, 1000);
            assert_eq!(data.grids.len(), 1, "{:?}", data.grids);
            assert!(matches!(data.grids[0], Grid::Uniform { .. }), "{:?}", data.grids);
            assert_eq!(thinned.is_some(), n == 5000);
        }
    }

    #[test]
    fn values_keep_six_digits_of_their_range_and_gaps_stay() {
        let shown = rounded(&[100.0, 100.123_456_789, f64::NAN, 99.9]);
        assert_eq!(shown, [Some(100.0), Some(100.123_457), None, Some(99.9)]);
        assert_eq!(rounded(&[1e-30, 3.0e9]), [Some(0.0), Some(3.0e9)]);
    }

    #[test]
    fn x_that_stands_still_is_moved_on() {
        let Grid::Listed(x) = grid(vec![0.0, 1.0, 1.0, 5.0]) else { panic!() };
        assert!(x.windows(2).all(|w| w[0] < w[1]), "{x:?}");
    }
}
