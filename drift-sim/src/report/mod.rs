//! Reports: one HTML file that needs nothing else, for every command that writes one.
//!
//! A command describes its [`Page`] as data: sections of text, tables and charts. How it looks, how a chart is zoomed, and
//! that no text from a file can become markup is decided here, in one place. The file loads nothing from anywhere; its
//! Content-Security-Policy forbids it. Axes, lines and cursor are drawn by uPlot (`uplot/README.md`), the rest by `charts.js`.

mod chart_data;
mod command_line;
pub(crate) mod escape;
mod html;
mod picture;
mod plane;

pub use command_line::command_line;
pub use plane::{Cloud, Moved, axis_names, plane};

use crate::plot::Figure;
use crate::sentences::{Answer, Status};
use crate::{Error, Result, output};

/// The style sheet of all pages: colours, light and dark, type.
pub const STYLE: &str = include_str!("style.css");

/// A whole report. Every text is plain text: what looks like markup is shown as it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// Its name, in the browser's tab.
    pub title: String,
    /// What it is about, beside the status: the file's name and its length.
    pub about: String,
    /// The first screen: status, sentence, three numbers.
    pub answer: Answer,
    /// The one picture that proves the answer, on the first screen.
    pub proof: Option<Proof>,
    /// The command line that made it.
    pub command: String,
    /// What it is about: a name and its value each.
    pub facts: Vec<(String, String)>,
    /// In reading order.
    pub sections: Vec<Section>,
}

/// The picture on the first screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Proof {
    /// What is drawn.
    pub figure: Figure,
    /// What it shows, in a few words.
    pub title: String,
    /// Under it: how to read it.
    pub caption: String,
}

impl Proof {
    /// As a piece of a page that has the reports' style sheet ([`STYLE`]); `id` sets it apart from all others on that page.
    pub fn to_html(&self, id: &str) -> String {
        html::proof(self, id)
    }
}

/// A heading and what stands under it.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// The heading.
    pub title: String,
    /// In reading order.
    pub blocks: Vec<Block>,
}

impl Section {
    /// A section.
    pub fn new(title: impl Into<String>, blocks: Vec<Block>) -> Self {
        Self { title: title.into(), blocks }
    }
}

/// A piece of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A paragraph of small print.
    Note(String),
    /// Points, one a line.
    List(Vec<String>),
    /// A table.
    Table(Table),
    /// Shown when its title is clicked, and in print.
    Folded {
        /// Always seen.
        title: String,
        /// What is folded.
        blocks: Vec<Block>,
    },
    /// A chart with zoom and cursor.
    Chart(Chart),
    /// A chart as a picture.
    Picture {
        /// What is drawn.
        figure: Figure,
        /// Under it.
        caption: String,
    },
}

impl Block {
    /// A table.
    pub fn table<H: Into<String>>(head: impl IntoIterator<Item = H>, rows: Vec<Vec<String>>) -> Self {
        Self::Table(Table { head: head.into_iter().map(Into::into).collect(), rows })
    }
}

/// Rows of cells under a head. A column whose cells are all numbers is set to the right.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// One text a column.
    pub head: Vec<String>,
    /// Each as long as the head.
    pub rows: Vec<Vec<String>>,
}

/// A chart that can be zoomed, panned and read with a cursor. Lines run from left to right: x rises.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What is drawn; panels with a shared x are zoomed together.
    pub figure: Figure,
    /// Under it: what it shows.
    pub caption: String,
    /// Charts of one page that name the same axis are zoomed together; x of their figures is shared then.
    pub axis: Option<String>,
}

impl Page {
    /// The page as HTML.
    ///
    /// # Errors
    /// A chart can't be drawn, which none is known to cause.
    pub fn to_html(&self) -> Result<String> {
        html::write(self)
    }

    /// The first screen alone, to be shown within another page: status, sentence, numbers and the picture that proves it, with
    /// a style that touches nothing around it (by CSS nesting, which browsers know since 2023).
    pub fn first_screen(&self) -> String {
        html::first_screen(self)
    }

    /// Writes the page, whole or not at all; `-` is standard output.
    ///
    /// # Errors
    /// The file can't be written.
    pub fn write(&self, path: &std::path::Path) -> Result<()> {
        output::write_text(path, &self.to_html()?)
    }
}

/// A figure as data, as the charts of a page have it: panels of layers, numbers to six digits of a line's range, lines thinned to
/// `most_points`.
///
/// # Errors
/// It can't be written as JSON, which none is known to cause.
pub fn figure_json(figure: &Figure, most_points: usize) -> Result<serde_json::Value> {
    serde_json::to_value(chart_data::of(figure, None, most_points).0)
        .map_err(|e| Error::new(format!("the chart can't be written: {e}")))
}
