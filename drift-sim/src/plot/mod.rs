//! Charts as SVG: what to show is declared here, how it is drawn is decided in one place.
//!
//! A [`Figure`] holds [`Panel`]s, a panel holds [`Layer`]s. Points that are NaN or infinite break a line and are
//! otherwise passed over; long lines are thinned to the least and the greatest value in each column of pixels, so
//! that a million samples make a small file which still shows every spike.

mod axis;
mod canvas;
mod draw;
mod layout;
mod legend;
pub mod terminal;
mod thin;

use std::path::Path;

pub(crate) use axis::Axis;
pub(crate) use canvas::text_width;

use crate::{Result, output};

/// Colours that stay apart for colour-blind readers and in print (Okabe and Ito, Color Universal Design, 2008).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// Black.
    Black,
    /// Dark grey, for what is only context.
    Grey,
    /// Blue.
    Blue,
    /// Vermilion, a red.
    Vermilion,
    /// Bluish green.
    Green,
    /// Orange.
    Orange,
    /// Sky blue.
    Sky,
    /// Reddish purple.
    Purple,
    /// Yellow, for areas only.
    Yellow,
}

impl Colour {
    /// A colour for the i-th of several lines, all that differ well on white before any repeats.
    pub fn nth(i: usize) -> Self {
        const ORDER: [Colour; 7] = [
            Colour::Blue,
            Colour::Vermilion,
            Colour::Green,
            Colour::Purple,
            Colour::Orange,
            Colour::Sky,
            Colour::Black,
        ];
        ORDER[i % ORDER.len()]
    }

    /// Its name in reports, where the reader's light or dark page chooses the shade.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Black => "black",
            Self::Grey => "grey",
            Self::Blue => "blue",
            Self::Vermilion => "vermilion",
            Self::Green => "green",
            Self::Orange => "orange",
            Self::Sky => "sky",
            Self::Purple => "purple",
            Self::Yellow => "yellow",
        }
    }

    pub(self) fn rgb(self) -> (u8, u8, u8) {
        match self {
            Self::Black => (0, 0, 0),
            Self::Grey => (110, 110, 110),
            Self::Blue => (0, 114, 178),
            Self::Vermilion => (213, 94, 0),
            Self::Green => (0, 158, 115),
            Self::Orange => (230, 159, 0),
            Self::Sky => (86, 180, 233),
            Self::Purple => (204, 121, 167),
            Self::Yellow => (240, 228, 66),
        }
    }
}

/// How single points are marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// A filled circle.
    Dot,
    /// Two strokes, like an x.
    Cross,
}

/// One thing that a panel shows. An empty name keeps it out of the legend.
#[derive(Debug, Clone, PartialEq)]
pub enum Layer {
    /// Points joined in their order.
    Line {
        /// x and y.
        points: Vec<(f64, f64)>,
        /// In the legend.
        name: String,
        /// Of the line.
        colour: Colour,
        /// Broken instead of drawn through.
        dashed: bool,
    },
    /// Points by themselves.
    Points {
        /// x and y.
        points: Vec<(f64, f64)>,
        /// In the legend.
        name: String,
        /// Of the markers.
        colour: Colour,
        /// Their shape.
        marker: Marker,
    },
    /// The area between two lines, shaded.
    Band {
        /// Its lower edge, x and y.
        lower: Vec<(f64, f64)>,
        /// Its upper edge, x and y.
        upper: Vec<(f64, f64)>,
        /// In the legend.
        name: String,
        /// Of the area.
        colour: Colour,
    },
    /// Bars from zero (on a log axis from its lower end).
    Bars {
        /// The middle of each and its height.
        points: Vec<(f64, f64)>,
        /// In units of x.
        width: f64,
        /// In the legend.
        name: String,
        /// Of the bars.
        colour: Colour,
    },
    /// A line across the panel, a threshold say.
    HorizontalLine {
        /// Where.
        y: f64,
        /// In the legend.
        name: String,
        /// Of the line.
        colour: Colour,
        /// Broken instead of drawn through.
        dashed: bool,
    },
    /// A line from bottom to top, an onset say.
    VerticalLine {
        /// Where.
        x: f64,
        /// In the legend.
        name: String,
        /// Of the line.
        colour: Colour,
        /// Broken instead of drawn through.
        dashed: bool,
    },
    /// A stretch of x, shaded from bottom to top behind all else.
    Span {
        /// Its left end.
        from: f64,
        /// Its right end.
        to: f64,
        /// In the legend.
        name: String,
        /// Of the shade.
        colour: Colour,
    },
}

impl Layer {
    /// Its name in the legend.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Line { name, .. }
            | Self::Points { name, .. }
            | Self::Band { name, .. }
            | Self::Bars { name, .. }
            | Self::HorizontalLine { name, .. }
            | Self::VerticalLine { name, .. }
            | Self::Span { name, .. } => name,
        }
    }

    /// A solid line.
    pub fn line(name: impl Into<String>, colour: Colour, points: Vec<(f64, f64)>) -> Self {
        Self::Line { points, name: name.into(), colour, dashed: false }
    }

    /// A broken line.
    pub fn dashed(name: impl Into<String>, colour: Colour, points: Vec<(f64, f64)>) -> Self {
        Self::Line { points, name: name.into(), colour, dashed: true }
    }

    /// A solid line of samples at uniform times.
    pub fn signal(
        name: impl Into<String>,
        colour: Colour,
        start_s: f64,
        sample_time_s: f64,
        x: &[f64],
    ) -> Self {
        let points = x.iter().enumerate().map(|(i, x)| (start_s + i as f64 * sample_time_s, *x)).collect();
        Self::line(name, colour, points)
    }

    /// Points by themselves.
    pub fn points(name: impl Into<String>, colour: Colour, marker: Marker, points: Vec<(f64, f64)>) -> Self {
        Self::Points { points, name: name.into(), colour, marker }
    }
}

/// Where a panel's legend stands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum LegendPosition {
    /// Over the panel, where it covers no data.
    #[default]
    Above,
    /// Nowhere.
    Hidden,
}

/// One pair of axes and what is drawn in it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Over the panel; may be empty.
    pub title: String,
    /// Under the x axis, with the unit.
    pub x_label: String,
    /// Beside the y axis, with the unit.
    pub y_label: String,
    /// What is shown, later ones on top.
    pub layers: Vec<Layer>,
    /// From and to; `None` shows all.
    pub x_range: Option<(f64, f64)>,
    /// From and to; `None` shows all.
    pub y_range: Option<(f64, f64)>,
    /// Whether x is logarithmic; only what is above 0 is shown then.
    pub x_log: bool,
    /// Whether x is in seconds since 1970, to be written as dates.
    pub x_dates: bool,
    /// Whether y is logarithmic; only what is above 0 is shown then.
    pub y_log: bool,
    /// Names at places on the x axis, instead of numbers.
    pub x_names: Vec<(f64, String)>,
    /// Names at places on the y axis, instead of numbers.
    pub y_names: Vec<(f64, String)>,
    /// Where the legend stands.
    pub legend: LegendPosition,
}

impl Panel {
    /// Its title, and what its y axis is.
    fn says(&self) -> String {
        let what = [self.title.as_str(), self.y_label.as_str()];
        what.into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join(", ")
    }
}

/// Panels under a title.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Over everything; may be empty.
    pub title: String,
    /// In reading order.
    pub panels: Vec<Panel>,
    /// Panels beside each other; 1 stacks them.
    pub columns: usize,
    /// Whether panels of a column share the x axis: one range, numbers under the lowest only.
    pub shared_x: bool,
    /// Width of the whole, px.
    pub width_px: u32,
    /// Height of a panel with its labels, px.
    pub panel_height_px: u32,
}

impl Default for Figure {
    fn default() -> Self {
        Self {
            title: String::new(),
            panels: Vec::new(),
            columns: 1,
            shared_x: false,
            width_px: 860,
            panel_height_px: 230,
        }
    }
}

impl Figure {
    /// Panels under each other over one x axis.
    pub fn stacked(title: impl Into<String>, panels: Vec<Panel>) -> Self {
        Self { title: title.into(), panels, shared_x: true, panel_height_px: 170, ..Self::default() }
    }

    /// Panels in rows of so many, each with its own axes.
    pub fn grid(title: impl Into<String>, columns: usize, panels: Vec<Panel>) -> Self {
        Self { title: title.into(), panels, columns, ..Self::default() }
    }

    /// One panel.
    pub fn single(panel: Panel) -> Self {
        Self { panels: vec![panel], panel_height_px: 400, ..Self::default() }
    }

    /// What it shows, for those who can't see it: its axes and the names of its lines.
    pub fn description(&self) -> String {
        let of = |panel: &Panel| {
            let mut names: Vec<&str> = Vec::new();
            for name in panel.layers.iter().map(Layer::name).filter(|name| !name.is_empty()) {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
            let what = panel.says();
            match (what.is_empty(), names.is_empty()) {
                (false, false) => format!("{what}: {}", names.join(", ")),
                (true, _) => names.join(", "),
                (_, true) => what,
            }
        };
        self.panels.iter().map(of).filter(|text| !text.is_empty()).collect::<Vec<_>>().join(". ")
    }

    /// Its title; of a figure without one, what its panels show.
    pub(crate) fn says(&self) -> String {
        if !self.title.is_empty() {
            return self.title.clone();
        }
        let mut panels: Vec<String> =
            self.panels.iter().map(Panel::says).filter(|text| !text.is_empty()).collect();
        panels.dedup();
        panels.join("; ")
    }

    /// The chart as SVG text, with a title and a description in it.
    ///
    /// # Errors
    /// It can't be drawn, which no figure is known to cause.
    pub fn to_svg(&self) -> Result<String> {
        draw::figure(self)
    }

    /// Writes the chart to a file, whole or not at all.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn write_svg(&self, path: &Path) -> Result<()> {
        let svg = self.to_svg().map_err(|e| e.in_file(path))?;
        output::write_text(path, &svg)
    }
}
