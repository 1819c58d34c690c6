//! What every result shows: its answer, its page, and the figure that proves it.

use drift_sim::plot::Figure;
use drift_sim::report::{self, Page};
use drift_sim::sentences::Answer;
use drift_sim::terminal::Terminal;
use drift_sim::{Error, Result};
use pyo3::prelude::*;
use serde_json::Value;

use crate::error::raised;

/// Points that a line of a figure keeps.
const MOST_POINTS: usize = 32_768;

/// JSON as text: Python reads it back to the same numbers.
pub fn text(value: &Value) -> PyResult<String> {
    let written = serde_json::to_string(value);
    written.map_err(|e| raised(Error::new(format!("JSON can't be written: {e}"))))
}

/// A figure as JSON.
pub fn figure(figure: &Figure) -> PyResult<String> {
    text(&report::figure_json(figure, MOST_POINTS).map_err(raised)?)
}

/// The answer in words, without colours, in the signs of the locale.
pub fn answer(answer: &Answer) -> String {
    Terminal { width: 80, colour: false, ..Terminal::here() }.answer(answer)
}

/// A page, made when it is first asked for: its charts may take simulations.
pub struct Shown {
    html: String,
    first_screen: String,
    figure: Option<Figure>,
}

impl Shown {
    /// Writes the page.
    pub fn of(page: Page) -> Result<Self> {
        Ok(Self {
            html: page.to_html()?,
            first_screen: page.first_screen(),
            figure: page.proof.map(|proof| proof.figure),
        })
    }

    /// The whole page.
    pub fn html(&self) -> &str {
        &self.html
    }

    /// Its first screen.
    pub fn first_screen(&self) -> &str {
        &self.first_screen
    }

    /// Its proof, as JSON.
    pub fn figure(&self) -> PyResult<Option<String>> {
        self.figure.as_ref().map(figure).transpose()
    }
}
