//! What the page in the browser calls: look at a file, propose a loop, diagnose. Each reads the files that were dropped with the readers of
//! [`drift_sim::recording`], and answers with JSON.

mod asked;
mod dropped;
mod example;

use drift_sim::control_loop::Loop;
use drift_sim::diagnosed::{Question, Read};
use drift_sim::recording::{Overview, Recording};
use drift_sim::report::Proof;
use drift_sim::stage::{self, Stage};
use drift_sim::{Error, Result, init, look};
use serde_json::{Value, json};
use wasm_bindgen::prelude::wasm_bindgen;

use asked::Asked;
use dropped::Dropped;

#[wasm_bindgen]
extern "C" {
    /// A stage began, of so many steps; 0 where that is not known.
    #[wasm_bindgen(js_name = driftBegins)]
    fn begins(name: &str, steps: u32);
    /// One step of it is done.
    #[wasm_bindgen(js_name = driftStep)]
    fn step();
    /// The program ends here; the line is for people.
    #[wasm_bindgen(js_name = driftPanics)]
    fn panics(line: &str);
}

/// Called once, before anything else: progress and faults are told to the page.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|panic| self::panics(&panic.to_string())));
    stage::listen(|stage| match stage {
        Stage::Begins(name, steps) => self::begins(name, u32::try_from(steps).unwrap_or(u32::MAX)),
        Stage::Step => self::step(),
    });
}

/// The version of drift, as JSON.
#[wasm_bindgen]
pub fn version() -> String {
    format!("\"{}\"", drift_sim::VERSION)
}

/// Two recordings of a loop as CSV, to try the page on.
///
/// # Errors
/// They can't be simulated, which nothing is known to cause.
#[wasm_bindgen(js_name = example)]
pub fn example_recordings() -> std::result::Result<String, String> {
    said(|| {
        Ok(json!({"healthy": example::recording(0.0, 1)?, "worn": example::recording(example::LOSS, 3)?}))
    })
}

/// What is in a file and what was guessed; `asked` is [`Asked`] as JSON.
///
/// # Errors
/// The one line that `drift look` prints.
#[wasm_bindgen(js_name = look)]
pub fn look_at(file: u32, name: &str, asked: &str) -> std::result::Result<String, String> {
    said(|| {
        let options = Asked::parse(asked)?.options(true)?;
        let seen = Overview::from_reader(name, || Dropped::open(file), &options)?;
        let facts = look::about(&seen).into_iter().chain(look::stretches_of(&seen));
        let picture = Proof {
            figure: look::figure(&seen),
            title: format!("r, y and u of {name}"),
            caption: String::new(),
        };
        let columns = &seen.columns;
        Ok(json!({
            "facts": facts.filter(|(fact, _)| *fact != "columns").collect::<Vec<_>>(),
            "notes": seen.notes,
            "names": seen.names,
            "columns": {"t": columns.t, "r": columns.r, "y": columns.y, "u": columns.u},
            "rows": seen.t_s.len(),
            "lacks": seen.lacks,
            "uneven": seen.sampling.as_ref().and_then(|sampling| sampling.as_ref().err()).map(ToString::to_string),
            "step": look::suggested_step(&seen),
            "picture": (!picture.figure.panels.is_empty()).then(|| picture.to_html(&format!("look{file}"))),
        }))
    })
}

/// A loop file proposed from a recording alone.
///
/// # Errors
/// The one line that `drift init` prints.
#[wasm_bindgen]
pub fn propose(file: u32, name: &str, asked: &str) -> std::result::Result<String, String> {
    said(|| {
        let mut recording = read(file, name, &Asked::parse(asked)?, Vec::new())?;
        let kept = recording.keep_longest_closed();
        let note = kept.map(|(first_s, last_s)| {
            format!("Only the longest stretch with the loop closed was used, {first_s} to {last_s} s.")
        });
        Ok(json!({"toml": init::propose(&recording)?.to_toml(), "note": note}))
    })
}

/// What is asked of a diagnosis.
#[derive(serde::Deserialize)]
struct Case {
    recording: File,
    holdout: Option<File>,
    healthy: Vec<File>,
    /// The text of a loop file, and its name.
    stated: Option<(String, String)>,
    asked: Asked,
    /// The command line that makes the same page.
    command: Vec<String>,
}

/// A dropped file: its number on the page, and its name.
#[derive(serde::Deserialize)]
struct File {
    number: u32,
    name: String,
}

/// Diagnoses; `case` is [`Case`] as JSON. The page, the improved loop file and the JSON are those that `drift diagnose` writes.
///
/// # Errors
/// The one line that `drift diagnose` prints.
#[wasm_bindgen]
pub fn diagnose(case: &str) -> std::result::Result<String, String> {
    said(|| {
        let case: Case = serde_json::from_str(case)
            .map_err(|e| Error::new(format!("what is asked can't be read: {e}")))?;
        let stated = case.stated.map(|(name, text)| Ok((name.clone().into(), Loop::parse(&text, &name)?)));
        let stated: Option<(std::path::PathBuf, Loop)> = stated.transpose()?;
        let columns: Vec<String> =
            stated.as_ref().map(|(_, model)| model.input_columns()).unwrap_or_default();
        let open = |file: &File| read(file.number, &file.name, &case.asked, columns.clone());
        let named = |file: &File| Ok(Read { file: file.name.clone().into(), recording: open(file)? });
        let question = Question {
            recordings: vec![named(&case.recording)?],
            holdout: case.holdout.as_ref().map(named).transpose()?,
            healthy: case.healthy.iter().map(named).collect::<Result<_>>()?,
            stated,
            guarantee: None,
        };
        let diagnosed = question.diagnose()?;
        let page = diagnosed
            .page(drift_sim::report::command_line(case.command.iter().map(std::ffi::OsString::from)));
        let document = serde_json::to_string_pretty(&diagnosed.json(None))
            .map_err(|e| Error::new(format!("the diagnosis can't be written as JSON: {e}")))?;
        Ok(json!({
            "title": page.title,
            "sentence": page.answer.sentence,
            "page": page.to_html()?,
            "model": diagnosed.found.improved.to_toml(),
            "json": document + "\n",
        }))
    })
}

fn read(file: u32, name: &str, asked: &Asked, extra: Vec<String>) -> Result<Recording> {
    let options = drift_sim::recording::ReadOptions { extra, ..asked.options(false)? };
    Recording::from_reader(name, Dropped::open(file), &options)
}

/// The answer as text, or the error as its one line.
fn said(answer: impl FnOnce() -> Result<Value>) -> std::result::Result<String, String> {
    answer().map(|answer| answer.to_string()).map_err(|error| error.to_string())
}
