//! What every result shows: its answer, its page, and the figure that proves it.

use std::sync::{Arc, OnceLock};

use drift_sim::plot::Figure;
use drift_sim::report::{self, Page};
use drift_sim::sentences::Answer;
use drift_sim::terminal::Terminal;
use drift_sim::{Error, Result};
use pyo3::PyClass;
use pyo3::prelude::*;
use serde_json::Value;

use crate::error::raised;
use crate::interrupt;

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

/// What every result shows: its page and the figure that proves it. The page is made when it is first asked for: its charts may take
/// simulations.
#[pyclass(frozen, subclass, module = "drift._drift")]
pub struct Shown {
    page: Arc<dyn Fn() -> Page + Send + Sync>,
    made: OnceLock<Made>,
}

/// A page that was made.
struct Made {
    html: String,
    first_screen: String,
    proof: Option<Figure>,
}

impl Made {
    fn of(page: Page) -> Result<Self> {
        Ok(Self {
            html: page.to_html()?,
            first_screen: page.first_screen(),
            proof: page.proof.map(|proof| proof.figure),
        })
    }
}

impl Shown {
    /// A result that shows this page.
    pub fn by<T: PyClass<BaseType = Self>>(
        py: Python<'_>,
        result: T,
        page: impl Fn() -> Page + Send + Sync + 'static,
    ) -> PyResult<Py<T>> {
        let shown = Self { page: Arc::new(page), made: OnceLock::new() };
        Py::new(py, PyClassInitializer::from(shown).add_subclass(result))
    }

    fn made(&self, py: Python<'_>) -> PyResult<&Made> {
        if let Some(made) = self.made.get() {
            return Ok(made);
        }
        let page = Arc::clone(&self.page);
        let made = interrupt::run(py, move || Made::of(page()))?;
        Ok(self.made.get_or_init(|| made))
    }
}

#[pymethods]
impl Shown {
    /// The whole page.
    fn html(&self, py: Python<'_>) -> PyResult<&str> {
        self.made(py).map(|made| made.html.as_str())
    }

    /// Its first screen.
    fn first_screen(&self, py: Python<'_>) -> PyResult<&str> {
        self.made(py).map(|made| made.first_screen.as_str())
    }

    /// Its proof, as JSON.
    fn figure(&self, py: Python<'_>) -> PyResult<Option<String>> {
        self.made(py)?.proof.as_ref().map(figure).transpose()
    }
}
